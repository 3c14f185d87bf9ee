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
"""Microseconds of real time after which all that was written is on the disk."""


def live_texts(hello: Hello, course: Course) -> Iterator[bytes]:
    """Yield the lines of a file of messages, up to the end of the branch in view."""
    history = course.history
    yield to_json(hello)
    yield from map(course.teller.chart, dict.fromkeys(course.teller.hashes))
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
    """Writes entries to a file as they come; an entry of the past begins another branch there."""

    def __init__(self, path: Path) -> None:
        """Begin a file; `FsmkitError` (``unwritable-output``) where that cannot be done."""
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

    def begin_anew(self) -> None:
        """Drop what was written; once writing has failed, nothing."""
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
        """Write what is left."""
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
            help="the session goes on; record to another file",
        )
