"""Write the records of the interpreter's steps, byte for byte as generated C does."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError
from fsmkit.language import Value
from fsmkit.runtime import snapshot_bytes
from fsmkit.runtime.interpreter import Macrostep, Occurrence, Snapshot
from fsmkit.runtime.interpreter.snapshot import (
    Called,
    Delayed,
    InvokedMacrostep,
    Posted,
    Start,
    Taken,
)
from fsmkit.runtime.recording import machines_of
from fsmkit.runtime.tracing.numbering import Numbering
from fsmkit.runtime.tracing.records import (
    FINISHED,
    MODULUS,
    RUNNING,
    TELLS_ALL,
    End,
    EventRecord,
    InputRecord,
    Record,
    RestoreRecord,
    ResultRecord,
    SnapshotRecord,
    StartRecord,
    Sync,
    TimeRecord,
    TransitionRecord,
    record_bytes,
)


def period(chart: Chart) -> int:
    """Return the ticks from one whole state to the next: a second."""
    return max(1, 1_000_000 // chart.capacities.tick)


class Writer:
    """Writes the records of one machine of a chart.

    Args:
        chart: The chart.
        level: 1: transitions; 2: also events, inputs and results.
        saves: At level 2, add a snapshot after each sync.

    """

    def __init__(self, chart: Chart, level: int = 2, *, saves: bool = True) -> None:
        self.numbering = Numbering(chart)
        self.chart = chart
        self._tells_all = level > 1
        self._saves = saves and level > 1
        self._period = period(chart)
        self._told = 0
        self._synced = 0
        self._inputs: tuple[Value, ...] = ()

    # --- calls of the host -----------------------------------------------------------------

    def posted(self, occurrence: Occurrence) -> bytes:
        """Return the record of an event that was posted, whether it found room or not."""
        came = EventRecord(occurrence.event, occurrence.payload)
        return self._put(self._told, came) if self._tells_all else b""

    def started(self, before: Snapshot, inputs: tuple[Value, ...], step: Macrostep) -> bytes:
        """Return the records of a start; ``before``: the machine that was there till then."""
        out = self._sync(before, step.at)
        return out + self._call(step.at, inputs, (step,), is_start=True)

    def ran(
        self,
        before: Snapshot,
        now: int,
        steps: Sequence[Macrostep],
        dispatched: Occurrence | None = None,
    ) -> bytes:
        """Return the records of a call that ran a machine, or dispatched an event to it."""
        out = b""
        if (now - self._synced) % MODULUS >= self._period:
            out = self._whole(before, now)
        return out + self._call(now, before.inputs, steps, dispatched)

    def whole(self, snapshot: Snapshot, now: int) -> bytes:
        """Return the records of a machine of which a follower knows nothing yet."""
        return self._whole(snapshot, now)

    def restored(self, snapshot: Snapshot, now: int) -> bytes:
        """Return the records of a machine that was restored."""
        return self._put(now, RestoreRecord()) + self._whole(snapshot, now)

    # --- records --------------------------------------------------------------------------

    def _put(self, now: int, *records: Record) -> bytes:
        passed, self._told = now - self._told, now
        every = (TimeRecord(passed % MODULUS), *records)
        return b"".join(record_bytes(self.numbering, record) for record in every)

    def _whole(self, snapshot: Snapshot, now: int) -> bytes:
        out = self._sync(snapshot, now)
        if self._saves:
            at_now = snapshot.with_queues(now, snapshot.queue, snapshot.deferred, snapshot.timers)
            with suppress(FsmkitError):  # it holds a symbol that no saved machine can
                out += self._put(now, SnapshotRecord(snapshot_bytes.pack(self.chart, at_now)))
        return out

    def _sync(self, snapshot: Snapshot, now: int) -> bytes:
        self._told = self._synced = now
        status = RUNNING * snapshot.running | FINISHED * snapshot.finished
        sync = Sync(
            self.numbering.hash,
            now % MODULUS,
            0,
            status | TELLS_ALL * self._tells_all,
            snapshot_bytes.fault_number(snapshot.fault),
            tuple(self._numbers(snapshot, 0)),
        )
        return record_bytes(self.numbering, sync)

    def _numbers(self, snapshot: Snapshot | None, number: int) -> Iterator[int]:
        image = self.numbering.images[number]
        if snapshot is None or (number and not snapshot.running):
            yield from (0 for _ in range(len(image.plan.regions) + len(image.histories)))
        else:
            yield from snapshot_bytes.numbers_of(image, snapshot)
        inner = number + 1
        for slot, invocation in enumerate(image.chart.invocations):
            yield from self._numbers(None if snapshot is None else snapshot.invoked[slot], inner)
            inner += len(machines_of(invocation.chart))

    def _call(
        self,
        now: int,
        inputs: tuple[Value, ...],
        steps: Sequence[Macrostep],
        dispatched: Occurrence | None = None,
        *,
        is_start: bool = False,
    ) -> bytes:
        if not self._tells_all:
            return b"".join(
                self._put(step.at, record)
                for step in steps
                for record in self._items(step)
                if isinstance(record, TransitionRecord | StartRecord)
            )
        changed = [
            InputRecord(place, value)
            for place, value in enumerate(inputs)
            if is_start or not self._inputs or value != self._inputs[place]
        ]
        self._inputs = inputs
        records: list[Record] = [*changed]
        if dispatched is not None:
            records.append(EventRecord(dispatched.event, dispatched.payload, is_dispatched=True))
        records += [record for step in steps for record in self._items(step)]
        did = any(step.effects or not isinstance(step.event, Delayed) for step in steps)
        return self._put(now, *records, End()) if records or did else b""

    def _items(self, step: Macrostep, number: int = 0) -> Iterator[Record]:
        """Yield starts, transitions and results, in order."""
        if isinstance(step.event, Start):
            yield StartRecord(number)
        yield from self._of_effects(step.effects, number)

    def _of_effects(self, effects: Iterable[object], number: int) -> Iterator[Record]:
        invocations = self.numbering.machines[number].invocations
        for effect in effects:
            match effect:
                case Taken(transition):
                    yield TransitionRecord(number, transition)
                case Posted(occurrence):
                    yield EventRecord(occurrence.event, occurrence.payload)
                case Called(operation, _, result) if result is not None:
                    yield ResultRecord(number, operation, result)
                case InvokedMacrostep(slot, within):
                    before = invocations[:slot]
                    inner = number + 1 + sum(len(machines_of(each.chart)) for each in before)
                    yield from self._items(within, inner)
                case _:
                    pass
