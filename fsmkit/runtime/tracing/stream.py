"""A stream of records as it comes, in pieces of any size: nothing that is lost goes uncounted.

What cannot be read is skipped up to the next sync of a known chart, and told as `Spoilt`. A reader
that begins in the middle does the same.
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
    Passed,
    Spoilt,
    Sync,
    Told,
    fits,
    read_record,
    read_sync,
)

MOST_KEPT = 1 << 21
"""Bytes that are kept while a record is not whole: more than the longest."""


@dataclass(frozen=True, slots=True)
class Timed:
    """Something of the trace, with its time in ticks, not wrapped around, and its machine."""

    at: int
    instance: int
    told: Told


@dataclass(slots=True)
class Counts:
    """What came, and what did not."""

    records: int = 0
    lost: int = 0
    """Records that found no room where they were written."""
    gaps: int = 0
    """Frames that did not come."""
    spoilt: int = 0
    """Bytes that could not be read."""
    unknown: dict[bytes, int] = field(default_factory=dict)
    """Hashes of charts that are not at hand, with the number of their syncs."""


class Stream:
    """Bytes of one context in, records with their time out.

    Args:
        numberings: The charts that machines may be of.

    """

    def __init__(self, numberings: Iterable[Numbering]) -> None:
        self._known = {numbering.hash: numbering for numbering in numberings}
        self.counts = Counts()
        self.of: dict[int, Numbering] = {}
        """By instance: its chart, once a sync told it."""
        self._rest = b""
        self._instance = 0
        self._now: int | None = None
        self._is_lost = True
        """Whether the next sync is looked for."""
        self._skipped = 0
        self._why = "the trace does not begin here"

    @property
    def now(self) -> int:
        """The time in ticks that was told last."""
        return self._now or 0

    def feed(self, data: bytes) -> Iterator[Timed]:
        """Yield what has become whole."""
        self._rest += data
        at, is_waiting = 0, False
        while at < len(self._rest) and not is_waiting:
            after, told = self._look(at) if self._is_lost else self._read(at)
            is_waiting = after == at and not told
            for each in told:
                self._count(each)
                yield Timed(self.now, self._instance, each)
            at = after
        self._rest = self._rest[at:]

    def gap(self, gap: Gap) -> Iterator[Timed]:
        """Note that frames are missing; what was begun before them is given up."""
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
        """Note that nothing more comes; a record that was begun is told as spoilt."""
        self._skipped += len(self._rest)
        if self._rest and not self._is_lost:
            self._why = "the trace ends within a record"
        self._rest = b""
        yield from self._end_of_skipping()

    # --- reading -------------------------------------------------------------------------------

    def _read(self, at: int) -> tuple[int, list[Told]]:
        """Read a record; nothing, and the same place, where more is needed."""
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
            elif not fits(numbering, record):
                return self._lose(at, "a sync that does not fit its chart")
            else:
                self.of[record.instance] = numbering
            self._synced(record)
        elif isinstance(record, Instance):
            self._instance = record.number
        elif isinstance(record, Passed):
            self._pass(record.ticks)
        return after, [record]

    def _look(self, at: int) -> tuple[int, list[Told]]:
        """Skip what is before the next sync of a known chart; it is returned, and where it ends."""
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
                if numbering is not None and fits(numbering, sync):
                    told: list[Told] = [each.told for each in self._end_of_skipping()]
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
        """Whether the cut bytes can become a sync: the hash, as far as it is there, is known."""
        place = at + 1
        while place < min(len(self._rest), at + 6) and self._rest[place] > 0x7F:
            place += 1
        told = self._rest[place + 1 : place + 5]
        return any(known.startswith(told) for known in self._known)

    def _unknown(self, sync: Sync) -> None:
        if sync.hash in self.counts.unknown or len(self.counts.unknown) < 100:
            self.counts.unknown[sync.hash] = self.counts.unknown.get(sync.hash, 0) + 1

    def _lose(self, at: int, why: str) -> tuple[int, list[Told]]:
        """Give up the place in the stream."""
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
        """Take the reading of a 32-bit clock: half of its range lies before the last one."""
        passed = ticks % MODULUS
        self._now = self.now + (passed if passed < MODULUS // 2 else passed - MODULUS)

    def _count(self, told: Told) -> None:
        if isinstance(told, Lost):
            self.counts.lost += told.count
        elif not isinstance(told, Spoilt | Gap):
            self.counts.records += 1


class Line:
    """The same of a line that is framed."""

    def __init__(self, stream: Stream) -> None:
        self.stream = stream
        self.unframer = Unframer()

    def feed(self, data: bytes) -> Iterator[Timed]:
        """Yield what has become whole."""
        for part in self.unframer.feed(data):
            if isinstance(part, Gap):
                yield from self.stream.gap(part)
            else:
                yield from self.stream.feed(part)

    def end(self) -> Iterator[Timed]:
        """Note that nothing more comes."""
        yield from self.stream.end()
