"""Sessions as files of messages: ``hello``, the charts, then one line for each entry."""

from __future__ import annotations

import gzip
from collections.abc import Iterator
from pathlib import Path
from typing import IO, cast

from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.inspector.system_at import Course
from fsmkit.runtime.live.messages import Hello, to_json

FLUSHED_EVERY = 1_000_000
"""Maximum delay until written entries are on the disk, in microseconds."""


def live_texts(hello: Hello, course: Course) -> Iterator[bytes]:
    """Yield the lines of a file of messages, up to the end of the branch in view."""
    history = course.history
    yield to_json(hello)
    yield from map(course.encoder.chart, dict.fromkeys(course.encoder.hashes))
    states = course.folded(history.first).states
    yield b"[" + b",".join(map(to_json, states)) + b"]"
    for text in filter(None, history.branch.texts):
        yield _line(text)


def _line(text: bytes) -> bytes:
    return b"[" + text + b"]"


def _opened(path: Path) -> IO[bytes]:
    if path.suffix == ".gz":
        return cast("IO[bytes]", gzip.open(path, "wb"))
    return path.open("wb")


class Recorder:
    """Writes entries to a file as they arrive; an entry of the past starts another branch."""

    def __init__(self, path: Path) -> None:
        """Create a file; raises `FsmkitError` (``unwritable-output``) if that fails."""
        self.path = path
        self._since = 0
        self.error: FsmkitError | None = None
        """Why nothing is written any more."""
        self._file: IO[bytes] | None = None
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = _opened(path)
        except OSError as error:
            raise self._unwritable(error) from error

    def restart(self) -> None:
        """Discard the written entries, unless writing has failed."""
        if self._file is None:
            return
        self.close()
        try:
            self._file = _opened(self.path)
        except OSError as error:
            self.error = self._unwritable(error)

    def write(self, *lines: bytes) -> None:
        """Write lines; once that has failed, nothing."""
        if self._file is None:
            return
        try:
            for line in lines:
                self._file.write(line + b"\n")
        except OSError as error:
            self._give_up(error)

    def entry(self, text: bytes) -> None:
        """Write the messages of an entry."""
        self.write(_line(text))

    def advance(self, microseconds: int) -> None:
        """Let real time pass."""
        self._since += microseconds
        if self._since >= FLUSHED_EVERY and self._file is not None:
            self._since = 0
            try:
                self._file.flush()
            except OSError as error:
                self._give_up(error)

    def close(self) -> None:
        """Write the remaining entries."""
        file, self._file = self._file, None
        if file is not None:
            try:
                file.close()
            except OSError as error:
                self.error = self._unwritable(error)

    def _give_up(self, error: OSError) -> None:
        self.error = self._unwritable(error)
        self.close()

    def _unwritable(self, error: OSError) -> FsmkitError:
        return fail(
            "unwritable-output",
            f"`{self.path}` cannot be written: {error.strerror or error}",
            help="the session continues; record to another file",
        )
