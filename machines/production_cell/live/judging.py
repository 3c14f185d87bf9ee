"""The properties of the ring, evaluated while the cell runs: each second, over the last seconds.

The evaluated window is as long as a block takes from the camera to the end of its belt. What a
step means depends on the steps before: a block in motion counts for the slot that it left. So
`BEFORE` steps are kept ahead of the window, which are read and not evaluated. Properties that need
a longer memory are evaluated when the run has ended.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..simulation import monitor
from ..simulation.observed import LAG
from ..simulation.recording import Recording

WINDOW = 20_000
"""Steps that are evaluated."""
BEFORE = 10_000
"""Steps before them: longer than any motion of a belt and any wait for a verdict."""
KEPT = BEFORE + WINDOW


class Judge:
    """Judges a run. ``names``: of the signals; ``states``: of the machines' states, by number."""

    def __init__(
        self, names: Sequence[str], states: Mapping[str, tuple[str, ...]], ring: Path
    ) -> None:
        self._names, self._ring = names, ring
        self._about = {"states": states}
        self._frames: npt.NDArray[np.int32] = np.zeros((KEPT, len(names)), np.int32)
        self._supervisor = list(names).index("supervisor.state")
        self._standing_by = states["supervisor"].index("standing_by")
        self._first = 0
        """The first step that is judged: before, axes stand anywhere."""
        self.last = 0
        """The last step."""
        self.broken: dict[str, float] = {}
        """When a property was broken first, in s."""
        self._seen: set[str] = set()
        system = monitor.read_system(ring)
        self._properties = tuple(property_.name for property_ in system.properties)

    def add(self, number: int, values: npt.NDArray[np.int32]) -> None:
        """Keep the values of a step."""
        self._frames[number % KEPT] = values
        self.last = number
        if not self._first and int(values[self._supervisor]) == self._standing_by:
            self._first = number

    def window(self) -> tuple[int, npt.NDArray[np.int32]]:
        """Return the number of the first stored step, and a copy of all stored ones."""
        begin = max(1, self.last - KEPT + 1)
        rows = np.arange(begin, self.last + 1) % KEPT
        return begin, self._frames[rows]

    def judge(
        self,
        window: tuple[int, npt.NDArray[np.int32]],
        events: Sequence[Mapping[str, Any]],
    ) -> None:
        """Evaluate a window. ``events``: the plant's reports, with times in s."""
        begin, frames = window
        if not self._first or len(frames) <= 2 * LAG:
            return
        moved = [{**e, "time": e["time"] - (begin - 1) / 1000} for e in events]
        record = Recording(self._names, frames, self._about)
        known = BEFORE if begin > 1 else 0
        first = max(known, self._first - begin)
        found = monitor.judge(record, moved, self._ring, homed=first)
        for one in found:
            if one.holds is None or one.name == "produces":
                continue
            self._seen.add(one.name)
            if not one.holds and one.time is not None:
                self.broken.setdefault(one.name, (begin - 1) / 1000 + one.time)

    def told(self) -> dict[str, float]:
        """Return `property.NAME` (0: nothing is known, 1: holds, 2: broken) and `broken.NAME`."""
        found: dict[str, float] = {}
        for name in self._properties:
            is_broken = name in self.broken
            found[f"property.{name}"] = 2 if is_broken else int(name in self._seen)
            found[f"broken.{name}"] = self.broken.get(name, 0.0)
        return found
