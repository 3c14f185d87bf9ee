"""A stranger on the loopback who speaks ZMTP 3.0 by hand, or nothing that is any protocol.

Frames are written as bytes, so that no library stands between a test and what it sends. All sends
are bounded in bytes and in time; an end that hangs up ends them (rfc.zeromq.org/spec/23).
"""

from __future__ import annotations

import socket
import time
from contextlib import suppress
from pathlib import Path
from typing import Self

GREETING = b"\xff" + bytes(8) + b"\x7f\x03\x00" + b"NULL".ljust(20, b"\0") + bytes(32)
MORE, LONG, COMMAND = 1, 2, 4
CHUNK = 1 << 20
PATIENCE = 5.0
"""Seconds without progress after which a send is given up."""


def address(endpoint: str) -> tuple[str, int]:
    """Return host and port of ``tcp://host:port``."""
    host, _, port = endpoint.removeprefix("tcp://").rpartition(":")
    return host, int(port)


def frame(body: bytes, flags: int = 0) -> bytes:
    """Return a ZMTP frame."""
    if len(body) < 256:
        return bytes([flags, len(body)]) + body
    return bytes([flags | LONG]) + len(body).to_bytes(8, "big") + body


def ready(kind: str) -> bytes:
    """Return the command that ends the handshake of the mechanism NULL."""
    value = kind.encode()
    return frame(b"\x05READY\x0bSocket-Type" + len(value).to_bytes(4, "big") + value, COMMAND)


class Stranger:
    """A connection to an endpoint."""

    def __init__(self, endpoint: str, kind: str = "DEALER", *, greets: bool = True) -> None:
        self.socket = socket.create_connection(address(endpoint), timeout=PATIENCE)
        self.sent = 0
        if greets:
            self.send(GREETING + ready(kind))
            with suppress(OSError):
                self.socket.recv(4096)

    def send(self, content: bytes) -> bool:
        """Send bytes; false once the other end has hung up, or takes nothing any more."""
        view = memoryview(content)
        while view:
            try:
                done = self.socket.send(view[:CHUNK])
            except OSError:
                return False
            self.sent += done
            view = view[done:]
        return True

    def is_cut(self, seconds: float) -> bool:
        """Whether the other end hangs up within some time."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            self.socket.settimeout(max(0.01, until - time.monotonic()))
            try:
                if not self.socket.recv(65536):
                    return True
            except TimeoutError:
                return False
            except OSError:
                return True
        return False

    def close(self) -> None:
        """Hang up."""
        self.socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def resident(process: int, field: str = "VmRSS") -> int:
    """Return the kilobytes of memory of a process: ``VmRSS`` now, ``VmHWM`` at most so far."""
    text = Path(f"/proc/{process}/status").read_text(encoding="ascii")
    return next(int(line.split()[1]) for line in text.splitlines() if line.startswith(field + ":"))
