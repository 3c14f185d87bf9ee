"""Runs that violate `leads_to`, followed in the oracle: what a fair run is, once more."""

from __future__ import annotations

from fsmkit.system.properties.property import Property, evaluated, goal_place
from fsmkit.verify.engines.python.evaluate import evaluate_property
from fsmkit.verify.engines.python.oracle import Oracle
from fsmkit.verify.engines.python.temporal import action_of
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.exploration import Answer, Trail
from fsmkit.verify.statespace.global_steps import State


class FairRun:
    """Follows an answer of either engine through the states of the oracle."""

    def __init__(self, closed: ClosedSystem, answer: Answer, trail: Trail) -> None:
        self.closed, self.oracle = closed, Oracle(closed)
        self.answer, self.trail = answer, trail
        properties = closed.system.properties
        both = evaluated(properties)
        self.asked = both[answer.property]
        self.goal = both[goal_place(properties, answer.property)]
        self.taken: list[object] = []

    def holds(self, property_: Property, state: State) -> bool:
        return evaluate_property(self.closed.charts, property_, self.oracle.snapshots(state))

    def states(self) -> list[State]:
        """Return the states of the run; the steps are those of the oracle, in whatever order."""
        found = [next(e.to for e in self.oracle.initial() if e.steps == self.trail[0])]
        for steps in self.trail[1:]:
            edges = list(self.oracle.successors(found[-1]))
            number = next(n for n, e in enumerate(edges) if e.steps == steps)
            self.taken.append(self.actions(found[-1])[number])
            found.append(edges[number].to)
        return found

    def actions(self, state: State) -> list[object]:
        found = []
        for edge in self.oracle.successors(state):
            step = edge.steps[0]
            before = self.oracle.snapshots(state)[step.machine]
            found.append(action_of(self.closed, step, edge.mover, before))
        return found

    def is_stable(self, state: State) -> bool:
        return not any(e.mover.value == "internal" for e in self.oracle.successors(state))

    def check(self) -> None:
        """The run asks, is not answered any more, and is fair."""
        states = self.states()
        loop = len(self.answer.path) - 1
        assert any(
            self.holds(self.asked, state)
            and not any(self.holds(self.goal, later) for later in states[place:])
            for place, state in enumerate(states[: loop + 1])
        )
        if not self.answer.cycle:
            assert self.is_stable(states[-1])
            assert not set(self.actions(states[-1])) - {None}
            return
        assert states[loop] == states[-1]
        round_ = states[loop:-1]
        stable = [state for state in round_ if self.is_stable(state)]
        assert stable or self.closed.is_timeless
        taken = set(self.taken[loop:])
        always = set.intersection(*(set(self.actions(s)) for s in stable or round_))
        assert not always - taken - {None}
