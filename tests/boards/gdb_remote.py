"""As much of GDB's remote serial protocol as a debug probe uses: memory, go on, stop."""

from __future__ import annotations

import socket
import time
from pathlib import Path


class Probe:
    """A processor under a stub of GDB's protocol, on a socket of the file system."""

    def __init__(self, path: Path, seconds: float = 20.0) -> None:
        """Connect as soon as the stub listens; the processor stands still."""
        end = time.monotonic() + seconds
        while True:
            self._socket = socket.socket(socket.AF_UNIX)
            try:
                self._socket.connect(str(path))
                break
            except OSError:
                self._socket.close()
                if time.monotonic() > end:
                    raise
                time.sleep(0.02)
        self._socket.settimeout(seconds)
        self._rest = b""

    def close(self) -> None:
        """Let the processor go, without an answer."""
        self._socket.close()

    def read(self, address: int, size: int) -> bytes:
        """Return memory."""
        return b"".join(
            bytes.fromhex(self._request(f"m{address + at:x},{min(1024, size - at):x}"))
            for at in range(0, size, 1024)
        )

    def write(self, address: int, data: bytes) -> None:
        """Change memory."""
        assert self._request(f"M{address:x},{len(data):x}:{data.hex()}") == "OK"

    def go_on(self) -> None:
        """Let the processor run."""
        self._send("c")

    def stop(self) -> None:
        """Stop it."""
        self._socket.sendall(b"\x03")
        self._receive()

    def _request(self, text: str) -> str:
        self._send(text)
        return self._receive()

    def _send(self, text: str) -> None:
        data = text.encode()
        self._socket.sendall(b"$%b#%02x" % (data, sum(data) % 256))

    def _receive(self) -> str:
        while b"#" not in self._rest or len(self._rest.split(b"#", 1)[1]) < 2:
            more = self._socket.recv(4096)
            assert more, "the stub closed"
            self._rest = (self._rest + more).lstrip(b"+")
        packet, _, rest = self._rest.partition(b"#")
        self._rest = rest[2:].lstrip(b"+")
        self._socket.sendall(b"+")
        return packet.removeprefix(b"$").decode()
