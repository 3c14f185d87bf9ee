"""Bytes of a serial line, by the terminal interface of POSIX."""

from __future__ import annotations

import os

from fsmkit.runtime.tracing.transports import MOST_READ, ended, wrong_endpoint

IFLAG, OFLAG, CFLAG, LFLAG, ISPEED, OSPEED, CC = range(7)
"""Indices in the result of `termios.tcgetattr`."""


class SerialSource:
    """A serial line."""

    def __init__(self, address: str) -> None:
        """Open ``DEVICE:BAUD``, without the baud 115200; `FsmkitError` where that fails."""
        try:
            import termios
        except ImportError as error:
            raise wrong_endpoint(
                "this system has no terminal interface of POSIX", "use a bridge and tcp:HOST:PORT"
            ) from error
        device, colon, baud = address.rpartition(":")
        if not colon:
            device, baud = address, "115200"
        speed = getattr(termios, f"B{baud}", None) if baud.isascii() and baud.isdecimal() else None
        if not device or speed is None or baud == "0":
            raise wrong_endpoint(
                f"this system has no serial speed of `{baud}` baud",
                "use serial:DEVICE:BAUD, e.g. 115200",
            )
        self._device = device
        try:
            self._descriptor = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or error
            raise ended(f"`{device}` cannot be opened: {why}") from error
        try:
            mode = termios.tcgetattr(self._descriptor)
            mode[IFLAG] = mode[OFLAG] = mode[LFLAG] = 0
            mode[CFLAG] = termios.CS8 | termios.CREAD | termios.CLOCAL
            mode[ISPEED] = mode[OSPEED] = speed
            termios.tcsetattr(self._descriptor, termios.TCSANOW, mode)
        except termios.error as error:
            self.close()
            raise ended(f"`{device}` is not a serial line: {error.args[-1]}") from error

    def read(self) -> bytes | None:
        """Return the bytes that have arrived."""
        try:
            return os.read(self._descriptor, MOST_READ)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise ended(f"`{self._device}` cannot be read: {error.strerror or error}") from error

    def close(self) -> None:
        """Close it."""
        os.close(self._descriptor)
