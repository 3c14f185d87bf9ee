"""Store all signals of all steps in a compact file, and read them.

A head of one line in JSON (version, names of the signals, other data), then pieces of up to `PIECE`
steps: the number of steps and of bytes, each unsigned with 32 bits, then the differences from step
to step, signal by signal, compressed with zlib. They are signed, have 32 bits, the lowest byte
first, and start again with each piece.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Self

import numpy as np
import numpy.typing as npt

VERSION = 1
PIECE = 4096
"""Steps."""
Frame = npt.NDArray[np.int32]
"""The value of each signal."""


class RecordingError(Exception):
    """A file is no recording, or ends in the midst of a piece."""


class Recorder:
    """Writes a recording."""

    def __init__(self, path: Path, names: Sequence[str], about: Mapping[str, Any]) -> None:
        self._file: IO[bytes] = path.open("wb")
        head = {"recording": VERSION, "signals": list(names), "about": dict(about)}
        self._file.write(json.dumps(head).encode() + b"\n")
        self._piece = np.zeros((PIECE, len(names)), np.int32)
        self._filled = 0

    def add(self, frame: Frame) -> None:
        """Keep a step."""
        self._piece[self._filled] = frame
        self._filled += 1
        if self._filled == PIECE:
            self._flush()

    def _flush(self) -> None:
        if not self._filled:
            return
        piece = self._piece[: self._filled]
        first = np.zeros((1, piece.shape[1]), np.int32)
        changes = np.ascontiguousarray(np.diff(piece, axis=0, prepend=first).T.astype("<i4"))
        packed = zlib.compress(changes.tobytes(), 1)
        self._file.write(struct.pack("<II", self._filled, len(packed)) + packed)
        self._filled = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._flush()
        self._file.close()


class Recording:
    """A recording, read: one column for each signal, one row for each step, the first is step 1."""

    def __init__(
        self, names: Sequence[str], frames: npt.NDArray[np.int32], about: Mapping[str, Any]
    ) -> None:
        self.names = tuple(names)
        self.frames = frames
        self.about = about
        self._columns = {name: index for index, name in enumerate(names)}

    def __getitem__(self, name: str) -> Frame:
        """Return the values of a signal."""
        column: Frame = self.frames[:, self._columns[name]]
        return column

    def __contains__(self, name: str) -> bool:
        return name in self._columns

    def __len__(self) -> int:
        return len(self.frames)

    def changes(self, names: Sequence[str]) -> npt.NDArray[np.intp]:
        """Return the rows in which one of these signals is not what it was, and the first row."""
        if not len(self):
            return np.zeros(0, np.intp)
        differs = np.zeros(len(self), bool)
        differs[0] = True
        for name in names:
            column = self[name]
            differs[1:] |= column[1:] != column[:-1]
        return np.flatnonzero(differs)


def read(path: Path) -> Recording:
    """Read a recording. Raises `RecordingError` or OSError."""
    with path.open("rb") as file:
        try:
            head = json.loads(file.readline())
            if head["recording"] != VERSION:
                raise RecordingError(f"{path} is a recording of version {head['recording']}")
            names, about = head["signals"], head["about"]
        except (ValueError, KeyError, TypeError) as error:
            raise RecordingError(f"{path} is no recording") from error
        pieces = [np.zeros((0, len(names)), np.int32)]
        while size := file.read(8):
            try:
                steps, length = struct.unpack("<II", size)
                changes = np.frombuffer(zlib.decompress(file.read(length)), "<i4")
                columns = changes.reshape(len(names), steps)
            except (struct.error, zlib.error, ValueError) as error:
                raise RecordingError(f"{path} ends in the midst of a piece") from error
            pieces.append(np.cumsum(columns, axis=1, dtype=np.int32).T)
    return Recording(names, np.concatenate(pieces), about)
