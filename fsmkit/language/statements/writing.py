"""Writing of statements as text that reads back as the same statements."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import assert_never

from fsmkit.diagnostics import Text
from fsmkit.language.statements import tree as stmt
from fsmkit.language.statements.reading import is_value
from fsmkit.language.statements.tokens import (
    CLAUSES,
    JOINING,
    LITERAL_DELAY,
    NEW_LINES,
    STRING,
    Cursor,
    Lexeme,
    lexemes,
    without_comments,
)

PLAIN_NAME = re.compile(r"[^\W\d][\w.-]*(\.\*)?")
PLAIN_ARGUMENT = re.compile(r"[^\W\d]\w*")
ONE_STRING = re.compile(STRING)


def write_statements(block: stmt.Block) -> str:
    """Return statements as text, one per line; reading it gives an equal block."""
    return "\n".join(_lines(block, ""))


def write_body(block: stmt.Block) -> str:
    """Return the body of a function; a single ``return`` is written as its expression."""
    match block:
        case (stmt.Return(value),) if is_value(_one_line(value)):
            return _one_line(value)
        case _:
            return write_statements(block)


def _lines(block: stmt.Block, margin: str) -> Iterator[str]:
    for statement in block:
        match statement:
            case stmt.If(branches):
                for number, branch in enumerate(branches):
                    opening = "} else " if number else ""
                    if branch.condition is not None:
                        opening += f"if {_condition(branch.condition)} "
                    yield f"{margin}{opening}{{"
                    yield from _lines(branch.body, margin + "  ")
                yield margin + "}"
            case stmt.ForEach(array, item, index, body):
                names = _one_line(item) + ("" if index is None else f", {_one_line(index)}")
                yield f"{margin}for {names} in {_one_line(array)} {{"
                yield from _lines(body, margin + "  ")
                yield margin + "}"
            case _:
                yield margin + _terminate(_line(statement))


def _terminate(line: str) -> str:
    """Return a statement such that the next line does not continue it."""
    *_, last, _ = (Lexeme("", "", 0), *lexemes(without_comments(line)))
    return f"{line};" if last.kind in ("sign", "word") and last.text in JOINING else line


def _line(statement: stmt.WrittenStatement) -> str:
    match statement:
        case stmt.Assign(location, value, _, operator):
            return f"{_one_line(location)} {operator}= {_one_line(value)}"
        case stmt.Raise(event, arguments):
            return f"raise {_name(event)}{_arguments(arguments)}"
        case stmt.DocSend():
            return _send(statement)
        case stmt.DocCancel(id_, id_expr):
            return f"cancel {_name_or_expression(id_, id_expr)}"
        case stmt.Log(label, values):
            return _log(label, values)
        case stmt.KeywordStatement(value):
            return f"{statement.word} {_one_line(value)}"
        case stmt.Local(place, value, _, type_, is_fixed):
            word = "let" if is_fixed else "var"
            named = _one_line(place) + ("" if type_ is None else f" {_one_line(type_)}")
            return f"{word} {named}" + ("" if value is None else f" = {_one_line(value)}")
        case stmt.CallOperation(call):
            return _one_line(call)
        case stmt.Super():
            return "super"
        case stmt.Fail(reason):
            return f"unreadable {_quoted(reason)}"
        case stmt.If() | stmt.ForEach():
            raise AssertionError(statement)
        case _:
            assert_never(statement)


def _one_line(text: Text) -> str:
    """Return an expression without comments and without new lines outside its strings."""
    if "\n" not in text.value:
        return text.value
    return NEW_LINES.sub(lambda m: m[1] if m[1] is not None else " ", without_comments(text.value))


def _quoted(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)


def _name(text: Text) -> str:
    return text.value if PLAIN_NAME.fullmatch(text.value) else _quoted(text.value)


def _name_or_expression(name: Text | None, expression: Text | None) -> str:
    if expression is not None:
        return f"({_one_line(expression)})"
    return "" if name is None else _name(name)


def _arguments(arguments: tuple[stmt.DocArgument, ...]) -> str:
    if not arguments:
        return ""
    parts = []
    for argument in arguments:
        name = argument.name.value
        name = name if PLAIN_ARGUMENT.fullmatch(name) else _quoted(name)
        parts.append(f"{name} = {_one_line(argument.value)}")
    return f"({', '.join(parts)})"


def _send(send: stmt.DocSend) -> str:
    event = _name_or_expression(send.event, send.event_expr)
    if event in CLAUSES:
        event = _quoted(event)
    words = [" ".join(filter(None, ["send", event])) + _arguments(send.arguments)]
    pairs = (
        ("to", send.target, send.target_expr),
        ("as", send.id, send.id_location),
        ("type", send.type, send.type_expr),
    )
    for word, name, expression in pairs:
        if name is not None or expression is not None:
            words.append(f"{word} {_name_or_expression(name, expression)}")
    if send.delay is not None:
        is_plain = LITERAL_DELAY.fullmatch(send.delay.value)
        words.append(f"after {send.delay.value if is_plain else _quoted(send.delay.value)}")
    if send.delay_expr is not None:
        words.append(f"after ({_one_line(send.delay_expr)})")
    if send.content is not None:
        words.append(f"content {_quoted(send.content.value)}")
    if send.content_expr is not None:
        words.append(f"content ({_one_line(send.content_expr)})")
    if send.name_list:
        words.append(f"with {', '.join(_one_line(name) for name in send.name_list)}")
    return " ".join(words)


def _log(label: Text | None, values: tuple[Text, ...]) -> str:
    parts = [_one_line(value) for value in values]
    if label is not None:
        return "log " + ", ".join([_quoted(label.value), *parts])
    if not parts:
        return "log"
    # a string alone would be read as the label
    comma = ", " if ONE_STRING.fullmatch(parts[0]) else ""
    return f"log {comma}{', '.join(parts)}"


def _condition(condition: Text) -> str:
    """Return a condition, with additional parentheses where reading would end it too early.

    That is the case if it contains a brace, or if the text after its first pair looks like a
    statement.
    """
    text = _one_line(condition)
    cursor = Cursor(text, lexemes(text))
    closing = cursor.closing() if text.startswith("(") else None
    is_cut = closing is not None and not cursor.continues_expression(closing + 1)
    cursor.expression("{")
    return f"({text})" if is_cut or cursor.current.kind != "end" else text
