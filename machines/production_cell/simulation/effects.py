"""The states that a fault met, and the first machine that failed because of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from .orchestrator import Outcome
from .recording import Recording
from .signals import MODULES

FAILING = frozenset(
    {"error", "faulted", "fallen", "emergency", "latched", "unpowered", "switched_off"}
)
"""The states of modules and supervisor in which they do not work because something went wrong."""
WITHIN = 10.0
"""An effect is looked for in this time, in s, and not after the next fault began."""


@dataclass(frozen=True)
class Effect:
    """The effect of a fault. Times in s; ``after`` is None if no machine failed.

    A link that loses frames has an effect even if all machines tolerate it: ``lost`` counts them.
    """

    fault: str
    at: float
    met: Mapping[str, str]
    """The states of all machines when it began."""
    machine: str = ""
    state: str = ""
    after: float | None = None
    lost: int = 0

    @property
    def is_idle(self) -> bool:
        """Whether nothing came of it."""
        return self.after is None and not self.lost

    def __str__(self) -> str:
        """Return what came of it, in words."""
        if self.after is not None:
            return f"{self.machine} {self.state} after {self.after:.3f} s"
        return f"{self.lost:,} frames lost" if self.lost else "without effect"

    def as_json(self) -> dict[str, Any]:
        """Return the fields by name."""
        return asdict(self)


def losses(outcome: Outcome) -> int:
    """Return how many frames the links of all boards missed."""
    lives = (report for reports in outcome.lives.values() for report in reports)
    return sum(int(r.get("losses", 0)) for r in (*outcome.reports.values(), *lives))


def effects(recording: Recording, outcome: Outcome) -> tuple[Effect, ...]:
    """Return the effect of each fault that occurred."""
    states = recording.about["states"]
    columns = {name: recording[f"{name}.state"] for name in MODULES if name in states}
    found = []
    begins = [step for step, _ in outcome.begun]
    for step, fault in outcome.begun:
        row = step - 1  # the first one that the fault can have changed
        later = [begin for begin in begins if begin > step]
        end = min([row + round(1000 * WITHIN), len(recording), *(begin - 1 for begin in later)])
        before = max(row - 1, 0)
        met = {name: states[name][int(column[before])] for name, column in columns.items()}
        failed = []
        for name, column in columns.items():
            numbers = [i for i, state in enumerate(states[name]) if state in FAILING]
            there = np.isin(column[before:end], numbers)
            entered = np.flatnonzero(there[1:] & ~there[:-1])
            if len(entered):
                place = before + 1 + int(entered[0])
                failed.append((place - row, name, states[name][int(column[place])]))
        if failed:
            first, name, state = min(failed)
            found.append(Effect(fault, step / 1000, met, name, state, first / 1000))
        else:
            lost = losses(outcome) if fault.startswith("loss") else 0
            found.append(Effect(fault, step / 1000, met, lost=lost))
    return tuple(found)
