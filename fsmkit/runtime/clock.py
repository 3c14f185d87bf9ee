"""Clocks and durations. Clocks count microseconds; a machine's tick is a whole number of them."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Where a session reads the time."""

    def microseconds(self) -> int:
        """Return the time since the clock was made; it never goes back."""
        ...


class SimulatedClock:
    """A clock that stands still until `advance` is called."""

    def __init__(self) -> None:
        self._now = 0

    def microseconds(self) -> int:
        """Return the time."""
        return self._now

    def advance(self, microseconds: int) -> None:
        """Let time pass."""
        if microseconds < 0:
            raise ValueError(f"time does not go back: {microseconds}")
        self._now += microseconds


class WallClock:
    """The monotonic clock of the operating system."""

    def __init__(self) -> None:
        self._start = time.monotonic_ns()

    def microseconds(self) -> int:
        """Return the time since this clock was made."""
        return (time.monotonic_ns() - self._start) // 1000
