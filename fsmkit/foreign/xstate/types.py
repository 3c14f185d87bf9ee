"""The events that types declare: ``types: {events: {} as {type: 'A', n: number}}``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from fsmkit.foreign.xstate.expressions import BOOL, INT, SYMBOL
from fsmkit.foreign.xstate.script import Script, arguments

KINDS = {"number": INT, "boolean": BOOL, "string": SYMBOL}
DEEPEST = 20
ASSERTIONS = frozenset({"as_expression", "satisfies_expression"})
Fields = dict[str, dict[str, str]]
"""The type of each field of each event; empty where a chart has no such type."""


def declared_events(script: Script, configurations: Iterable[Any]) -> Fields:
    """Return the events that the key ``types`` of some configurations declares."""
    found: Fields = {}
    for node in configurations:
        given = _entry(script, node, "types")
        for declared in () if given is None else _declarations(script, given):
            for member in _members(script, declared, 0):
                _add(script, member, found)
    return found


def _declarations(script: Script, node: Any) -> Iterator[Any]:
    """Yield the type of ``{events: {} as T}``, or of ``{} as {events: T}``."""
    if node.type in ASSERTIONS:
        for member in _members(script, list(arguments(node))[-1], 0):
            for name, annotation in _properties(script, member):
                if name == "events":
                    yield annotation
        return
    events = _entry(script, node, "events")
    if events is not None and events.type in ASSERTIONS:
        yield list(arguments(events))[-1]


def _entry(script: Script, node: Any, name: str) -> Any | None:
    node = script.resolve(node)
    if node.type != "object":
        return None
    for pair in node.named_children:
        key = pair.child_by_field_name("key") if pair.type == "pair" else None
        if key is not None and script.text(key).strip("'\"") == name:
            return pair.child_by_field_name("value")
    return None


def _members(script: Script, node: Any, depth: int) -> Iterator[Any]:
    """Yield the object types of a union, with the names of types resolved."""
    if depth > DEEPEST:
        return
    match node.type:
        case "union_type" | "parenthesized_type":
            waiting = list(reversed(node.named_children))  # a union of many leans to the left
            while waiting:
                child = waiting.pop()
                if child.type == "union_type":
                    waiting.extend(reversed(child.named_children))
                else:
                    yield from _members(script, child, depth + 1)
        case "type_identifier":
            body = script.types.get(script.text(node))
            if body is not None:
                yield from _members(script, body, depth + 1)
        case "object_type" | "interface_body":
            yield node


def _properties(script: Script, node: Any) -> Iterator[tuple[str, Any]]:
    for each in node.named_children:
        if each.type == "property_signature":
            annotation = each.child_by_field_name("type")
            if annotation is not None and annotation.named_children:
                name = script.text(each.child_by_field_name("name")).strip("'\"")
                yield name, annotation.named_children[0]


def _add(script: Script, node: Any, found: Fields) -> None:
    """Add the event of one object type, if its type is a string."""
    properties = dict(_properties(script, node))
    kind = properties.pop("type", None)
    name = "" if kind is None else script.text(kind)
    if name[:1] in ("'", '"') and len(name) > 2:
        fields = found.setdefault(name[1:-1], {})
        fields.update({key: KINDS.get(script.text(each), "") for key, each in properties.items()})
