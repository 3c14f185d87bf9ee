"""Exiting states with all their active descendants: a method for each composite state."""

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
"""The greatest number of children that are tested one by one; for more, their bits are used."""


@dataclass
class Trees:
    """Prints the methods that exit states with their descendants."""

    out: Lines
    plan: Plan
    names: Names
    mover: Mover
    is_seen: bool
    """Whether exits are observed, also those without actions."""
    requested: set[int] = field(default_factory=set)
    entered: set[int] = field(default_factory=set)
    """States with a method that enters their requested descendants."""
    _possible: dict[int, bool] = field(default_factory=dict)

    def can_leave(self, state: int) -> bool:
        """Whether no descendant of a state reads the configuration while it is exited."""
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
        """Whether a method can enter a state's requested descendants; it is then printed."""
        if not all(map(self._can_enter, self.plan.substates[state])):
            return False
        self.entered.add(state)
        return True

    def _can_enter(self, state: int) -> bool:
        """Whether no descendant of a state reads the configuration while it is entered."""
        found = self.plan.chart.states[state]
        children = self.plan.substates[state]
        is_blind = not observes(found.on_entry) and found.kind is not Kind.FINAL
        return is_blind and len(children) <= MOST and all(map(self._can_enter, children))

    def print(self) -> None:
        """Print the requested methods, and those that they call."""
        for requested, print_one in (
            (self.requested, self._leave_all),
            (self.entered, self._enter),
        ):
            done: set[int] = set()
            while rest := sorted(requested - done):
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
        self.out.print_entered(state.index, quoted("+ " + state.id))
        self.mover.print_entry(state, ())
        if self.plan.substates[child]:
            self.entered.add(child)
            self.out.line(f"{ME}_restore_{self.names.bare[child]}(coming)")

    def _leave_all(self, index: int) -> None:
        state = self.plan.chart.states[index]
        doc = "Exit all active states of " + state.id + ", innermost first."
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
        self.out.print_trace(quoted("- " + state.id))
        self.mover.print_exit(state)

    def _child(self, child: int) -> None:
        if not self.plan.substates[child]:
            self._itself(self.plan.chart.states[child])
            return
        self.requested.add(child)
        self.out.line(f"{ME}_exit_{self.names.bare[child]}(gone)")

    def _is_silent(self, state: int) -> bool:
        """Whether exiting a state with its descendants has no observable effect."""
        return (
            not self.is_seen
            and self.mover.is_left_silently(self.plan.chart.states[state])
            and all(map(self._is_silent, self.plan.substates[state]))
        )
