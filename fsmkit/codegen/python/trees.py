"""How all is left that is active of a state: a method for it and for each composite one inside."""

from __future__ import annotations

from dataclasses import dataclass, field

from fsmkit.chart.analysis.effects import observes
from fsmkit.chart.chart import State
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.linking import ME
from fsmkit.codegen.python.movement import Mover
from fsmkit.codegen.python.names import Names
from fsmkit.document.document import Kind
from fsmkit.emit.python import quoted
from fsmkit.plan import Plan

MOST = 8
"""Children that are asked one after the other; of more, the active ones are found by their bits."""


@dataclass
class Trees:
    """Prints the methods that leave whole states."""

    out: Lines
    plan: Plan
    names: Names
    mover: Mover
    is_seen: bool
    """Whether somebody is told which states are left, also of those that do nothing then."""
    wanted: set[int] = field(default_factory=set)
    entered: set[int] = field(default_factory=set)
    """States for which there is a method that enters what is to come inside of them."""
    _possible: dict[int, bool] = field(default_factory=dict)

    def can_leave(self, state: int) -> bool:
        """Whether nothing inside of a state looks at what is active while it is left."""
        known = self._possible.get(state)
        if known is None:
            known = (
                not observes(self.plan.chart.states[state].on_exit)
                and len(self.plan.substates[state]) <= MOST
                and all(map(self.can_leave, self.plan.substates[state]))
            )
            self._possible[state] = known
        return known

    def enter(self, state: int) -> bool:
        """Whether there will be a method that enters what is to come inside of a state."""
        if not all(map(self._can_enter, self.plan.substates[state])):
            return False
        self.entered.add(state)
        return True

    def _can_enter(self, state: int) -> bool:
        """Whether nothing inside of a state looks at what is active while it is entered."""
        found = self.plan.chart.states[state]
        children = self.plan.substates[state]
        is_blind = not observes(found.on_entry) and found.kind is not Kind.FINAL
        return is_blind and len(children) <= MOST and all(map(self._can_enter, children))

    def print(self) -> None:
        """Print the methods that are wanted, and those that these call."""
        for wanted, print_one in ((self.wanted, self._leave_all), (self.entered, self._enter)):
            done: set[int] = set()
            while rest := sorted(wanted - done):
                for state in rest:
                    done.add(state)
                    print_one(state)

    def _enter(self, index: int) -> None:
        state = self.plan.chart.states[index]
        doc = "Enter what is to come inside of " + state.id + ", outermost first."
        with self.out.method(f"_restore_{self.names.bare[index]}", doc, "coming: int"):
            word = "if"
            for child in self.plan.substates[index]:
                if state.kind is Kind.PARALLEL:
                    self._come(child)
                    continue
                with self.out.suite(f"{word} coming & {self.names.states[child]}:"):
                    self._come(child)
                word = "elif"

    def _come(self, child: int) -> None:
        state = self.plan.chart.states[child]
        self.out.came(state.index, quoted("+ " + state.id))
        self.mover.come(state, ())
        if self.plan.substates[child]:
            self.entered.add(child)
            self.out.line(f"{ME}_restore_{self.names.bare[child]}(coming)")

    def _leave_all(self, index: int) -> None:
        state = self.plan.chart.states[index]
        doc = "Leave all that is active of " + state.id + ", innermost first."
        with self.out.method(f"_exit_{self.names.bare[index]}", doc, "gone: int"):
            word = "if"
            for child in reversed(self.plan.substates[index]):
                if not self._is_silent(child):
                    if state.kind is Kind.PARALLEL:
                        self._child(child)
                        continue
                    with self.out.suite(f"{word} gone & {self.names.states[child]}:"):
                        self._child(child)
                    word = "elif"
            self._itself(state)

    def _itself(self, state: State) -> None:
        self.out.tell(quoted("- " + state.id))
        self.mover.left(state)

    def _child(self, child: int) -> None:
        if not self.plan.substates[child]:
            self._itself(self.plan.chart.states[child])
            return
        self.wanted.add(child)
        self.out.line(f"{ME}_exit_{self.names.bare[child]}(gone)")

    def _is_silent(self, state: int) -> bool:
        """Whether leaving a state and all inside does nothing that anybody sees."""
        return (
            not self.is_seen
            and self.mover.is_left_silently(self.plan.chart.states[state])
            and all(map(self._is_silent, self.plan.substates[state]))
        )
