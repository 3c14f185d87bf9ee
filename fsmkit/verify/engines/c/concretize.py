"""Compute the earliest instants of the steps on a path through zones.

Instants are the least solution of difference constraints, each "this step occurs at least so long
after that one". A timer that must not have expired yet gives a strict constraint. Such constraints
count infinitesimals, which are replaced by a power of 1/2 that is small enough to change nothing
else.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from fsmkit.verify.statespace.actions import Action, Step

START = 0
"""The instant at which all machines start."""


@dataclass(frozen=True, slots=True)
class Expiry:
    """Whether a timer has expired at some instant: the one at an index among those of a machine."""

    machine: int
    place: int
    is_due: bool


Point = tuple[Expiry, ...]


@dataclass(frozen=True, slots=True)
class ArmedTimer:
    """A timer after a step: its previous number, from 1, or 0 if it is new; its bounds in ticks."""

    source: int
    lower: int
    upper: int


@dataclass(frozen=True, slots=True)
class PerformedStep:
    """A step as the engine performed it. ``waits``: time could pass before it."""

    step: Step
    waits: bool
    timers: tuple[ArmedTimer, ...]


DUE = -2
CLOCKS = 128
"""``FSM_TIMED_DUE`` and ``FSM_MOST_CLOCKS`` of the engine in C."""


def with_points(path: Sequence[int]) -> tuple[tuple[int, ...], tuple[Point, ...]]:
    """Separate a path from the points between its steps: before each step, and at the end."""
    steps: list[int] = []
    points: list[list[Expiry]] = [[]]
    for number in path:
        if number <= DUE:
            timer, is_below = divmod(DUE - number, 2)
            points[-1].append(Expiry(*divmod(timer, CLOCKS), is_due=not is_below))
            continue
        steps.append(number)
        if number >= 0:
            points.append([])
    return tuple(steps), tuple(map(tuple, points))


@dataclass(frozen=True, slots=True)
class _Clock:
    """A timer: the step that armed it, and its bounds."""

    since: int
    lower: int
    upper: int


@dataclass(frozen=True, slots=True)
class _Constraint:
    """Step ``later`` comes at least ``ticks`` after ``earlier``; ``strict``: more than that."""

    earlier: int
    later: int
    ticks: int
    strict: bool = False


def schedule_path(
    machines: int, path: Sequence[PerformedStep], points: Sequence[Point]
) -> tuple[list[tuple[Fraction, Step]], Fraction]:
    """Return the steps of a path, each with its earliest possible instant in ticks.

    Also returns the earliest instant of the end. ``points``: as for `with_points`. The first
    ``machines`` steps are the starts. FIRE then names a timer by its position in the order of
    deadlines, which is that of the interpreter.
    """
    armed: list[tuple[Fraction, ...]] = [()] * machines
    found = []
    *times, last = _times(machines, path, points)
    for at, performed in zip(times, path, strict=True):
        step = performed.step
        deadlines = armed[step.machine]
        if step.action is Action.FIRE:
            fired = step.argument
            earlier = [n for n, d in enumerate(deadlines) if (d, n) < (deadlines[fired], fired)]
            step = replace(step, argument=len(earlier))
        armed[step.machine] = tuple(
            deadlines[t.source - 1] if t.source else at + t.upper for t in performed.timers
        )
        found.append((at, step))
    return found, last


def _times(machines: int, path: Sequence[PerformedStep], points: Sequence[Point]) -> list[Fraction]:
    constraints = tuple(_constraints(machines, path, points))
    count = max(0, len(path) - machines) + 2
    found = [(0, 0)] * count
    for _ in range(count + 1):  # a path of the graph is not longer than that
        before = list(found)
        for c in constraints:
            ticks, small = found[c.earlier]
            found[c.later] = max(found[c.later], (ticks + c.ticks, small + c.strict))
        if found == before:
            break
    parts = 1 << (max(small for _, small in found) + 1).bit_length()
    times = [ticks + Fraction(small, parts) for ticks, small in found]
    return [*times[:1] * min(machines, len(path)), *times[1:]]


def _constraints(
    machines: int, path: Sequence[PerformedStep], points: Sequence[Point]
) -> Iterator[_Constraint]:
    armed: list[tuple[_Clock, ...]] = [()] * machines
    last = START
    for number, performed in enumerate(path):
        now = max(START, number - machines + 1)
        if now > last:
            yield _Constraint(last, now, 0)
            if not performed.waits:
                yield _Constraint(now, last, 0)
        last = now
        yield from _at(points[now] if number >= machines else (), now, armed)
        machine = performed.step.machine
        before = armed[machine]
        kept = {timer.source for timer in performed.timers}
        fired = performed.step.argument if performed.step.action is Action.FIRE else None
        if fired is not None:
            clock = before[fired]
            yield _Constraint(clock.since, now, clock.lower)
            for older in before[:fired] if clock.lower == clock.upper else ():
                yield _Constraint(now, older.since, -older.upper, strict=True)
        for place, clock in enumerate(before, 1):
            if place not in kept:
                yield _Constraint(now, clock.since, -clock.upper)
        armed[machine] = tuple(
            before[t.source - 1] if t.source else _Clock(now, t.lower, t.upper)
            for t in performed.timers
        )
    yield _Constraint(last, last + 1, 0)
    yield from _at(points[-1], last + 1, armed)
    for clocks in armed:
        for clock in clocks:
            yield _Constraint(last + 1, clock.since, -clock.upper)


def _at(point: Point, now: int, armed: Sequence[Sequence[_Clock]]) -> Iterator[_Constraint]:
    for timer in point:
        clock = armed[timer.machine][timer.place]
        if timer.is_due:
            yield _Constraint(clock.since, now, clock.upper)
        else:
            yield _Constraint(now, clock.since, -clock.upper, strict=True)
