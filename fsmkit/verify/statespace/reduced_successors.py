"""The local steps of a machine, without trying what must come to nothing or to the same.

The outcomes are those of `LocalSteps`, in its order; this only knows two laws, so that a chart
that stands open is exported in seconds. Explorations that judge do without them.

**Idle.** An event from outside does nothing where no active state has a transition on it, defers
it, or has an eventless transition, which any event gives another try (Appendix D, mainEventLoop).
That it was unhandled tells the environment nothing. Excepted is an event that a monitor hears or a
property asks for, one of the platform, which may be a fault, and any event where invoked machines
may get it or where values of inputs count as state.

**Unread.** A step is a function of the state and of what it reads. So where no run with one value
of an input has read that input, whatever else was chosen, its other values make no difference.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Self

from fsmkit.language import Value
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.system.system import OBSERVED
from fsmkit.verify.statespace.actions import Action, Chooser, Outcome, Step, Who
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.local_steps import LocalSteps


class ReducedSuccessors(LocalSteps):
    """The local steps of the machines of a closed system."""

    def __init__(self, closed: ClosedSystem) -> None:
        """Read off which events somebody hears, whatever the machine does with them."""
        super().__init__(closed)
        self._places = {free.input: place for place, free in enumerate(closed.free_inputs)}
        self._heard = tuple(self._always(machine) for machine in range(len(closed.charts)))
        self._answered: tuple[dict[frozenset[int], frozenset[int]], ...] = tuple(
            {} for _ in closed.charts
        )

    def _always(self, machine: int) -> frozenset[int]:
        """Return the events that may count in every state."""
        chart, closed = self.charts[machine], self.closed
        every = frozenset(range(len(chart.events)))
        if chart.invocations or (closed.keeps_inputs and closed.free_inputs):
            return every
        links = closed.system.event_links
        monitored = {link.port - OBSERVED for link in links if link.source == machine}
        platform = {event.index for event in chart.events if event.name.startswith("error.")}
        return every & (monitored | platform | self._asked[machine])

    def _events(self, machine: int, configuration: frozenset[int]) -> frozenset[int]:
        """Return the events that may do something in a configuration."""
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

    def explore(self, machine: int, snapshot: Snapshot, what: Step, who: Who) -> list[Outcome]:
        """Take a step with every sequence of choices that makes a difference."""
        if what.action is Action.OCCUR:
            event = self.closed.possible[what.argument].event
            if event not in self._events(machine, snapshot.configuration):
                return []
        return super().explore(machine, snapshot, what, who)

    def chooser(self, machine: int) -> Chooser:
        """Return what makes the choices; where inputs count as state each of them counts."""
        results = self.closed.results[machine]
        if not self.closed.is_open or self.closed.keeps_inputs:
            return Chooser(results)
        return ReducedChooser(results, self._places)

    def with_inputs(self, snapshot: Snapshot, chooser: Chooser) -> Snapshot:
        """Return an open chart with inputs of which the chooser learns which are read."""
        found = super().with_inputs(snapshot, chooser)
        if not isinstance(chooser, ReducedChooser):
            return found
        return replace(found, inputs=Watched(found.inputs, chooser))


class ReducedChooser(Chooser):
    """Makes choices, but of an input that no run has read only the first.

    ``places``: that of each free input among the choices, which begin with them.
    """

    def __init__(self, results: Mapping[str, tuple[Value, ...]], places: Mapping[int, int]) -> None:
        """Begin with nothing read."""
        super().__init__(results)
        self._places = places
        self._read: set[int] = set()
        """The places of inputs that a run has read since what stands before them was chosen."""

    def read(self, number: int) -> None:
        """Remember that an input was read."""
        self._read.add(self._places.get(number, -1))

    def advance(self) -> bool:
        """Go to the next sequence of choices that may differ; False after the last."""
        while self.chosen:
            place = len(self.chosen) - 1
            is_free = place < len(self._places)
            if not is_free or place in self._read:
                self.chosen[place] += 1
                if self.chosen[place] < self.limits[place]:
                    return True
            self._read.discard(place)
            self.chosen.pop()
            self.limits.pop()
        return False


class Watched(tuple[Value, ...]):  # noqa: SLOT001  (a tuple has no slots beside)
    """Values of inputs that tell a chooser which of them are read."""

    _chooser: ReducedChooser

    def __new__(cls, values: Sequence[Value], chooser: ReducedChooser) -> Self:
        """Watch some values."""
        found = super().__new__(cls, values)
        found._chooser = chooser
        return found

    def __getitem__(self, number):  # type: ignore[no-untyped-def]
        """Read one: nobody takes slices."""
        self._chooser.read(number)
        return super().__getitem__(number)

    def __iter__(self) -> Iterator[Value]:
        """Read all."""
        for number in range(len(self)):
            self._chooser.read(number)
        return super().__iter__()
