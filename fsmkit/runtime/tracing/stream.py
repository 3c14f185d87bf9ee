"""Read a stream of records in pieces of any size, and count every loss.

Unreadable bytes are skipped up to the next sync of a known chart, and reported as `Spoilt`. So is
the start of a stream that starts in the middle.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from fsmkit.runtime.tracing.framing import Unframer
from fsmkit.runtime.tracing.numbering import Numbering
from fsmkit.runtime.tracing.records import (
    MODULUS,
    SYNC,
    CutError,
    Gap,
    Instance,
    Lost,
    Spoilt,
    Sync,
    TimeRecord,
    TraceItem,
    is_sync_of,
    read_record,
    read_sync,
)

MOST_KEPT = 1 << 21
"""Maximum number of bytes stored for an incomplete record; more than the longest one."""


@dataclass(frozen=True, slots=True)
class Timed:
    """An item of the trace with its machine and its time in ticks, not wrapped around."""

    at: int
    instance: int
    told: TraceItem


@dataclass(slots=True)
class Counts:
    """The number of records and of losses."""

    records: int = 0
    lost: int = 0
    """Records that found no room where they were written."""
    gaps: int = 0
    """Frames that did not arrive."""
    spoilt: int = 0
    """Bytes that could not be read."""
    unknown: dict[bytes, int] = field(default_factory=dict)
    """Hashes of unknown charts, with the number of their syncs."""


class Stream:
    """Reads the bytes of one context.

    Args:
        numberings: Possible charts of the machines.

    """

    def __init__(self, numberings: Iterable[Numbering]) -> None:
        self._known = {numbering.hash: numbering for numbering in numberings}
        self.counts = Counts()
        self.of: dict[int, Numbering] = {}
        """The numbering of each instance, once a sync has identified its chart."""
        self._rest = b""
        self._instance = 0
        self._now: int | None = None
        self._is_lost = True
        """Whether the stream is searched for the next sync."""
        self._skipped = 0
        self._why = "the trace does not start here"

    @property
    def now(self) -> int:
        """The last recorded time in ticks."""
        return self._now or 0

    def feed(self, data: bytes) -> Iterator[Timed]:
        """Yield the complete records."""
        self._rest += data
        at, is_waiting = 0, False
        while at < len(self._rest) and not is_waiting:
            after, told = self._find_sync(at) if self._is_lost else self._read(at)
            is_waiting = after == at and not told
            for each in told:
                self._count(each)
                yield Timed(self.now, self._instance, each)
            at = after
        self._rest = self._rest[at:]

    def gap(self, gap: Gap) -> Iterator[Timed]:
        """Report missing frames; an incomplete record before them is dropped."""
        if self._rest and not self._is_lost:
            self._why = "a record was cut"
        self._skipped += len(self._rest)
        self._rest = b""
        if not self._is_lost:
            yield from self._end_of_skipping()
        self._is_lost = self._is_lost or gap.is_within
        self.counts.gaps += gap.frames
        yield Timed(self.now, self._instance, gap)

    def end(self) -> Iterator[Timed]:
        """Finish the stream; an incomplete record is reported as damaged."""
        self._skipped += len(self._rest)
        if self._rest and not self._is_lost:
            self._why = "the trace ends within a record"
        self._rest = b""
        yield from self._end_of_skipping()

    # --- reading -------------------------------------------------------------------------------

    def _read(self, at: int) -> tuple[int, list[TraceItem]]:
        """Read a record; return the same offset and no item if bytes are missing."""
        try:
            record, after = read_record(self.of.get(self._instance), self._rest, at)
        except CutError:
            if len(self._rest) - at > MOST_KEPT:
                return self._lose(at, "a record without an end")
            return at, []
        except (ValueError, IndexError) as error:
            return self._lose(at, str(error))
        if isinstance(record, Sync):
            numbering = self._known.get(record.hash)
            if numbering is None:
                self._unknown(record)
                self.of.pop(record.instance, None)
            elif not is_sync_of(numbering, record):
                return self._lose(at, "a sync that does not fit its chart")
            else:
                self.of[record.instance] = numbering
            self._synced(record)
        elif isinstance(record, Instance):
            self._instance = record.number
        elif isinstance(record, TimeRecord):
            self._pass(record.ticks)
        return after, [record]

    def _find_sync(self, at: int) -> tuple[int, list[TraceItem]]:
        """Skip to the next sync of a known chart; return the offset after it, and the items."""
        data = self._rest
        while (found := data.find(SYNC, at)) >= 0:
            self._skipped += found - at
            at = found
            try:
                sync, after = read_sync(data, at)
            except CutError:
                if self._may_be_sync(at):
                    return at, []
            except ValueError:
                pass
            else:
                numbering = self._known.get(sync.hash)
                if numbering is not None and is_sync_of(numbering, sync):
                    told: list[TraceItem] = [each.told for each in self._end_of_skipping()]
                    self._is_lost = False
                    self.of[sync.instance] = numbering
                    self._synced(sync)
                    return after, [*told, sync]
                if numbering is None and self._skipped == 0:
                    self._unknown(sync)
            self._skipped += 1
            at += 1
        self._skipped += len(data) - at
        return len(data), []

    def _may_be_sync(self, at: int) -> bool:
        """Return whether incomplete bytes can be a sync: the start of the hash is known."""
        place = at + 1
        while place < min(len(self._rest), at + 6) and self._rest[place] > 0x7F:
            place += 1
        told = self._rest[place + 1 : place + 5]
        return any(known.startswith(told) for known in self._known)

    def _unknown(self, sync: Sync) -> None:
        if sync.hash in self.counts.unknown or len(self.counts.unknown) < 100:
            self.counts.unknown[sync.hash] = self.counts.unknown.get(sync.hash, 0) + 1

    def _lose(self, at: int, why: str) -> tuple[int, list[TraceItem]]:
        """Lose the position in the stream."""
        self._is_lost, self._why, self._skipped = True, why, 1
        return at + 1, []

    def _end_of_skipping(self) -> Iterator[Timed]:
        if self._skipped:
            told = Spoilt(self._skipped, self._why)
            self.counts.spoilt += self._skipped
            self._skipped = 0
            yield Timed(self.now, self._instance, told)

    def _synced(self, sync: Sync) -> None:
        self._instance = sync.instance
        if self._now is None:
            self._now = sync.ticks
        else:
            self._pass(sync.ticks - self._now)

    def _pass(self, ticks: int) -> None:
        """Advance to a reading of a 32-bit clock; half of its range lies before the last one."""
        passed = ticks % MODULUS
        self._now = self.now + (passed if passed < MODULUS // 2 else passed - MODULUS)

    def _count(self, told: TraceItem) -> None:
        if isinstance(told, Lost):
            self.counts.lost += told.count
        elif not isinstance(told, Spoilt | Gap):
            self.counts.records += 1


class Line:
    """A stream of framed bytes."""

    def __init__(self, stream: Stream) -> None:
        self.stream = stream
        self.unframer = Unframer()

    def feed(self, data: bytes) -> Iterator[Timed]:
        """Yield the complete records."""
        for part in self.unframer.feed(data):
            if isinstance(part, Gap):
                yield from self.stream.gap(part)
            else:
                yield from self.stream.feed(part)

    def end(self) -> Iterator[Timed]:
        """Finish the stream."""
        yield from self.stream.end()
