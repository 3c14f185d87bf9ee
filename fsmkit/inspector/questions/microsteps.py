"""Recompute a macrostep, and store the machine after each microstep."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from fsmkit.chart.chart import Chart
from fsmkit.language import Value
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter.macrostep import start, step


class _Recorded:
    """A host that answers as it did, and keeps the machine after each microstep."""

    def __init__(self, chart: Chart, macrostep: snap.Macrostep) -> None:
        self._chart = chart
        self._answers = _answers(macrostep.effects)
        self.seen: list[snap.Snapshot] = []

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Return the recorded result of this call."""
        del operation, arguments
        return next(self._answers, None)

    def delay(self, least: int, greatest: int) -> int:
        """Return the longest: which one it was is known only afterwards."""
        del least
        return greatest

    def after_microstep(self, chart: Chart, snapshot: snap.Snapshot) -> None:
        """Keep the machine; those that it invoked are within."""
        if chart is self._chart:
            self.seen.append(snapshot)


def _answers(effects: tuple[snap.Effect, ...]) -> Iterator[Value | None]:
    for effect in effects:
        match effect:
            case snap.Called(result=result):
                yield result
            case snap.InvokedMacrostep(macrostep=within):
                yield from _answers(within.effects)
            case _:
                pass


def snapshots_within(chart: Chart, macrostep: snap.Macrostep) -> tuple[snap.Snapshot, ...]:
    """Return the snapshots after each microstep of a macrostep.

    Empty if they are unknown: only invoked machines ran, or the recorded results do not reproduce
    the macrostep.
    """
    host = _Recorded(chart, macrostep)
    before, cause = macrostep.before, macrostep.event
    match cause:
        case snap.Start():
            given: Mapping[int, Value] = dict(enumerate(before.data))
            again = start(chart, macrostep.at, host, before.inputs, given=given)
        case snap.Occurrence() | snap.Timeout() | None:
            again = step(chart, before, cause, host)
        case _:
            return ()
    return tuple(host.seen) if again.microsteps == macrostep.microsteps else ()
