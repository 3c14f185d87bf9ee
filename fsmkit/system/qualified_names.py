"""Qualify the names in a chart's own properties and environment by its machine.

``In(moving) and blocked`` becomes ``door.In(moving) and door.blocked``, which the readers of
systems accept. Each added character has the location of the name after it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from fsmkit.diagnostics import Text
from fsmkit.system.conditions import QUOTED, variables_of
from fsmkit.system.indices import join_texts, text_at
from fsmkit.system.machine import Machine

CONDITION = re.compile(
    rf"{QUOTED}|(?<![\w.])(?P<test>In)\s*\([^()]*\)?|(?<![\w.])occurs\s*\(\s*(?P<event>[A-Za-z_])"
    r"|(?<![\w.])(?P<call>[A-Za-z_]\w*)(?=\s*\()|(?<![\w.])(?P<name>[A-Za-z_]\w*)(?!\w|\s*\()"
)
WATCHED = re.compile(r"\s*(?:occurs\s*\(\s*)?(?=[A-Za-z_])")


def in_condition(text: Text, machine: Machine) -> Text:
    """Return a condition in which each name of the chart is qualified by the machine."""
    functions = {function.name for function in machine.chart.functions}
    functions |= {operation.name for operation in machine.chart.operations}
    names = {name.partition(".")[0] for name in (*variables_of(machine.chart), *functions)}
    places = []
    for match in CONDITION.finditer(text.value):
        group = match.lastgroup
        known = {"name": names, "call": functions}.get(group or "")
        if group is not None and (known is None or match[group] in known):
            places.append(match.start(group))
    return _inserted(text, f"{machine.name}.", places)


def in_watch(text: Text, machine: Machine) -> Text:
    """Return a line of a monitor's ``watch`` with its source qualified by the machine."""
    match = WATCHED.match(text.value)
    return text if match is None else _inserted(text, f"{machine.name}.", [match.end()])


def in_environment(text: Text, machine: Machine) -> Text:
    """Return an item of an environment qualified by the machine."""
    return in_watch(text.strip(), machine)


def _inserted(text: Text, word: str, places: list[int]) -> Text:
    return join_texts(tuple(_pieces(text, word, places)), text.span) if places else text


def _pieces(text: Text, word: str, places: list[int]) -> Iterator[Text]:
    at = 0
    for place in places:
        yield text.part(at, place)
        yield text_at(word, text.part(place, place + 1))
        at = place
    yield text.part(at, len(text.value))
