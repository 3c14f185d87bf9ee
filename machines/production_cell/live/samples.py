"""Samples of all signals of a run, and what is made of them for a view.

Besides the signals of the run there are: `at.SLOT`, how far the block in a slot is from the middle
of it, in counts (of the pocket: along the lane in `at.lane`); `verdict.SLOT`, what the camera said
last of the block there (0: nothing, 1: good, 2: bad, 3: unreadable); `property.NAME` (0: nothing
is known, 1: it holds so far, 2: broken) and `broken.NAME`, when, in s; `rate`, blocks moulded a
minute; `time` in s; `pace`, simulated seconds in a second; `frames_lost` between the boards.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..simulation.axes import PITCH
from ..simulation.orchestrator import Orchestrator
from ..simulation.signals import MODULES, SLOTS
from .judging import Judge

EVERY = 0.016
"""Seconds from sample to sample."""
REPORTED = 1000
"""Steps after which the counts of plant and boards are read, and the properties are judged."""
RATED = 300_000
"""Steps over which the rate is counted."""
CONTACT, CAVITY = 600, 2200
"""Where the feeder meets a block, and the way from pocket to cavity, in counts."""
BELT_OF = {
    "f0": "feeder_belt", "p": "feeder_belt",
    "e0": "extraction_belt", "e1": "extraction_belt", "e2": "extraction_belt",
}  # fmt: skip


class Samples:
    """Samples of a run; the thread of the run calls `add`, another thread `told`."""

    def __init__(self, run: Orchestrator, ring: Path) -> None:
        self._run = run
        self._place = {name: number for number, name in enumerate(run.names)}
        self._states = [self._place[f"{name}.state"] for name in MODULES]
        self._judge = Judge(run.names, run.outcome.states, ring)
        self._next = 0.0
        self._verdicts: dict[int, int] = {}
        self._ways: Mapping[int, int] = {}
        """How far the blocks in pocket and mould were pushed, in counts, by number."""
        self._moulded: deque[tuple[int, int]] = deque([(0, 0)])
        self._pace: deque[tuple[float, int]] = deque(maxlen=64)
        self._events: list[Mapping[str, Any]] = []
        self._lost = 0
        self._number = 0
        self._values = run.values.tolist()
        self._window: Any = None

    # --- the thread of the run -----------------------------------------------------------------

    def add(self, number: int, *, is_last: bool) -> None:
        """See a step; ``is_last``: there may be none after it."""
        values, place = self._run.values, self._place
        self._judge.add(number, values)
        if block := int(values[place["camera.id"]]):
            self._verdicts[block] = int(values[place["camera.verdict"]])
        self._follow_the_lane(values)
        if number % REPORTED == 0:
            self._request()
        now = time.monotonic()
        if is_last or now >= self._next:
            self._next = now + EVERY
            self._pace.append((now, number))
            self._number, self._values = number, values.tolist()

    def _follow_the_lane(self, values: Any) -> None:
        """Keep how far a block was pushed: it stays there when the feeder retracts."""
        front = int(values[self._place["feeder.position"]]) - CONTACT
        ways = {}
        for slot, begin in (("slot.p", 0), ("slot.m", CAVITY)):
            if block := int(values[self._place[slot]]):
                way = self._ways.get(block, begin)
                ways[block] = min(max(way, front), CAVITY)
        self._ways = ways

    def _request(self) -> None:
        values, place = self._run.values, self._place
        number = self._judge.last
        self._moulded.append((number, int(values[place["count.moulded"]])))
        while self._moulded[0][0] < number - RATED:
            self._moulded.popleft()
        self._events = self._run.report("plant").get("events", [])
        boards = self._run.boards
        self._lost = sum(int(self._run.report(name).get("losses", 0)) for name in boards)
        self._window = self._judge.window()

    def leaves(self) -> tuple[int, ...]:
        """Return the states of all machines, by number."""
        return tuple(self._run.values[self._states].tolist())

    # --- the thread of the hub -----------------------------------------------------------------

    def told(self) -> Mapping[str, float]:
        """Return the last sample by name; names and order stay."""
        if self._window is not None:
            window, self._window = self._window, None
            self._judge.judge(window, self._events)
        found: dict[str, float] = dict(zip(self._place, self._values, strict=True))
        for slot in SLOTS:
            found[f"at.{slot}"] = self._way(found, slot)
            found[f"verdict.{slot}"] = self._verdicts.get(int(found[f"slot.{slot}"]), 0)
        found["at.lane"] = self._ways.get(int(found["slot.p"]), 0)
        found |= self._judge.told()
        begin, end = self._moulded[0], self._moulded[-1]
        minutes = (end[0] - begin[0]) / 60_000
        found["rate"] = round((end[1] - begin[1]) / minutes, 1) if minutes else 0.0
        found["time"] = self._number / 1000
        found["pace"] = self._measured_pace()
        found["frames_lost"] = self._lost
        return found

    def _way(self, found: Mapping[str, float], slot: str) -> float:
        if slot == "m":
            return self._ways.get(int(found["slot.m"]), CAVITY) - CAVITY
        belt = BELT_OF.get(slot)
        if belt is None:
            return 0
        return (found[f"{belt}.position"] + PITCH // 2) % PITCH - PITCH // 2

    def _measured_pace(self) -> float:
        samples = list(self._pace)
        if len(samples) < 2 or time.monotonic() - samples[-1][0] > 0.5:
            return 0.0
        (began, first), (ended, last) = samples[0], samples[-1]
        return round((last - first) / 1000 / max(ended - began, 1e-3), 1)
