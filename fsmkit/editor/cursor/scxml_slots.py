"""Find the slot at an offset of SCXML that may not parse, from the open tags."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from fsmkit.document import keys
from fsmkit.document.keys import Form, Key, Keys
from fsmkit.editor.cursor.slots import Slot, What
from fsmkit.scxml.names import (
    ATTRIBUTES,
    CHILDREN,
    CONTENT,
    EXTENSION_ATTRIBUTES,
    EXTENSION_CHILDREN,
    EXTENSION_CONTENT,
    EXTENSION_ELEMENTS,
    PREFIX,
    STATES,
)

TAG = re.compile(
    r"<!--.*?(?:-->|$)|<\?.*?(?:\?>|$)|<!\[CDATA\[.*?(?:\]\]>|$)|<(/?)([\w:.-]+)", re.DOTALL
)
ATTRIBUTE = re.compile(r"([\w:.-]+)\s*=\s*(?:\"([^\"]*)(\"|$)|'([^']*)('|$))", re.DOTALL)
HOLDS_CONTENT = ("transition", "onentry", "onexit", "if", "elseif", "else", "foreach", "finalize")
EXPRESSIONS = ("cond", "expr", "location", "array", "item", "index", "fk:invariant", "namelist")
ROWS: Mapping[str, Keys] = {
    "scxml": keys.CHART,
    **dict.fromkeys((*STATES, "fk:refine"), keys.STATE),
    "transition": keys.TRANSITION,
    "invoke": keys.INVOKE,
}


@dataclass(slots=True)
class _Open:
    """An element without its end tag: name and attributes."""

    name: str
    attributes: dict[str, str] = field(default_factory=dict)


def scxml_slot(text: str, offset: int) -> Slot:
    """Return the slot at an offset."""
    open_, tag = _open_at(text, offset)
    state, events = _around(open_)
    if tag is None:
        start = text.rfind(">", 0, offset) + 1
        written = text[start:offset]
        parent = open_[-1].name if open_ else ""
        if parent == "script":
            return Slot(What.STATEMENTS, written, state=state, events=events)
        words = _children(open_)
        return Slot(What.ELEMENT, written.strip(), words=words, state=state)
    name, inside = tag
    attributes = {m[1]: m[2] or m[4] or "" for m in ATTRIBUTE.finditer(inside)}
    last = None
    for match in ATTRIBUTE.finditer(inside):
        last = match if match.end() == len(inside) and not (match[3] or match[5]) else None
    if name == "transition":
        events = tuple(attributes["event"].split()) if "event" in attributes else None
    if last is not None:
        value = last[2] if last[2] is not None else last[4] or ""
        if name in STATES:
            state = attributes.get("id", state)
        return replace(_attribute(name, last[1], value, attributes), state=state, events=events)
    if inside.strip() == "" and not inside:
        return Slot(What.ELEMENT, name, words=_children(open_), state=state)
    word = re.search(r"[\w:.-]*$", inside)
    return Slot(
        What.KEY,
        "" if word is None else word[0],
        table=_attributes(name),
        given=frozenset(attributes),
        state=state,
    )


def _open_at(text: str, offset: int) -> tuple[list[_Open], tuple[str, str] | None]:
    """Return the open elements, and the unclosed start tag with its content."""
    open_: list[_Open] = []
    at = 0
    before = text[:offset]
    while (match := TAG.search(before, at)) is not None:
        at = match.end()
        if match[2] is None:
            if match.end() == len(before) and not match[0].endswith((">",)):
                return open_, None
            continue
        end = _end_of_tag(before, at)
        if end is None:
            if match[1]:
                return open_, None
            return open_, (match[2], before[at:])
        inside = before[at:end]
        at = end + 1
        if match[1]:
            names = [o.name for o in open_]
            if match[2] in names:
                del open_[len(names) - 1 - names[::-1].index(match[2]) :]
        elif not inside.endswith("/"):
            attributes = {m[1]: m[2] or m[4] or "" for m in ATTRIBUTE.finditer(inside)}
            open_.append(_Open(match[2], attributes))
    if before.endswith("<"):
        return open_, ("", "")
    return open_, None


def _end_of_tag(text: str, at: int) -> int | None:
    quote = ""
    for place in range(at, len(text)):
        char = text[place]
        if quote:
            quote = "" if char == quote else quote
        elif char in "\"'":
            quote = char
        elif char == ">":
            return place
        elif char == "<":
            return None
    return None


def _around(open_: list[_Open]) -> tuple[str, tuple[str, ...] | None]:
    """Return the state and the events of the transition in which a place is."""
    state, events = "", None
    for element in open_:
        if element.name in STATES and "id" in element.attributes:
            state, events = element.attributes["id"], None
        elif element.name == "fk:refine":
            state, events = element.attributes.get("state", ""), None
        elif element.name == "transition" and "event" in element.attributes:
            events = tuple(element.attributes["event"].split())
    return state, events


def _children(open_: list[_Open]) -> tuple[str, ...]:
    if not open_:
        return ("scxml",)
    name = open_[-1].name
    bare = name.removeprefix(f"{PREFIX}:")
    found = [*sorted(CHILDREN.get(bare, ()))]
    found += [f"{PREFIX}:{child}" for child in sorted(EXTENSION_CHILDREN.get(bare, ()))]
    if name in HOLDS_CONTENT:
        found += [*CONTENT, *(f"{PREFIX}:{word}" for word in EXTENSION_CONTENT)]
        found += ["elseif", "else"] if name == "if" else []
    if name in ("send", "invoke", "donedata", "raise"):
        found += ["param", "content", *(["finalize"] if name == "invoke" else [])]
    if name == "fk:type":
        found += ["fk:field"]
    return tuple(found)


def _attributes(element: str) -> Keys:
    """Return the attributes of an element with their descriptions."""
    rows = ROWS.get(element, {})
    by_word = {row.scxml: row for row in rows.values() if row.scxml}
    if element.startswith(f"{PREFIX}:"):
        names = sorted(EXTENSION_ELEMENTS.get(element.removeprefix(f"{PREFIX}:"), ()))
    else:
        names = sorted(ATTRIBUTES.get(element, ()))
        names += [f"{PREFIX}:{n}" for n in sorted(EXTENSION_ATTRIBUTES.get(element, ()))]
    found: dict[str, Key] = {}
    for name in names:
        row = by_word.get(name) or rows.get(name.removeprefix(f"{PREFIX}:"))
        found[name] = Key(name, "" if row is None else row.doc)
    return found


def _attribute(element: str, name: str, value: str, given: Mapping[str, str]) -> Slot:
    """Return the slot of an attribute's value."""
    slot = Slot(What.NOTHING, value)
    rows = ROWS.get(element, {})
    row = next((r for r in rows.values() if r.scxml == name), None)
    slot = replace(slot, row=row)
    match element, name:
        case ("transition", "target"):
            return replace(slot, what=What.STATE)
        case ("scxml" | "state" | "fk:refine", "initial"):
            return replace(slot, what=What.INITIAL)
        case ("fk:refine", "state"):
            return replace(slot, what=What.INHERITED_STATE)
        case (("transition" | "send" | "raise"), "event"):
            return replace(slot, what=What.EVENT, words=() if element == "transition" else ("out",))
        case ("transition", "fk:override"):
            return replace(slot, what=What.OVERRIDE)
        case ("transition", "fk:after" | "fk:every") | ("send", "delay"):
            return replace(slot, what=What.DELAY)
        case ("data", "fk:type") | ("fk:input" | "fk:output" | "fk:field", "type"):
            return replace(slot, what=What.TYPE)
        case ("fk:operation" | "fk:event", "signature"):
            return replace(slot, what=What.SIGNATURE)
        case ("fk:event", "direction"):
            return replace(slot, what=What.WORD, words=tuple(keys.EVENTS))
        case ("scxml", "fk:extends") | ("invoke", "src"):
            return replace(slot, what=What.FILE, suffixes=(".yaml", ".yml", ".scxml"))
        case ("history", "type"):
            return replace(slot, what=What.WORD, words=("shallow", "deep"))
        case ("scxml", "version"):
            return replace(slot, what=What.WORD, words=("1.0",))
    if name in EXPRESSIONS or name.endswith("expr"):
        return replace(slot, what=What.EXPRESSION)
    if row is not None and row.form is Form.FLAG:
        return replace(slot, what=What.WORD, words=("true", "false"))
    if row is not None and row.choices:
        return replace(slot, what=What.WORD, words=tuple(row.choices))
    del given
    return slot
