"""Read a source of trace bytes: records and their replay."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fsmkit.diagnostics import Findings
from fsmkit.runtime.tracing.following import Followed, Follower
from fsmkit.runtime.tracing.framing import looks_framed
from fsmkit.runtime.tracing.numbering import Numbering
from fsmkit.runtime.tracing.stream import Line, Stream, Timed
from fsmkit.runtime.tracing.transports import Opened


class Reader:
    """Follows one context of a target.

    Args:
        opened: Source of the bytes.
        numberings: Possible charts of the machines.
        framed: Whether records come in frames; None: the transport's default, or detected from the
            first bytes.

    """

    def __init__(
        self, opened: Opened, numberings: Sequence[Numbering], *, framed: bool | None = None
    ) -> None:
        self._source = opened.source
        self.is_file = opened.framed is None
        self._framed = opened.framed if framed is None else framed
        self.stream = Stream(numberings)
        self.line: Line | None = None
        self.follower = Follower()
        self.is_over = False
        """Whether the source has ended, or, for now, a file."""

    def timed(self) -> Iterator[Timed]:
        """Yield the records that have arrived, without waiting."""
        data = self._source.read()
        self.is_over = data is None
        if data is None:
            return
        if data and self._framed is None:
            self._framed = looks_framed(data)
        if data and self._framed and self.line is None:
            self.line = Line(self.stream)
        if data:
            yield from self.stream.feed(data) if self.line is None else self.line.feed(data)

    def followed(self) -> Iterator[Followed]:
        """Yield the records that have arrived, and their replay."""
        for timed in self.timed():
            yield from self.follower.follow(timed, self.stream.of.get(timed.instance))

    def end(self) -> Iterator[Followed]:
        """Yield the damaged rest at the end of the source: an incomplete record."""
        for timed in self.stream.end():
            yield from self.follower.follow(timed, self.stream.of.get(timed.instance))

    def close(self) -> None:
        """Close the source."""
        self._source.close()

    @property
    def losses(self) -> dict[str, int]:
        """Count the losses by kind: records of the ring, frames, damaged frames, bytes."""
        counts, line = self.stream.counts, self.line
        spoilt = 0 if line is None else line.unframer.spoilt
        return {
            "lost_records": counts.lost,
            "lost_frames": counts.gaps,
            "spoilt_frames": spoilt,
            "unread_bytes": counts.spoilt,
        }

    def report(self, findings: Findings) -> None:
        """Report losses, and syncs of unknown charts."""
        for hash_ in self.stream.counts.unknown:
            findings.add(
                "foreign-trace",
                f"a machine of the chart {hash_.hex()} is traced, and no chart that is given has "
                "this hash",
                None,
                help="give the chart that it was compiled from, or its folder with --charts",
            )
        names = {
            "lost_records": "records found no room in the ring of the target",
            "lost_frames": "frames did not arrive",
            "spoilt_frames": "frames were spoilt",
            "unread_bytes": "bytes could not be read",
        }
        losses = self.losses
        lost = "; ".join(f"{losses[name]:,} {what}" for name, what in names.items() if losses[name])
        if lost:
            findings.add(
                "lost-records",
                f"parts of the trace are missing: {lost}",
                None,
                help="give the target a larger ring (FSM_TRACE_SIZE), or read it more often",
            )
