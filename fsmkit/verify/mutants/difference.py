"""Whether two systems that differ in one chart can be told apart, and by which run.

Both are explored in step by the interpreter, breadth first, over sets of states (the subset
construction): what one can do after a run, the other must be able to do after the same run. A
label is what is seen of a step: which machine moves, what comes to it, the operations it calls, the
events it sends, its outputs, a fault. What only its own configuration shows is not seen, so systems
without a difference are equivalent by traces, for their neighbours and for the host.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum
from math import gcd

from fsmkit.runtime.interpreter.snapshot import (
    Called,
    Emitted,
    Faulted,
    Macrostep,
    Occurrence,
    Overflowed,
    Snapshot,
)
from fsmkit.verify.report.counterexample import Counterexample, write
from fsmkit.verify.resources.deadline import Deadline
from fsmkit.verify.statespace.actions import (
    FAULT,
    FULL,
    MOST_RUNS,
    Action,
    Outcome,
    Step,
    TooManyChoices,
    Who,
)
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.exploration import Trail
from fsmkit.verify.statespace.global_steps import Edge, GlobalSteps, State
from fsmkit.verify.statespace.local_steps import LocalSteps

SEEN = 1 << 24
"""The first note that stands for what a step shows; below are the notes that an exploration has."""

Label = tuple[object, ...]
Pair = tuple[frozenset[State], frozenset[State]]


class Sameness(Enum):
    """What is known of two systems."""

    EQUIVALENT = "equivalent"
    DIFFERENT = "different"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Difference:
    """What a comparison found. ``run``: a shortest one that only one of the two systems has.

    ``in_mutant``: it is the second system that has it. ``pairs``: how many were compared.
    """

    sameness: Sameness
    pairs: int
    run: Counterexample | None = None
    in_mutant: bool = False
    why: str = ""


class _Seen:
    """Numbers for what steps show, the same for both systems."""

    def __init__(self) -> None:
        self._numbers: dict[tuple[object, ...], int] = {}

    def number(self, shown: tuple[object, ...]) -> int:
        return SEEN + self._numbers.setdefault(shown, len(self._numbers))


class _ObservedSteps(LocalSteps):
    """Local steps, in whose notes is what they show."""

    def __init__(self, closed: ClosedSystem, seen: _Seen) -> None:
        super().__init__(closed)
        self._seen = seen

    def outcome(
        self, machine: int, before: Snapshot, what: Step, who: Who, done: Macrostep
    ) -> Outcome:
        """Read off what a macrostep led to, and what it shows."""
        found = super().outcome(machine, before, what, who, done)
        effects = tuple(self._effects(machine, before, done))
        notes = tuple(note for note in found.notes if note in (FULL, FAULT))
        if effects or who is not Who.ENVIRONMENT or found.after != before:
            notes = (*notes, self._seen.number((*self._stimulus(machine, done), *effects)))
        return replace(found, notes=notes)

    def _stimulus(self, machine: int, done: Macrostep) -> Iterator[object]:
        match done.event:
            case Occurrence(event, payload):
                yield "takes", self.charts[machine].events[event].name, payload
            case None:
                yield ("inputs",)
            case _:
                yield ("time",)

    def _effects(self, machine: int, before: Snapshot, done: Macrostep) -> Iterator[object]:
        chart = self.charts[machine]
        for effect in done.effects:
            match effect:
                case Emitted(Occurrence(event, payload)) if effect.is_leaving:
                    yield "sends", chart.events[event].name, payload
                case Called(operation, arguments, result):
                    yield "calls", operation, arguments, result
                case Faulted(reason):
                    yield "fault", reason
                case Overflowed(queue):
                    yield "full", queue
                case _:
                    pass
        for place in range(len(chart.data), len(done.after.data)):
            if done.after.data[place] != before.data[place]:
                yield "output", place - len(chart.data), done.after.data[place]
        if done.after.running != before.running:
            yield "running", done.after.running


@dataclass(frozen=True, slots=True)
class _Side:
    """One of the systems, with what labels its steps."""

    closed: ClosedSystem
    steps: GlobalSteps

    def label(self, edge: Edge) -> Label:
        """Return what is seen of a step."""
        step = edge.steps[-1]
        if step.action is Action.ELAPSE:
            return ("tick",)
        return step.machine, edge.who, step.action is Action.OCCUR, edge.marks

    def successors(self, states: frozenset[State]) -> dict[Label, dict[State, tuple[State, Edge]]]:
        """Return, by label, the states that steps lead to, each with one step that leads there."""
        found: dict[Label, dict[State, tuple[State, Edge]]] = {}
        for state in states:
            for edge in self.steps.successors(state):
                found.setdefault(self.label(edge), {}).setdefault(edge.to, (state, edge))
        return found


def compare(
    original: ClosedSystem, mutant: ClosedSystem, deadline: Deadline, most: int
) -> Difference:
    """Compare two closed systems, of which one machine runs another chart.

    Args:
        original: The first.
        mutant: The second, with the same machines, events and properties.
        deadline: When to give up.
        most: Pairs of sets of states at most.

    Returns:
        `Sameness.UNKNOWN` where time, pairs or the choices of a step exceed their limits.

    """
    try:
        return _compared(original, mutant, deadline, most)
    except TooManyChoices:
        why = f"a step has more than {MOST_RUNS:,} combinations of choices"
        return Difference(Sameness.UNKNOWN, 0, why=why)


def _compared(
    original: ClosedSystem, mutant: ClosedSystem, deadline: Deadline, most: int
) -> Difference:
    unit = gcd(original.unit, mutant.unit)  # so that a step of time is as long in both
    original, mutant = (replace(closed, unit=unit) for closed in (original, mutant))
    seen = _Seen()
    sides = tuple(
        _Side(closed, GlobalSteps(closed, _ObservedSteps(closed, seen)))
        for closed in (original, mutant)
    )
    first: Pair = tuple(frozenset(e.to for e in side.steps.initial()) for side in sides)  # type: ignore[assignment]
    before: dict[Pair, tuple[Pair, Label] | None] = {first: None}
    ahead = [first]
    for number, pair in enumerate(ahead):
        if number % 64 == 0 and deadline.left <= 0:
            return Difference(Sameness.UNKNOWN, number, why="the time was over")
        if len(ahead) > most:
            return Difference(Sameness.UNKNOWN, number, why=f"more than {most:,} pairs of states")
        found = [side.successors(states) for side, states in zip(sides, pair, strict=True)]
        for at, (mine, other) in enumerate((found, found[::-1])):
            for label in mine:
                if label not in other:
                    labels = [*_labels(before, pair), label]
                    run = _run(sides[at], labels)
                    return Difference(Sameness.DIFFERENT, number + 1, run, in_mutant=at == 1)
        for label, reached in found[0].items():
            next_ = frozenset(reached), frozenset(found[1][label])
            if next_ not in before:
                before[next_] = pair, label
                ahead.append(next_)
    return Difference(Sameness.EQUIVALENT, len(ahead))


def _labels(before: dict[Pair, tuple[Pair, Label] | None], pair: Pair) -> list[Label]:
    """Return the labels of the way to a pair."""
    found: list[Label] = []
    while (step := before[pair]) is not None:
        pair, label = step
        found.append(label)
    return found[::-1]


def _run(side: _Side, labels: list[Label]) -> Counterexample:
    """Return a run of a system with these labels, performed in the interpreter."""
    starts = {edge.to: edge for edge in side.steps.initial()}
    layers: list[dict[State, tuple[State, Edge]]] = []
    states = frozenset(starts)
    for label in labels:
        layers.append(side.successors(states)[label])
        states = frozenset(layers[-1])
    state = next(iter(layers[-1]))
    edges: list[Edge] = []
    for layer in layers[::-1]:
        state, edge = layer[state]
        edges.append(edge)
    trail: Trail = (starts[state].steps, *((edge.steps[-1],) for edge in edges[::-1]))
    return write(side.closed, trail)
