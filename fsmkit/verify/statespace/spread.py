"""Find the part of the state, such as a queue or an input, that multiplies the state space.

Both engines use the first local states that they found. For each part (a queue, a variable) they
count its values, and the states that remain without it. The quotient of all states by these is the
factor of the part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.runtime.interpreter.snapshot import Snapshot

LOOKED_AT = 1 << 14
"""Local states of a machine that are looked at, at most."""


class Kind(Enum):
    """The kind of a part of a local state."""

    QUEUE = "queue"
    """The queue with its deferred events: they share its capacity."""
    TIMERS = "timers"
    INPUT = "input"
    DATA = "data"
    OUTPUT = "output"
    INVOKED = "invoked"


@dataclass(frozen=True, slots=True)
class Part:
    """A part; ``index`` is its index among those of its kind in the chart."""

    kind: Kind
    index: int = 0

    def of(self, chart: Chart, snapshot: Snapshot) -> object:
        """Return its value in a local state."""
        match self.kind:
            case Kind.QUEUE:
                return snapshot.queue, snapshot.deferred
            case Kind.TIMERS:
                return snapshot.timers
            case Kind.INPUT:
                return snapshot.inputs[self.index]
            case Kind.DATA:
                return snapshot.data[self.index]
            case Kind.OUTPUT:
                return snapshot.data[len(chart.data) + self.index]
            case Kind.INVOKED:
                return snapshot.invoked[self.index : self.index + 1]


@dataclass(frozen=True, slots=True)
class Spread:
    """The values of each part of `parts_of`, and the number of states without it."""

    states: int = 0
    parts: tuple[tuple[int, int], ...] = ()


UNKNOWN = Spread()
"""Nothing was looked at."""


def parts_of(chart: Chart) -> tuple[Part, ...]:
    """Return the parts of the local states of a machine, without its configuration."""
    counts = {
        Kind.QUEUE: 1,
        Kind.TIMERS: 1,
        Kind.INPUT: len(chart.inputs),
        Kind.DATA: len(chart.data),
        Kind.OUTPUT: len(chart.outputs),
        Kind.INVOKED: len(chart.invocations),
    }
    return tuple(Part(kind, index) for kind, count in counts.items() for index in range(count))


def spread_of(chart: Chart, snapshots: Sequence[Snapshot]) -> Spread:
    """Return how the first of some local states differ."""
    parts, found = parts_of(chart), []
    rows = [
        (s.configuration, s.history, s.running, s.fault, *(part.of(chart, s) for part in parts))
        for s in snapshots[:LOOKED_AT]
    ]
    for place in range(len(rows[0]) - len(parts), len(rows[0])) if rows else ():
        values = {row[place] for row in rows}
        found.append((len(values), len({row[:place] + row[place + 1 :] for row in rows})))
    return Spread(len(rows), tuple(found))


def read_spread(record: Mapping[str, Any] | None) -> Spread:
    """Parse the explorer's output (core/system/spread.c)."""
    if record is None:
        return UNKNOWN
    return Spread(record["states"], tuple((values, others) for values, others in record["parts"]))
