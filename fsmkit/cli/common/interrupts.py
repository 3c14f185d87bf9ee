"""Handle interrupts, and know the start time of the command line."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType


def _age() -> float:
    """Return the age of this process in seconds, if the system provides it."""
    try:
        fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
        started = int(fields[19]) / os.sysconf("SC_CLK_TCK")  # since the system started: proc(5)
        return max(0.0, time.clock_gettime(time.CLOCK_BOOTTIME) - started)
    except (OSError, ValueError, AttributeError, IndexError):
        return 0.0


_listening = False
_received: list[int] = []
_again: list[float] = []


def start_time() -> float:
    """Return the start of the command line by `time.monotonic`: of the process if possible."""
    return _again[-1] if _again else time.monotonic() - (_age() if _listening else 0)


@contextmanager
def restarted_clock() -> Iterator[None]:
    """Set the start of the command line to now for a block, an automatic repetition."""
    _again.append(time.monotonic())
    try:
        yield
    finally:
        _again.pop()


def listen() -> None:
    """Take an interrupt of the terminal and an order to end alike: as `KeyboardInterrupt`."""
    global _listening  # noqa: PLW0603  (of the process, as signals are)
    _listening = True
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _interrupt)


def leave_at_once() -> None:
    """End the process at the next interrupt: only cleaning up is left to do."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _leave)


def received() -> int:
    """Return the exit code of a shell for the first of them that came; 0 if none did."""
    return 128 + _received[0] if _received else 0


def _leave(number: int, frame: FrameType | None) -> None:
    del frame
    os._exit(128 + number)


def _interrupt(number: int, frame: FrameType | None) -> None:
    del frame
    _received.append(number)
    raise KeyboardInterrupt
