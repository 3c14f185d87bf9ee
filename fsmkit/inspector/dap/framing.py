"""The base protocol: messages in JSON, each behind a header with its length."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import msgspec

MOST_HEADER = 1_024
"""Bytes of a header."""
MOST_BYTES = 1_000_000
"""Bytes of a message of a debugger: lists of breakpoints and lines of a console."""
END = b"\r\n\r\n"
LENGTH = re.compile(rb"Content-Length: *(\d{1,10})", re.IGNORECASE)
TYPE = re.compile(rb"Content-Type: *[\x20-\x7e]*", re.IGNORECASE)
_decoder = msgspec.json.Decoder()


class BrokenFrameError(Exception):
    """The bytes are not a frame, so the start of the next frame is unknown."""


class Frames:
    """Splits arriving bytes into the bodies of frames.

    Headers that the protocol does not define are rejected. A web page can post HTTP to a local
    port, and its body must not be read as a message.
    """

    def __init__(self, most: int = MOST_BYTES) -> None:
        """Accept messages of at most ``most`` bytes."""
        self._buffer = bytearray()
        self._most = most

    def feed(self, data: bytes) -> Iterator[bytes]:
        """Yield the complete bodies; raises `BrokenFrameError` for an invalid header."""
        self._buffer += data
        while (head := self._head()) is not None:
            start, length = head
            if len(self._buffer) < start + length:
                return
            body = bytes(self._buffer[start : start + length])
            del self._buffer[: start + length]
            yield body

    def _head(self) -> tuple[int, int] | None:
        """Return the offset and size of the body, or None while the header is incomplete."""
        end = self._buffer.find(END, 0, MOST_HEADER)
        known = bytes(self._buffer[: end if end >= 0 else MOST_HEADER])
        *lines, last = known.split(b"\r\n")
        for line in [*lines, last] if end >= 0 else lines:
            if not (LENGTH.fullmatch(line) or TYPE.fullmatch(line)):
                raise BrokenFrameError(f"no line of a header: {line[:40]!r}")
        if end < 0:
            if len(self._buffer) >= MOST_HEADER:
                raise BrokenFrameError(f"a header of more than {MOST_HEADER} bytes")
            return None
        lengths = [int(found[1]) for line in [*lines, last] if (found := LENGTH.fullmatch(line))]
        if len(lengths) != 1:
            raise BrokenFrameError(f"a header with {len(lengths)} lengths")
        if lengths[0] > self._most:
            raise BrokenFrameError(f"a message of {lengths[0]} bytes: {self._most} are the most")
        return end + len(END), lengths[0]


def frame(message: dict[str, Any]) -> bytes:
    """Return a message with its header; all but ASCII is escaped."""
    body = json.dumps(message, separators=(",", ":")).encode("ascii")
    return b"Content-Length: %d\r\n\r\n%s" % (len(body), body)


def decode_body(body: bytes) -> Any:
    """Return the JSON of a body; raises `ValueError` if it is invalid or too deep."""
    try:
        return _decoder.decode(body)
    except RecursionError as error:
        raise ValueError("it nests too deeply") from error
