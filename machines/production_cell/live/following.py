"""Follow the logs of the boards while they run: the interpreter repeats them, step by step."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.runtime.interpreter.snapshot import Macrostep, Snapshot
from fsmkit.runtime.recording import Call, CallReader, Replayer

MOST_READ = 1 << 20
"""Bytes of a log that are read at once."""


@dataclass(frozen=True, slots=True)
class BoardEntry:
    """A step of a machine: a macrostep, or None if it only queued an event."""

    at: int
    machine: str
    macrostep: Macrostep | None
    after: Snapshot


@dataclass(slots=True)
class BoardLog:
    """The log of a board, read as it grows. ``names``: of its machines, by instance."""

    path: Path
    names: Sequence[str]
    charts: Mapping[str, Chart]
    _offset: int = 0
    _now: int = 0
    _waiting: list[tuple[int, str, Call]] = field(default_factory=list)
    _reader: CallReader | None = None
    _repeaters: dict[str, Replayer] = field(default_factory=dict)

    def begin(self) -> None:
        """Start again: the board was restarted, and writes its log from the start."""
        charts = {number: self.charts[name] for number, name in enumerate(self.names)}
        self._reader, self._offset = CallReader(charts), 0
        self._repeaters = {name: Replayer(self.charts[name]) for name in self.names}
        self._waiting.clear()

    def read(self, until: int) -> Iterator[BoardEntry]:
        """Yield the steps up to a number, as far as they are written.

        Raises `FsmkitError` if the log is invalid, or if the interpreter differs.
        """
        self._take_in()
        while self._waiting and self._waiting[0][0] <= until:
            at, name, call = self._waiting.pop(0)
            repeater = self._repeaters[name]
            for done in repeater.repeat(call):
                for result in done.results:
                    if isinstance(result, Macrostep):
                        yield BoardEntry(at, name, result, result.after)
            yield BoardEntry(at, name, None, repeater.player.snapshot)

    def _take_in(self) -> None:
        if self._reader is None:
            self.begin()
        try:
            with self.path.open("rb") as file:
                file.seek(self._offset)
                data = file.read(MOST_READ)
        except FileNotFoundError:  # the board has not started yet
            return
        self._offset += len(data)
        assert self._reader is not None  # noqa: S101  (started above)
        for number, call in self._reader.feed(data):
            self._now = _time_of(call, self._now)
            self._waiting.append((self._now, self.names[number], call))


def _time_of(call: Call, before: int) -> int:
    """Return when a call was: that of an event, which says none, is that of the run before."""
    verb, _, rest = call.lines[-1].partition(" ")
    return int(rest.split()[0]) if verb in ("run", "start") else before
