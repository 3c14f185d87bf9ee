"""The local steps of a machine, without steps that cannot have an effect.

The outcomes are those of `LocalSteps`, in its order. This class applies one law, so that a chart
with an unrestricted environment is exported in seconds. Explorations that evaluate properties do
not use it.

An external event has no effect if no active state has a transition on it, defers it, or has an
eventless transition, which any event enables again (Appendix D, mainEventLoop). Exceptions are
events that a monitor or a property observes, platform events, which may be a fault, and all events
if invoked machines may get them or if inputs are state.
"""

from __future__ import annotations

from fsmkit.runtime.interpreter.index import index_of
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.system.machine import OBSERVED
from fsmkit.verify.statespace.actions import Action, Mover, Outcome, Step
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.local_steps import LocalSteps


class ReducedSuccessors(LocalSteps):
    """The local steps of the machines of a closed system."""

    def __init__(self, closed: ClosedSystem) -> None:
        """Compute the events that some observer handles in every state of the machine."""
        super().__init__(closed)
        self._heard = tuple(self._always(machine) for machine in range(len(closed.charts)))
        self._answered: tuple[dict[frozenset[int], frozenset[int]], ...] = tuple(
            {} for _ in closed.charts
        )

    def _always(self, machine: int) -> frozenset[int]:
        """Return the events that may have an effect in every state."""
        chart, closed = self.charts[machine], self.closed
        every = frozenset(range(len(chart.events)))
        if chart.invocations or (closed.keeps_inputs and closed.free_inputs):
            return every
        links = closed.system.event_links
        monitored = {link.port - OBSERVED for link in links if link.source == machine}
        platform = {event.index for event in chart.events if event.name.startswith("error.")}
        return every & (monitored | platform | self._asked[machine])

    def _events(self, machine: int, configuration: frozenset[int]) -> frozenset[int]:
        """Return the events that may have an effect in a configuration."""
        known = self._answered[machine].get(configuration)
        if known is None:
            known = self._answered[machine][configuration] = self._found(machine, configuration)
        return known

    def _found(self, machine: int, configuration: frozenset[int]) -> frozenset[int]:
        chart = self.charts[machine]
        index = index_of(chart)
        if any(index.eventless[state] for state in configuration):
            return frozenset(range(len(chart.events)))
        taken = (index.by_event[state].keys() | index.defers[state] for state in configuration)
        return self._heard[machine].union(*taken)

    def explore(self, machine: int, snapshot: Snapshot, what: Step, mover: Mover) -> list[Outcome]:
        """Take a step unless it cannot have an effect."""
        if what.action is Action.OCCUR:
            event = self.closed.possible[what.argument].event
            if event not in self._events(machine, snapshot.configuration):
                return []
        return super().explore(machine, snapshot, what, mover)
