"""The keys of one element, by the rows of `fsmkit.document.keys`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from fsmkit.diagnostics import Text
from fsmkit.document import keys
from fsmkit.document.document import DocData
from fsmkit.document.keys import Form, Key, Keys
from fsmkit.scxml.content import read_block
from fsmkit.scxml.context import Context, words
from fsmkit.scxml.names import EXTENSION, PLAIN_TYPES, PREFIX, known_children
from fsmkit.scxml.nodes import Element

Parts = Mapping[str, list[Element]]
"""The children of an element by their words."""
NOTHING: Parts = {}


def read_keys(
    element: Element, rows: Keys, context: Context, parts: Parts = NOTHING
) -> dict[str, Any]:
    """Return the values of the given keys by field, except keys with a codec."""
    found: dict[str, Any] = {}
    places = PLACES[id(rows)]
    is_ours = element.namespace == EXTENSION
    for attribute in element.attributes:
        is_extended = attribute.namespace == (EXTENSION if not is_ours else "")
        if attribute.namespace and not is_extended:
            continue
        row = places.get(f"{PREFIX}:{attribute.name}" if is_extended else attribute.name)
        if row is None or row.form not in ATTRIBUTE:
            continue
        value = attribute.value
        if row.form in (Form.TEXT, Form.NAME, Form.CHOICE) and not is_extended:
            value = value.strip()
            if not value.value:
                continue
        found[row.field] = ATTRIBUTE[row.form](value, row, context)
    for word, elements in parts.items():
        row = places.get(word)
        if row is not None and row.form in ELEMENT:
            found[row.field] = ELEMENT[row.form](element, elements, context)
    for row in places.values():
        if row.unless and None not in (found.get(row.unless), found.get(row.field)):
            what = f"`{row.unless}` and `{row.scxml}` are both given; `{row.unless}` counts"
            context.conflict(found.pop(row.field), what)
    return found


TABLES = (
    *(keys.CHART, keys.STATE, keys.TRANSITION, keys.INVOKE, keys.USE, keys.EXIT),
    *(keys.OPERATION, keys.REQUIRED),
)
PLACES: Mapping[int, Keys] = {
    id(rows): {row.scxml.strip("<>"): row for row in rows.values() if row.scxml is not None}
    for rows in TABLES
}
"""The rows of each table by their words in SCXML."""


def _choice(value: Text, row: Key, context: Context) -> object:
    default = next(iter(row.choices))
    if value.value not in row.choices:
        context.misread(
            value,
            f"`{row.name}` cannot be `{value}`; it is read as {default}",
            f"use {' or '.join(row.choices)}",
            row.choices,
        )
    return row.choices.get(value.value, row.choices[default])


def _marks(value: Text, row: Key, context: Context) -> frozenset[str]:
    found = words(value)
    for name in found:
        if name.value not in row.choices:
            message = f"`{row.name}` of a state cannot name `{name}`"
            context.misread(name, message, f"name {', '.join(row.choices)}")
    return frozenset(name.value for name in found if name.value in row.choices)


ATTRIBUTE: Mapping[Form, Callable[[Text, Key, Context], object]] = {
    Form.TEXT: lambda value, _, __: value,
    Form.NAME: lambda value, _, __: value,
    Form.FLAG: lambda value, row, context: context.flag(value, row.name),
    Form.CHOICE: _choice,
    Form.MARKS: _marks,
    Form.NAMES: lambda value, _, __: words(value),
    Form.TARGETS: lambda value, _, __: words(value),
    Form.IDS: lambda value, _, __: words(value),
}
"""The readers of forms in attributes."""


def _handlers(_: Element, elements: Iterable[Element], context: Context) -> object:
    blocks = (read_block(element, context) for element in elements)
    return tuple(block for block in blocks if block)


def _data(parent: Element, elements: Iterable[Element], context: Context) -> tuple[DocData, ...]:
    known = known_children("datamodel") if parent.name == "scxml" else ("data",)
    found: list[DocData] = []
    for element in elements:
        if context.word(element) == "datamodel":
            inner = context.children(element, known)
            found += _data(element, (child for word, child in inner if word == "data"), context)
        elif (name := context.required(element, "id")) is not None:
            is_data = element.namespace != EXTENSION
            type_ = _type(element, context) if is_data else context.given(element, "type")
            init = _init(element, context) if is_data else context.given(element, "expr")
            found.append(DocData(name, type_, init))
    return tuple(found)


ELEMENT: Mapping[Form, Callable[[Element, list[Element], Context], object]] = {
    Form.STATEMENTS: lambda _, elements, context: read_block(elements[-1], context),
    Form.HANDLERS: _handlers,
    Form.DATA: _data,
}
"""The readers of forms in elements."""


def _init(element: Element, context: Context) -> Text | None:
    """Return the start value of a ``data`` (SCXML 5.3)."""
    value, src = context.either(element, "expr", "src")
    inline = context.inline(element)
    if inline is not None and (value or src) is not None:
        context.conflict(inline, "an attribute and content are both given; the first counts")
    if value is None and src is not None:
        return context.loaded_value(src)
    return value or inline


def _type(element: Element, context: Context) -> Text | None:
    """Return ``fk:type``, or the meaning of ``type`` of other tools."""
    own = context.fk(element, "type")
    plain = context.given(element, "type")
    if own is not None or plain is None or context.is_strict:
        return own or plain
    name, is_open, _ = plain.value.lower().partition("[]")
    known = PLAIN_TYPES.get(name.strip())
    if known is not None and is_open:
        return Text(f"{known}[]", plain.span, ())
    if known is None:
        context.complain(
            "unusable-type",
            f"`{plain}` is not a type of fsmkit; the type is inferred from the start value",
            plain,
            f'write `{PREFIX}:type="..."` with a type such as `0..100` or `uint8[4]`',
        )
        return None
    return plain if known == plain.value else Text(known, plain.span, ())
