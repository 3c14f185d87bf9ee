"""Compare two systems that differ in one chart, and find a run that only one of them has.

The interpreter explores both in step, breadth first, over sets of states (the subset construction):
after each run of one system, the other must be able to continue the same run. The label of a step
is what an observer sees: the machine that moves, the event it takes, the operations it calls, the
events it sends, its outputs, a fault. Its configuration is not observable, so systems without a
difference are trace equivalent for their neighbours and for the host.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from math import gcd

from fsmkit.verify.mutants.noted_steps import ObservedSteps, Seen
from fsmkit.verify.report.counterexample import Counterexample, write
from fsmkit.verify.resources.deadline import Deadline
from fsmkit.verify.statespace.actions import MOST_RUNS, Action, TooManyChoices
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.exploration import Trail
from fsmkit.verify.statespace.global_steps import Edge, GlobalSteps, State

Label = tuple[object, ...]
Pair = tuple[frozenset[State], frozenset[State]]


class Sameness(Enum):
    """The verdict of a comparison."""

    EQUIVALENT = "equivalent"
    DIFFERENT = "different"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Difference:
    """The result of a comparison. ``run``: a shortest one that only one of the systems has.

    ``in_mutant``: the second system has it. ``pairs``: the number of compared pairs.
    """

    sameness: Sameness
    pairs: int
    run: Counterexample | None = None
    in_mutant: bool = False
    why: str = ""


@dataclass(frozen=True, slots=True)
class _Side:
    """One of the systems, with the labels of its steps."""

    closed: ClosedSystem
    steps: GlobalSteps

    def label(self, edge: Edge) -> Label:
        """Return the observable label of a step."""
        step = edge.steps[-1]
        if step.action is Action.ELAPSE:
            return ("tick",)
        return step.machine, edge.mover, step.action is Action.OCCUR, edge.marks

    def successors(self, states: frozenset[State]) -> dict[Label, dict[State, tuple[State, Edge]]]:
        """Return, by label, the successor states, each with one step that leads to it."""
        found: dict[Label, dict[State, tuple[State, Edge]]] = {}
        for state in states:
            for edge in self.steps.successors(state):
                found.setdefault(self.label(edge), {}).setdefault(edge.to, (state, edge))
        return found


def compare(
    original: ClosedSystem, mutant: ClosedSystem, deadline: Deadline, most: int
) -> Difference:
    """Compare two closed systems that differ in the chart of one machine.

    Args:
        original: The first.
        mutant: The second, with the same machines, events and properties.
        deadline: When to stop.
        most: The maximum number of pairs of sets of states.

    Returns:
        `Sameness.UNKNOWN` if time, pairs or the choices of a step exceed their limits.

    """
    try:
        return _compare(original, mutant, deadline, most)
    except TooManyChoices:
        why = f"a step has more than {MOST_RUNS:,} combinations of choices"
        return Difference(Sameness.UNKNOWN, 0, why=why)


def _compare(
    original: ClosedSystem, mutant: ClosedSystem, deadline: Deadline, most: int
) -> Difference:
    unit = gcd(original.unit, mutant.unit)  # so that a step of time is as long in both
    original, mutant = (replace(closed, unit=unit) for closed in (original, mutant))
    seen = Seen()
    sides = tuple(
        _Side(closed, GlobalSteps(closed, ObservedSteps(closed, seen)))
        for closed in (original, mutant)
    )
    first: Pair = tuple(frozenset(e.to for e in side.steps.initial()) for side in sides)  # type: ignore[assignment]
    before: dict[Pair, tuple[Pair, Label] | None] = {first: None}
    ahead = [first]
    for number, pair in enumerate(ahead):
        if number % 64 == 0 and deadline.left <= 0:
            return Difference(Sameness.UNKNOWN, number, why="the time limit was reached")
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
    """Return the labels of the path to a pair."""
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
