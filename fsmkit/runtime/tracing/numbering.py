"""Number the items of a chart, in the order of the chart.

The numbering includes the machines in slots (`runtime.recording.machines_of`):

1. transitions: of the chart, then of each machine in a slot;
2. starts: one of each of these machines;
3. events that the host posted, in the order of the events; then events that it dispatched;
4. inputs;
5. results of operations: of the chart, then of each machine in a slot; only those with a result.

Level 1 uses 1 and 2 only.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from fsmkit.chart.chart import Chart, Operation
from fsmkit.language import Field
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.plan.image import Image, codes, image_of, size_of
from fsmkit.runtime.recording import machines_of

HASH = 4
"""Bytes of the hash of a chart in a record."""


@dataclass(frozen=True)
class Numbering:
    """The numbers of a chart's records."""

    chart: Chart

    @cached_property
    def machines(self) -> tuple[Chart, ...]:
        """The chart, then those in its slots."""
        return machines_of(self.chart)

    @cached_property
    def images(self) -> tuple[Image, ...]:
        """The formats of the machines' values."""
        return tuple(image_of(chart) for chart in self.machines)

    @cached_property
    def hash(self) -> bytes:
        """The start of the chart's fingerprint, as a sync contains it."""
        return bytes.fromhex(fingerprint(self.chart))[:HASH]

    @cached_property
    def transitions(self) -> tuple[tuple[int, int], ...]:
        """Machine and index of each, by number."""
        pairs = enumerate(self.machines)
        return tuple((m, t.index) for m, chart in pairs for t in chart.transitions)

    @property
    def first_start(self) -> int:
        """The number of the start of the chart."""
        return len(self.transitions)

    @property
    def first_event(self) -> int:
        """The number of its first event."""
        return self.first_start + len(self.machines)

    @property
    def first_dispatched(self) -> int:
        """The number of the first dispatched event."""
        return self.first_event + len(self.chart.events)

    @property
    def first_input(self) -> int:
        """The number of its first input."""
        return self.first_dispatched + len(self.chart.events)

    @property
    def first_result(self) -> int:
        """The number of the first result."""
        return self.first_input + len(self.chart.inputs)

    @cached_property
    def results(self) -> tuple[tuple[int, Operation], ...]:
        """Machine and operation of each result, in order."""
        pairs = enumerate(self.machines)
        return tuple((m, o) for m, c in pairs for o in c.operations if o.result is not None)

    @property
    def count(self) -> int:
        """The number of all items."""
        return self.first_result + len(self.results)

    @cached_property
    def fields(self) -> tuple[tuple[int, tuple[Field, ...], int], ...]:
        """By number: the machine, the fields of the payload, and its size in bytes."""
        chart = self.chart
        declared: list[tuple[int, tuple[Field, ...]]] = [(m, ()) for m, _ in self.transitions]
        declared += [(m, ()) for m in range(len(self.machines))]
        declared += 2 * [(0, event.fields) for event in chart.events]
        declared += [(0, (Field(each.name, each.type),)) for each in chart.inputs]
        declared += [(m, (Field(o.name, o.result),)) for m, o in self.results if o.result]
        return tuple((m, fields, size_of(codes(fields))) for m, fields in declared)

    def base(self, machine: int) -> int:
        """Return the number of the first transition of a machine."""
        return sum(len(chart.transitions) for chart in self.machines[:machine])

    @cached_property
    def greatest(self) -> tuple[int, ...]:
        """By number in a sync, of regions and then of histories of each machine: the last state."""
        return tuple(
            len(image.chart.states) - 1
            for image in self.images
            for _ in range(len(image.plan.regions) + len(image.histories))
        )
