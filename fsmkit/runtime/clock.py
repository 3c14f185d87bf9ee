"""Clocks and durations. Clocks count microseconds; a machine's tick is a whole number of them."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Source of the time that a session reads."""

    def microseconds(self) -> int:
        """Return the time since the creation of the clock. It never decreases."""
        ...


class SimulatedClock:
    """A clock that moves only when `advance` is called."""

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
        """Return the time since the creation of this clock."""
        return (time.monotonic_ns() - self._start) // 1000
