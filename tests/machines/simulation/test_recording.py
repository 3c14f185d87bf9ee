"""Recordings, and the properties of ring.yaml judged on them."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsmkit
from machines.production_cell.simulation import monitor, recording
from machines.production_cell.simulation.recording import Recorder, Recording, RecordingError
from machines.production_cell.simulation.signals import MODULES, PLANT, WORLD_OUTPUTS

NAMES = ("a", "b", "c")
CELL = Path(__file__).parents[3] / "machines/production_cell"


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    chance = np.random.default_rng(1)
    frames = chance.integers(-(2**31), 2**31, (recording.PIECE + 7, 3)).astype(np.int32)
    with Recorder(tmp_path / "r", NAMES, {"seed": 4}) as recorder:
        for frame in frames:
            recorder.add(frame)
    again = recording.read(tmp_path / "r")
    assert (again.names, again.about, len(again)) == (NAMES, {"seed": 4}, len(frames))
    assert (again.frames == frames).all()
    assert (again["b"] == frames[:, 1]).all()


def test_what_hardly_changes_is_small(tmp_path: Path) -> None:
    with Recorder(tmp_path / "r", NAMES, {}) as recorder:
        for step in range(20_000):
            recorder.add(np.array([step, 5, step // 1000], np.int32))
    assert (tmp_path / "r").stat().st_size < 3000


def test_a_torn_file_is_told_of(tmp_path: Path) -> None:
    with Recorder(tmp_path / "r", NAMES, {}) as recorder:
        recorder.add(np.zeros(3, np.int32))
    whole = (tmp_path / "r").read_bytes()
    (tmp_path / "r").write_bytes(whole[:-3])
    with pytest.raises(RecordingError, match="midst of a piece"):
        recording.read(tmp_path / "r")
    (tmp_path / "r").write_bytes(b"nothing\n")
    with pytest.raises(RecordingError, match="no recording"):
        recording.read(tmp_path / "r")


# --- properties -----------------------------------------------------------------------------------

STATES = {
    "supervisor": ["switched_off", "standing_by", "producing", "faulted"],
    "rotator": ["unpowered", "waiting_for_block", "releasing"],
    "feeder_belt": ["idle", "granting", "indexing"],
}
"""States of modules that tests put them into; all others of their charts follow."""
STEPS = 400
HOME: dict[str, Any] = {
    "supervisor.state": 1,
    "extractor.position": 1000,
    "rotator.position": 1000,
    "sorter.retracted": 1,
}


@cache
def states_of(module: str) -> list[str]:
    """Return the states of a module, those of `STATES` first."""
    first = STATES.get(module, ["somewhere"])
    (path,) = (p for p in (CELL / f"{module}.yaml", CELL / f"{module}.scxml") if p.exists())
    own = (state.id for state in fsmkit.read_chart(path).states[1:])
    return [*first, *(name for name in own if name not in first)]


def run(**columns: Any) -> dict[str, bool | None]:
    """What the properties say of a run in which everything is at home but this."""
    names = (*PLANT.outputs, *WORLD_OUTPUTS, *(f"{module}.state" for module in MODULES))
    frames = np.zeros((STEPS, len(names)), np.int32)
    states = {module: states_of(module) for module in MODULES}
    for name, values in (HOME | {k.replace("__", "."): v for k, v in columns.items()}).items():
        frames[:, names.index(name)] = values
    made = Recording(names, frames, {"states": states})
    return {judged.name: judged.holds for judged in monitor.judge(made, ())}


def test_a_cell_at_home_breaks_nothing() -> None:
    verdicts = run()
    # a run shows no deadlock; the others are of states and data that a run does not record
    assert {name for name, verdict in verdicts.items() if verdict is None} == {
        *("L1", "Q6", "P10_power", "B1", "P9_lost"),
    }
    verdicts = {name: verdict for name, verdict in verdicts.items() if verdict is not None}
    assert verdicts.pop("produces") is False
    assert all(verdicts.values())


MOVES = np.linspace(200, 800, STEPS).astype(np.int32)


@pytest.mark.parametrize(
    ("columns", "broken"),
    [
        ({"extractor__position": 2600}, {"P1"}),
        ({"feeder__position": 2800, "molder__position": 700}, {"P2"}),
        ({"feeder__position": 900, "feeder_belt__position": MOVES}, {"P3"}),
        ({"rotator__position": 3100, "extraction_belt__position": MOVES}, {"P4"}),
        ({"rotator__state": 2}, {"P5_grant"}),
        ({"sorter__retracted": 0, "extraction_belt__position": MOVES}, {"P7"}),
        ({"slot__f0": 1}, {"P9_count"}),
        ({"supervisor__state": np.minimum(np.arange(STEPS) + 1, 3)}, {"P9_faults"}),
        (
            {
                "camera__id": np.where(np.arange(STEPS) < 50, 4, 0),
                "camera__verdict": np.where(np.arange(STEPS) < 50, 2, 0),
                "slot__e2": np.where(np.arange(STEPS) < 200, 0, 4),
                "count__inserted": np.where(np.arange(STEPS) < 200, 0, 1),
            },
            {"Q1"},
        ),
    ],
)
def test_what_breaks_a_property_is_found(columns: dict[str, Any], broken: set[str]) -> None:
    found = {name for name, holds in run(**columns).items() if holds is False} - {"produces"}
    assert found == broken


def test_nothing_is_judged_before_the_cell_has_homed() -> None:
    states = np.where(np.arange(STEPS) < 300, 0, 1)
    arm = np.where(np.arange(STEPS) < 250, 2600, 1000)
    assert run(supervisor__state=states, extractor__position=arm)["P1"] is True
