"""Local steps whose notes include their observable effects."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.verify.statespace.actions import FAULT, FULL, Mover, Outcome, Step
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.local_steps import LocalSteps

SEEN = 1 << 24
"""The first note for observable effects; lower notes are those of an exploration."""


class Seen:
    """Numbers of observable effects, the same for both systems."""

    def __init__(self) -> None:
        """Start without effects."""
        self._numbers: dict[tuple[object, ...], int] = {}

    def number(self, shown: tuple[object, ...]) -> int:
        """Return the number of an effect."""
        return SEEN + self._numbers.setdefault(shown, len(self._numbers))

    def shown(self, number: int) -> tuple[object, ...]:
        """Return the effect with a number."""
        return list(self._numbers)[number - SEEN]


class ObservedSteps(LocalSteps):
    """Local steps whose notes include their observable effects."""

    def __init__(self, closed: ClosedSystem, seen: Seen) -> None:
        """Take the system, and the numbers of effects."""
        super().__init__(closed)
        self._seen = seen

    def outcome(
        self, machine: int, before: snap.Snapshot, what: Step, mover: Mover, done: snap.Macrostep
    ) -> Outcome:
        """Return the outcome of a macrostep, with its observable effects."""
        found = super().outcome(machine, before, what, mover, done)
        effects = tuple(self.effects(machine, before, done))
        notes = tuple(note for note in found.notes if note in (FULL, FAULT))
        if effects or mover is not Mover.ENVIRONMENT or found.after != before:
            notes = (*notes, self._seen.number((*self._stimulus(machine, done), *effects)))
        return replace(found, notes=notes)

    def _stimulus(self, machine: int, done: snap.Macrostep) -> Iterator[object]:
        match done.event:
            case snap.Occurrence(event, payload):
                yield "takes", self.charts[machine].events[event].name, payload
            case None:
                yield ("inputs",)
            case _:
                yield ("time",)

    def effects(
        self, machine: int, before: snap.Snapshot, done: snap.Macrostep
    ) -> Iterator[object]:
        """Yield the effects of a macrostep outside of the machine."""
        chart = self.charts[machine]
        for effect in done.effects:
            match effect:
                case snap.Emitted(snap.Occurrence(event, payload)) if effect.is_leaving:
                    yield "sends", chart.events[event].name, payload
                case snap.Called(operation, arguments, result):
                    yield "calls", operation, arguments, result
                case snap.Faulted(reason):
                    yield "fault", reason
                case snap.Overflowed(queue):
                    yield "full", queue
                case _:
                    pass
        for place in range(len(chart.data), len(done.after.data)):
            if done.after.data[place] != before.data[place]:
                yield "output", chart.outputs[place - len(chart.data)].name, done.after.data[place]
        if done.after.running != before.running:
            yield "running", done.after.running
