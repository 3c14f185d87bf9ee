"""Decides from another thread whether a loop still completes its cycles (``fsm_watch.h`` in C)."""

from __future__ import annotations

from dataclasses import dataclass, field

from fsmkit.system.deployment.watchdog import LOOKS


@dataclass(slots=True)
class Watch:
    """Watches a loop that counts its completed cycles.

    A cycle is assumed to have completed just after the look before the one that noticed it. So
    `look` returns False once the last cycle completed ``bound`` seconds ago. It never does while
    cycles complete at most half of the bound apart.

    Args:
        bound: Seconds without a completed cycle after which the loop counts as hung.
        now: The time at which the watch starts, in seconds.
        cycles: The cycles completed at that time.

    """

    bound: float
    now: float
    cycles: int = 0
    _since: float = field(init=False)

    def __post_init__(self) -> None:
        self._since = self.now

    @property
    def every(self) -> float:
        """The longest time from one look to the next, in seconds."""
        return self.bound / LOOKS

    def look(self, cycles: int, now: float) -> bool:
        """Return whether the last of so many cycles completed less than the bound ago."""
        if cycles != self.cycles:
            self.cycles = cycles
            self._since = self.now
        self.now = now
        return now - self._since < self.bound
