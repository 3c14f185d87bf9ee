"""Properties evaluated while the cell runs: a window may begin in the middle of a motion."""

from __future__ import annotations

import numpy as np
import pytest

from machines.production_cell.live import judging
from machines.production_cell.live.judging import Judge
from machines.production_cell.simulation.axes import PITCH
from machines.production_cell.simulation.monitor import RING

PERIOD, MOTION, ARRIVED, TAKEN = 1500, 500, 400, 900
"""Steps: from one motion of the belt to the next, of a motion, until a block is in the last slot of
the belt, and until it is taken from there."""
NAMES = ["supervisor.state", "extraction_belt.position", "slot.e2", "sorter.retracted"]


def broken(steps: int, taken: int = TAKEN) -> dict[str, float]:
    """Return what a judge finds broken in a run in which each motion brings a block to the end."""
    judge = Judge(NAMES, {"supervisor": ("standing_by",)}, RING)
    for number in range(1, steps + 1):
        turn, at = divmod(number, PERIOD)
        position = (turn + min(at, MOTION) / MOTION) * PITCH
        is_there = ARRIVED <= at < taken or at < taken - PERIOD
        judge.add(number, np.array([0, round(position), 7 if is_there else 0, 1], np.int32))
        if number % 700 == 0:
            judge.judge(judge.window(), [])
    assert judge.told()["property.P7"] > 0
    return judge.broken


@pytest.mark.slow
def test_a_window_begins_while_the_belt_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    steps = judging.KEPT + 10 * PERIOD
    assert broken(steps) == {}
    monkeypatch.setattr(judging, "BEFORE", 0)
    assert "P7" in broken(steps), "without the steps before, the block in motion counts as arrived"


def test_a_block_that_is_not_taken_is_found() -> None:
    assert "P7" in broken(5 * PERIOD, taken=PERIOD + 100)
