"""Complete a line: commands, events and their fields, members, inputs, states, names."""

from __future__ import annotations

import re
from collections.abc import Iterator

from fsmkit.chart.chart import result_types
from fsmkit.inspector.shell import names
from fsmkit.inspector.shell.names import Names
from fsmkit.inspector.shell.shell import BLOCKS, COMMANDS
from fsmkit.language import BoolType, EnumType, Type

LAST = re.compile(r"[\w.:$-]*$")
"""The word that is being typed."""
Found = Iterator[tuple[str, str]]
"""Words that fit, each with a remark."""


def candidates(known: Names, text: str) -> list[tuple[str, str]]:
    """Return the words that can take the place of the last one of a line, with remarks."""
    found = LAST.search(text)
    begun = found.group() if found else ""
    before = text[: len(text) - len(begun)]
    return [(word, remark) for word, remark in _words(known, before) if word.startswith(begun)]


def _words(known: Names, before: str) -> Found:
    """Yield all possible next words."""
    words = before.split()
    if not words:
        yield from _named(known, names.events, "event")
        yield from _named(known, names.operations, "operation")
        yield from ((name, help_) for name, (_, help_) in COMMANDS.items())
        return
    match words[0], words[1:]:
        case (("post" | "why"), []):
            yield from _named(known, names.events, "event")
        case (("post" | "why"), [event, *_]):
            yield from _fields(known, event, before)
        case "set", []:
            yield from _named(known, names.inputs, "input")
        case "set", [name, *_]:
            yield from _inputs(known, name)
        case "go", []:
            yield "until", "a condition becomes true"
        case ("go", ["until", *_]) | ("watch", _) | ("break", ["if" | "changed", *_]):
            yield from _expression(known, before)
        case "break", []:
            yield "if", "a condition becomes true"
            yield from (
                (kind, "") for kind in (*BLOCKS, "taken", "fault", "error", "lost", "property")
            )
        case "break", [_, *rest] if "if" in rest:
            yield from _expression(known, before)
        case "break", [("entered" | "left") as kind] | [("event" | "sent") as kind]:
            yield from _named(known, BLOCKS[kind], kind)
        case "break", [_, _]:
            yield "if", "only where a condition holds"
        case "save", []:
            yield "as", ""
        case "save", ["as"]:
            yield from (
                ("test", "pytest"),
                ("script", "of fsmkit run"),
                ("messages", "fsmkit.live"),
            )
        case operation, [] if any(operation == o[0] for o in known.names_of_kind(names.operations)):
            yield "returns", "from here on, one value a call"
        case operation, ["returns", *_]:
            yield from _results(known, operation)
        case command, _ if command not in COMMANDS:
            yield from _fields(known, command, before)


def _named(known: Names, kind: names.Kind, remark: str) -> Found:
    for name, _, _ in known.names_of_kind(kind):
        yield name, remark


def _fields(known: Names, event: str, before: str) -> Found:
    """Yield the fields of an event that are not given yet; behind `=` the members of its type."""
    owner = next((o for o in known.names_of_kind(names.events) if o[0] == event), None)
    if owner is None:
        return
    typed, machine, chart = owner
    name = typed if typed in chart.event_index else typed.removeprefix(f"{machine}.")
    fields = {field.name: field for field in chart.events[chart.event_index[name]].fields}
    last = before.rsplit(maxsplit=1)[-1]
    if before.endswith("=") and last[:-1] in fields:
        yield from _members(fields[last[:-1]].type)
        return
    given = {word.partition("=")[0] for word in before.split()[1:]}
    for each in fields.values():
        if each.name not in given:
            yield f"{each.name}=", str(each.type)


def _inputs(known: Names, typed: str) -> Found:
    for name, machine, chart in known.names_of_kind(names.inputs):
        if name == typed:
            own = name.removeprefix(f"{machine}.")
            declared = next(i for i in chart.inputs if i.name in (name, own))
            yield from _members(declared.type)


def _results(known: Names, typed: str) -> Found:
    for name, machine, chart in known.names_of_kind(names.operations):
        if name == typed:
            types = result_types(chart)
            yield from _members(types[name if name in types else name.removeprefix(f"{machine}.")])


def _members(type_: Type) -> Found:
    match type_:
        case BoolType():
            yield from (("true", "bool"), ("false", "bool"))
        case EnumType(_, members):
            yield from ((member, str(type_)) for member in members)


def _expression(known: Names, before: str) -> Found:
    """Yield the names of an expression; within `In(` states."""
    if re.search(r"In\(\s*$", before):
        yield from _named(known, names.states, "state")
        return
    for machine, chart in known.machines.items():
        prefix = "" if len(known.machines) == 1 else f"{machine}."
        for each in (*chart.data, *chart.inputs, *chart.outputs):
            yield f"{prefix}{each.name}", str(each.type)
        yield f"{prefix}In(", "a state is active"
        for type_ in chart.types:
            if isinstance(type_, EnumType):
                yield from ((f"{type_}.{member}", "") for member in type_.members)
        yield from ((name, "constant") for name, _ in chart.constants)
