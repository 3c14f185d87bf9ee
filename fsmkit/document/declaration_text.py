"""Declarations as text: operations and events with their parameters, variables with their types."""

# mypy: disable-error-code="func-returns-value"
# (`return _reject(...)` reports and gives up)

from __future__ import annotations

import re
from dataclasses import dataclass

from fsmkit.diagnostics import Findings, Text
from fsmkit.document.document import DocField
from fsmkit.document.statement_tokens import Cursor, lexemes

EVENT_NAME = re.compile(r"[^\W\d][\w-]*(\.[\w-]+)*")
NAME = re.compile(r"[^\W\d]\w*")


@dataclass(frozen=True, slots=True)
class DocSignature:
    """``name(field type, ...) -> result``."""

    name: Text
    fields: tuple[DocField, ...] = ()
    result: Text | None = None


def read_signature(text: Text, findings: Findings) -> DocSignature | None:
    """Read the declaration of an operation or an event: ``goto(position 0..4000) -> bool``."""
    text = text.stripped()
    name = EVENT_NAME.match(text.value)
    if name is None:
        return _reject(
            findings, text, "a name is missing", "write such as `goto(position 0..4000) -> bool`"
        )
    cursor = Cursor(text.value, lexemes(text.value))
    cursor.go_to(name.end())
    fields: tuple[DocField, ...] | None = ()
    if cursor.here.text == "(":
        closing = cursor.closing()
        if closing is None:
            at = text.part(cursor.here.start, cursor.here.end)
            return _reject(findings, at, "the parameters are not closed", "close them with `)`")
        end = cursor.tokens[closing].start
        fields = _fields(text, cursor, end, findings)
        cursor.index = closing + 1
    result = None
    if cursor.accept("->"):
        result = text.part(cursor.here.start, len(text.value)).stripped()
        if not result.value:
            at = text.part(cursor.previous_end - 2, cursor.previous_end)
            return _reject(
                findings, at, "the type of the result is missing", "write such as `bool`"
            )
    elif cursor.here.kind != "end":
        rest = text.part(cursor.here.start, len(text.value))
        advice = "write such as `goto(position 0..4000) -> bool`"
        return _reject(findings, rest, f"`{rest.value}` is not expected here", advice)
    if fields is None:
        return None
    return DocSignature(text.part(0, name.end()), fields, result)


def _fields(
    text: Text, cursor: Cursor, end: int, findings: Findings
) -> tuple[DocField, ...] | None:
    """Read ``name type, name type`` between the bracket at hand and the offset ``end``."""
    cursor.take()
    found = []
    is_sound = True
    while cursor.here.start < end:
        start = cursor.here.start
        while cursor.here.start < end and cursor.here.text != ",":
            # the commas of an array's length are not those of the list
            closing = cursor.closing() if cursor.here.text in ("(", "[", "{") else None
            cursor.index = cursor.index + 1 if closing is None else closing + 1
        field = _field(text.part(start, max(start, cursor.previous_end)), findings)
        if field is None:
            is_sound = False
        else:
            found.append(field)
        if not cursor.accept(","):
            break
    return tuple(found) if is_sound else None


def _field(text: Text, findings: Findings) -> DocField | None:
    name = NAME.match(text.value)
    type_ = None if name is None else text.part(name.end(), len(text.value)).stripped()
    if name is not None and type_ is not None and type_.value and type_.value[0] not in ":=":
        return DocField(text.part(0, name.end()), type_)
    advice = "write name and type with a space between: `speed 0..100`"
    if name is None:
        return _reject(findings, text, "a parameter has no name", advice)
    if type_ is None or not type_.value:
        return _reject(findings, text, f"`{name[0]}` has no type", advice)
    message = f"`{type_.value[0]}` is not expected between name and type"
    return _reject(findings, text, message, advice)


def read_typed(text: Text, findings: Findings) -> tuple[Text | None, Text | None]:
    """Read ``type = start value``; return the two, None for what is not there."""
    text = text.stripped()
    tokens = lexemes(text.value)
    sign = next((token for token in tokens if token.kind == "sign" and token.text == "="), None)
    if sign is None:
        return (text if text.value else None), None
    type_ = text.part(0, sign.start).stripped()
    init = text.part(sign.end, len(text.value)).stripped()
    if not init.value:
        at = text.part(sign.start, sign.end)
        _reject(findings, at, "the start value is missing", "write it, or leave out the `=`")
        return (type_ if type_.value else None), None
    return (type_ if type_.value else None), init


def _reject(findings: Findings, at: Text, message: str, advice: str) -> None:
    findings.add("declaration-syntax", message, at, help=advice)
