"""The pace of a run: maximum speed, or that of a wall clock (hardware in the loop).

With a clock, boards run loops of their own. A cycle starts at each multiple of a period: the boards
get their inputs, their outputs are read, and the plant takes the steps of a period. A board without
a reply in time keeps its outputs; it is counted, not waited for.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .protocol import Json

IN_TIME = 0.6
"""The part of a period that a board has to answer in; the plant needs the rest."""
BELOW_BOARDS = 10
"""The loops of the boards have this much more priority than orchestrator and plant."""


@dataclass(frozen=True)
class Pace:
    """``hz``: cycles a second, a divisor of 1000; 0: as fast as it can, a step a cycle.

    ``priority``: of SCHED_FIFO for the loops of the boards; 0: none.
    """

    hz: int = 0
    priority: int = 0

    @property
    def steps(self) -> int:
        """Steps of the plant in a cycle."""
        return 1000 // self.hz if self.hz else 1

    def raise_priority(self) -> str:
        """Set the priority of this thread, which its threads and processes inherit.

        Returns why it was rejected, or an empty string.
        """
        if not self.priority:
            return ""
        try:
            parameter = os.sched_param(max(1, self.priority - BELOW_BOARDS))
            os.sched_setscheduler(0, os.SCHED_FIFO, parameter)
        except (AttributeError, OSError) as error:
            return str(error)
        return ""


@dataclass
class WallClock:
    """Absolute deadlines, and counts of late cycles. All times are in s."""

    period: float
    now: Callable[[], float] = time.monotonic
    sleep: Callable[[float], None] = time.sleep
    cycles: int = 0
    late: int = 0
    """Cycles that started later than a period after their deadline."""
    missed: int = 0
    """Deadlines without a cycle: plant and world stop for so many periods."""
    worst: float = 0.0
    exchanges: dict[str, list[float]] = field(default_factory=dict)
    """For each board, from a request until its answer was taken."""
    unanswered: dict[str, int] = field(default_factory=dict)
    """Cycles in which a board gave no answer in time."""
    deadline: float = -1.0
    begun: float = 0.0
    """The start of the cycle."""

    def wait(self) -> None:
        """Sleep until the next cycle starts. Deadlines that have passed completely are missed."""
        self.deadline = self.now() if self.deadline < 0 else self.deadline + self.period
        if (ahead := self.deadline - self.now()) > 0:
            self.sleep(ahead)
        self.begun = self.now()
        behind = self.begun - self.deadline
        self.cycles += 1
        self.worst = max(self.worst, behind)
        if behind > self.period:
            self.late += 1
            passed = int(behind / self.period)
            self.missed += passed
            self.deadline += passed * self.period

    def time_to_answer(self) -> float:
        """Return how long boards still have to answer in this cycle."""
        return max(0.0, self.begun + IN_TIME * self.period - self.now())

    def as_json(self) -> Json:
        """Return the counts; times are in ms."""
        boards = {}
        for name, seconds in self.exchanges.items():
            p50, p99, most = np.percentile(seconds, (50, 99, 100)) * 1000
            boards[name] = {
                "answers": len(seconds),
                "unanswered": self.unanswered.get(name, 0),
                "p50_ms": round(float(p50), 3),
                "p99_ms": round(float(p99), 3),
                "max_ms": round(float(most), 3),
            }
        return {
            "hz": round(1 / self.period),
            "cycles": self.cycles,
            "late": self.late,
            "missed": self.missed,
            "worst_ms": round(1000 * self.worst, 3),
            "exchange": boards,
        }
