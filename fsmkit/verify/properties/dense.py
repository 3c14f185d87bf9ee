"""Decide temporal properties in dense time, each kind in an exploration of its own.

A time is measured by one more clock. The other properties are decided by graphs of zones, the
coarsest ones first (``core/zones/timed_decide.c``).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from fsmkit.system.properties.property import OverGraph, Property, goal_place
from fsmkit.verify.engines.c.engine import CEngine, Progress
from fsmkit.verify.report.verdict import ENDS
from fsmkit.verify.statespace.actions import Action
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.exploration import Answer, End, Exploration, Trail

FEW = 1_000_000
"""States in discrete time that an exploration surely reaches the end of."""
WATCHED = 16
"""Delays are distinguished up to so many units beyond their limit."""


def temporal_answers(
    built: CEngine,
    closed: ClosedSystem,
    found: Exploration,
    memory: int,
    progress: Progress | None,
    names: frozenset[str],
) -> tuple[Answer, ...]:
    """Decide the temporal properties; ``names`` limits them (empty: all).

    They are decided only if the exploration ``found`` all states: a further clock does not reduce
    the number of zones, and after an interrupt nothing long starts. All of these explorations
    together keep to the deadline of the engine.
    """
    if found.end is not End.COMPLETE:
        return ()
    properties = closed.system.properties
    asked = [n for n, p in enumerate(properties) if _is_requested(p, names)]
    within = [n for n in asked if _is_timed(properties[n])]
    of_runs = [n for n in asked if n not in within]
    answers = [_measure_delay(built, closed, number, memory) for number in within]
    return (*answers, *_decide_runs(built, of_runs, memory, progress))


def _is_requested(property_: Property, names: frozenset[str]) -> bool:
    asked = not names or property_.name in names
    return asked and isinstance(property_.kind.decided, OverGraph)


def _is_timed(property_: Property) -> bool:
    decided = property_.kind.decided
    return isinstance(decided, OverGraph) and decided.is_timed


def _measure_delay(built: CEngine, closed: ClosedSystem, number: int, memory: int) -> Answer:
    """Measure a `within` by a clock that runs from one condition to the other."""
    properties = closed.system.properties
    ticks = properties[number].ticks
    most = ticks // closed.unit + WATCHED
    found, record = built.watch(number, goal_place(properties, number), most, memory, 0)
    if found.end is not End.COMPLETE:
        return Answer(number, known=False)
    pending = record["pending"]
    greatest = None if pending is None else pending[0]
    late = greatest is None or greatest > ticks
    return Answer(number, known=True, violated=late, greatest=greatest)


def _decide_runs(
    built: CEngine, numbers: list[int], memory: int, progress: Progress | None
) -> Iterator[Answer]:
    """Decide the properties that measure no time."""
    if not numbers:
        return
    command = [str(built.program), "--memory", str(memory), *built.temporal_options(numbers)]
    command += built.limits(0)
    record = built.result(command, progress)
    end = End(record["outcome"])
    given_up = f" ({record['why']})" if record["why"] and end is End.FAILED else ""
    cut_short = f"{ENDS.get(end)}{given_up} after {record['states']:,} states{_remedy(end, record)}"
    texts = record["temporal"] or [None] * len(numbers)
    for number, text in zip(numbers, texts, strict=True):
        answer = Answer(number, known=False) if text is None else built.answer(number, text)
        why = answer.why + _remedy(end, record) if end is End.COMPLETE and answer.why else cut_short
        yield answer if answer.known else replace(answer, why=why)


def _remedy(end: End, record: Mapping[str, Any]) -> str:
    """Return an option that decides a property that zones left undecided, if one is known.

    ``most_discrete`` bounds the number of states in discrete time: each timer has any remaining
    time. A program that ran out of time before its start has not counted them.
    """
    most = record.get("most_discrete", 0)
    if 0 < most <= FEW:
        return f"; try `--time discrete`, which has at most {most:,.0f} states"
    options = {End.TIME: "a longer `--timeout`", End.MEMORY: "more `--memory`"}
    return f"; {options[end]} may decide it" if end in options else ""


def cycle_place(trail: Trail, count: int) -> int:
    """Return the index in a trail of the last ``count`` steps, with the time before them.

    In a path through zones the passing of time is not a step; in its trail it is.
    """
    at = len(trail)
    while count:
        at -= 1
        count -= trail[at][0].action is not Action.ELAPSE
    before = at > 1 and at < len(trail) and trail[at - 1][0].action is Action.ELAPSE
    return at - before
