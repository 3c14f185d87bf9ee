"""The estimator as a process over real topics, and what the cell holds of what it says."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest

import fsmkit
from machines.production_cell.simulation import camera, recording
from machines.production_cell.simulation.camera import (
    BAD,
    GOOD,
    CameraState,
    Estimate,
    Judgement,
)
from machines.production_cell.simulation.nodes import CellError
from machines.production_cell.simulation.options import Options, prepare
from machines.production_cell.simulation.orchestrator import Orchestrator, Outcome
from tests.needs import need

VISION = Path(__file__).parents[3] / "machines/production_cell/vision"
DOMAIN = 10 + os.getpid() % 200
OLDEST = 5


@pytest.mark.cc
def test_what_is_old_counts_for_nothing(tmp_path: Path) -> None:
    for path in VISION.glob("*.yaml"):  # numbers that begin again early leave few states
        text = path.read_text(encoding="utf-8").replace("1073741824", "8")
        text = text.replace("OLDEST: 5", "OLDEST: 2").replace(">= 5", ">= 2")
        (tmp_path / path.name).write_text(text, encoding="utf-8")
    report = fsmkit.check(tmp_path / "sighting.yaml")
    assert {each.name: each.verdict.value for each in report.results} == dict.fromkeys(
        ("deadlock", "livelock", "deaf_is_blind", "verdict_first", "nothing_old"), "holds"
    )


def looking(steps: int = 60) -> Iterator[tuple[CameraState, int]]:
    """A bad block and a good one, that pass the camera and go on to the sorter."""
    rule = Judgement(seed=1, bad=0.5, unreadable=0.0)
    bad, good = (
        next(b for b in range(1, 99) if rule.verdict(b, 1) == verdict) for verdict in (BAD, GOOD)
    )
    state = CameraState()
    for step in range(steps):
        encoder = 50 * step
        view = {True: (bad, encoder), step > 30: (good, encoder - 1550)}[True]
        if view[1] > 300:
            view = (0, 0)
        state = camera.picture(rule, state, 33 * step, view, encoder)
        yield state, encoder


@pytest.fixture
def _cyclonedds() -> None:
    need(find_spec("cyclonedds") is not None, "cyclonedds")


@pytest.mark.external
@pytest.mark.usefixtures("_cyclonedds")
def test_it_says_what_the_cell_would_and_nothing_while_it_is_dead(tmp_path: Path) -> None:
    from machines.production_cell.vision.estimating import RosEstimator

    def matches(found: Estimate, state: CameraState, encoder: int) -> bool:
        own = camera.at_sorter(state.sightings, encoder)
        return found.is_sighted == own.is_sighted and found.is_reject == own.is_reject

    estimator = RosEstimator(tmp_path / "log", 0.0, waits=True, domain=DOMAIN)
    try:
        seen = set()
        for state, encoder in looking():
            found = estimator(state, encoder)
            assert matches(found, state, encoder)
            assert estimator(state, encoder) == found  # between two pictures
            seen.add((found.is_sighted, found.is_reject))
        assert seen == {(False, False), (True, True), (True, False)}
        assert estimator.report() == {
            "pictures": 60, "unanswered": 0, "malformed": 0, "restarts": 0
        }  # fmt: skip
        last = replace(state, frames=100)
        assert estimator(last, encoder - 400).is_sighted
        estimator.kill()
        held = [
            estimator(replace(last, frames=101 + n), encoder - 400).is_sighted
            for n in range(OLDEST)
        ]
        assert held == [True] * (OLDEST - 1) + [False]
        estimator.begin()
        assert not estimator(replace(last, frames=200), encoder - 400).is_sighted
        for state, encoder in looking():
            later = replace(state, frames=state.frames + 300)
            assert matches(estimator(later, encoder), later, encoder)
        assert estimator.report()["restarts"] == 1
    finally:
        estimator.close()
    assert '"refused": 0' in (tmp_path / "log").read_text(encoding="utf-8")


@pytest.mark.external
@pytest.mark.usefixtures("_cyclonedds")
def test_what_makes_no_sense_is_left_out(tmp_path: Path) -> None:
    from machines.production_cell.vision.estimating import RosEstimator
    from machines.production_cell.vision.estimator import Following, Picture

    following = Following(0.0)
    assert following.answer(Picture(1, 0, 0, 1, 0, 3, 0, 9)) is None
    answer = following.answer(Picture(1, 1, 0, 2, 0, 3, 900, 2))
    assert answer is not None
    assert (answer.number, answer.block, answer.verdict) == (2, 3, 2)
    answer = following.answer(Picture(2, 0, 0, 1, 0, 0, 0, 0))  # another life of the cell
    assert answer is not None
    assert (answer.block, answer.verdict) == (0, 0)
    assert (following.answered, following.refused) == (2, 1)

    estimator = RosEstimator(tmp_path / "log", 0.0, waits=True, domain=DOMAIN)
    try:
        _publish_wrong_estimates(estimator)
    finally:
        estimator.close()


def _publish_wrong_estimates(estimator: object) -> None:
    """Another program says things out of range, of pictures never taken, in another shape."""
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.pub import DataWriter
    from cyclonedds.topic import Topic

    from machines.production_cell.vision.estimating import RosEstimator
    from machines.production_cell.vision.estimator import EVENTS, Estimated

    assert isinstance(estimator, RosEstimator)
    participant = DomainParticipant(DOMAIN)
    topic = Topic(participant, "rt/cell/estimator/estimated", Estimated, qos=EVENTS)
    writer = DataWriter(participant, topic, qos=EVENTS)
    while not writer.get_matched_subscriptions():
        pass
    state = CameraState(frames=1)
    for number, verdict in ((1, 9), (5000, GOOD), (1 << 31, GOOD)):
        writer.write(Estimated(0, 0, 0, number, 7, verdict))
    while estimator.report()["malformed"] < 2:
        state = replace(state, frames=state.frames + 1)
        assert estimator(state, 0) == Estimate()


def cell(folder: Path, steps: int, *faults: str, drift: float = 0.0) -> Outcome:
    schedule = folder / "faults.yaml"
    schedule.write_text("\n".join(f"- {{{fault}}}" for fault in faults), encoding="utf-8")
    options = Options(
        steps, folder, fault=str(schedule) if faults else "", double=True, sorter="position",
        estimator="ros", domain=DOMAIN, drift=drift, timeout=60.0,
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as sockets:
        setup, world = prepare(options, Path(sockets))
        return Orchestrator(setup, lambda states: replace(world, states=states)).run()


@pytest.mark.external
@pytest.mark.slow
@pytest.mark.usefixtures("_cyclonedds")
def test_a_block_that_no_estimator_has_seen_is_pushed_out(tmp_path: Path) -> None:
    outcome = cell(tmp_path, 24_000, "at: 5, fault: kill, board: estimator, for: 0")
    record = recording.read(tmp_path / "run.rec")
    assert not record["estimator.sighted"][6000:].any()
    states = outcome.states["sorter"]
    waited = record["sorter.state"] == states.index("waiting_for_verdict")
    assert 499 <= int(waited.sum()) <= 502 * int(record["count.ejected"][-1])
    assert record["count.ejected"][-1] >= 1


def test_it_is_refused_where_it_switches_nothing(tmp_path: Path) -> None:
    with pytest.raises(CellError, match="add --sorter position"):
        prepare(Options(10, tmp_path, double=True, estimator="ros"), tmp_path)
