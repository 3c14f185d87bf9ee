"""Names of a machine as a chart can have them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeVar

from fsmkit.foreign.pytransitions.moves import Moves
from fsmkit.foreign.pytransitions.spec import GENERAL, Machine, Path
from fsmkit.foreign.words import RESERVED as WORDS

RESTING = "_alone"
"""Suffix of the child that represents a state without an active child of its own."""


Key = TypeVar("Key")


@dataclass(frozen=True, slots=True)
class Names:
    """The names in the chart of the parts of a machine."""

    chart: str
    states: dict[Path, str]
    resting: dict[Path, str]
    callables: dict[str, str]
    triggers: dict[str, str]


def names_of(moves: Moves) -> Names:
    """Return names that are valid and differ from each other."""
    machine = moves.machine
    states = _distinct(moves.states, "_".join)
    taken = set(states.values())
    resting = _distinct(sorted(moves.resting), lambda path: states[path] + RESTING, taken)
    words = re.findall(r"[^\W_]+", machine.name.value)
    chart = "".join(word[:1].upper() + word[1:] for word in words) or "Machine"
    return Names(
        chart if not chart[0].isdigit() else f"_{chart}",
        states,
        resting,
        _distinct(dict.fromkeys(called_names(machine)), lambda name: name, WORDS),
        _distinct(dict.fromkeys(s.trigger.value for s in machine.steps), lambda name: name, WORDS),
    )


def called_names(machine: Machine) -> Iterable[str]:
    """Yield the name of each callable, once for each use."""
    for name in GENERAL:
        yield from (text.value for text in machine.general[name])
    for state in machine.walk():
        for callbacks in (state.on_enter, state.on_exit, state.on_final, state.on_timeout):
            yield from (text.value for text in callbacks)
    for step in machine.steps:
        for callbacks in (step.prepare, step.conditions, step.unless, step.before, step.after):
            yield from (text.value for text in callbacks)


def _distinct(
    keys: Iterable[Key], spell: Callable[[Key], str], taken: Iterable[str] = ()
) -> dict[Key, str]:
    """Return an identifier for each key; a clash is resolved by underscores at the end."""
    used = set(taken)
    found = {}
    for key in keys:
        name = re.sub(r"\W", "_", spell(key)) or "_"
        name = f"_{name}" if name[0].isdigit() else name
        while name in used:
            name += "_"
        used.add(name)
        found[key] = name
    return found
