"""The properties of the ring, judged while the cell runs: each second, over the last seconds.

The window is as long as a block takes from the camera to the end of its belt; what needs a longer
memory is judged when the run has ended.
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
"""Steps."""


class Judge:
    """Judges a run. ``names``: of the signals; ``states``: of the machines' states, by number."""

    def __init__(
        self, names: Sequence[str], states: Mapping[str, tuple[str, ...]], ring: Path
    ) -> None:
        self._names, self._ring = names, ring
        self._about = {"states": states}
        self._frames: npt.NDArray[np.int32] = np.zeros((WINDOW, len(names)), np.int32)
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
        self._frames[number % WINDOW] = values
        self.last = number
        if not self._first and int(values[self._supervisor]) == self._standing_by:
            self._first = number

    def window(self) -> tuple[int, npt.NDArray[np.int32]]:
        """Return a copy of the last steps, and the number of the first of them."""
        begin = max(1, self.last - WINDOW + 1)
        rows = np.arange(begin, self.last + 1) % WINDOW
        return begin, self._frames[rows]

    def judge(
        self,
        window: tuple[int, npt.NDArray[np.int32]],
        events: Sequence[Mapping[str, Any]],
    ) -> None:
        """Judge a window. ``events``: all that the plant told, with times in s."""
        begin, frames = window
        if not self._first or len(frames) <= 2 * LAG:
            return
        moved = [{**e, "time": e["time"] - (begin - 1) / 1000} for e in events]
        record = Recording(self._names, frames, self._about)
        homed = max(0, self._first - begin)
        found = monitor.judge(record, moved, self._ring, homed=homed)
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
