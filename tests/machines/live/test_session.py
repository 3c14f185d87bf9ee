"""What is done at the panel is saved, and done again bit for bit."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import pytest

from machines.production_cell.live.session import digest, pytest_of, read
from machines.production_cell.simulation.camera import BAD, Judgement
from machines.production_cell.simulation.nodes import CellError
from machines.production_cell.simulation.options import Options
from tests.machines.live.driving import driven
from tests.needs import need

pytest.importorskip("zmq")


def performed(text: str, folder: Path) -> None:
    """Perform a saved test."""
    found: dict[str, Any] = {}
    exec(compile(text, "test_session.py", "exec"), found)
    found["test_it_does_so_again"](folder)


@pytest.mark.cc
def test_a_short_session_is_done_again(tmp_path: Path) -> None:
    options = Options(10**9, tmp_path / "live", double=True)
    with driven(options) as cell:
        cell.client.result("run", speed=0)
        cell.wait(lambda: cell.drive.steps > 600)
        assert cell.states("supervisor")[-1] == "homing_1"
        cell.client.result("pause")
        cell.client.result("post", m="panel", event="press_estop")
        cell.client.result("step", how="tick")
        cell.wait(lambda: "opened" in cell.states("panel"))
        steps = cell.drive.steps
        cell.hub.advance(20_000)
        assert cell.drive.steps == steps, "it stands still"
        cell.client.result("run", speed=0)
        cell.wait(lambda: cell.states("supervisor")[-1] == "fallen")
        cell.post("release_estop")
        cell.post("press", button="reset")
        cell.wait(lambda: cell.states("supervisor")[-1] == "homing_1")
        cell.client.result("pause")
        cell.wait(lambda: not cell.drive.is_running)
        saved = cell.client.result("save", **{"as": "script"})
        test = cell.client.result("save", **{"as": "pytest"})
        assert cell.client.say("save", **{"as": "c"})["k"] == "refused"
    assert cell.error is None
    session = read(saved)
    assert [str(deed).split(maxsplit=1)[1] for deed in session.deeds] == [
        "press_estop", "release_estop", "press reset",
    ]  # fmt: skip
    performed(test, tmp_path / "again")


@pytest.mark.cc
@pytest.mark.slow
def test_the_cell_is_driven_by_hand(tmp_path: Path) -> None:
    """Start, a block rejected, a jam, an emergency stop, a reset, and it produces again."""
    seed = next(n for n in range(1, 99) if Judgement(n, 0.3).verdict(1, 1) == BAD)
    options = Options(10**9, tmp_path / "live", seed=seed, bad=0.3)
    try:
        with driven(options) as cell:
            cell.client.result("run", speed=0)
            cell.wait(lambda: "standing_by" in cell.states("supervisor"))
            cell.post("press", button="start")
            cell.wait(lambda: cell.signal("count.ejected") >= 1)
            cell.post("fault", name="jam")
            cell.wait(lambda: "faulted" in cell.states("supervisor"))
            assert "error" in cell.states("feeder")
            mended = cell.signal("time") + 6  # a jam lasts 5 s
            cell.post("press_estop")
            cell.wait(lambda: "fallen" in cell.states("supervisor"))
            cell.wait(lambda: cell.signal("time") > mended)
            cell.post("release_estop")
            cell.post("press", button="reset")
            cell.wait(lambda: "standing_by" in cell.states("supervisor"))
            moulded = cell.signal("count.moulded")
            cell.post("press", button="start")
            cell.wait(lambda: cell.signal("count.moulded") > moulded)
            assert cell.signal("property.P2") == 1
            assert cell.signal("count.collisions") == 0
            assert cell.client.result("watch", expression="panel.chain_open")["value"] is False
    except CellError as error:
        need("cannot be built" not in str(error), "cc")
        raise
    assert cell.error is None
    live, again = (tmp_path / name / "run.rec" for name in ("live", "again"))
    session, found = cell.drive.session()
    assert digest(live) == found
    performed(pytest_of(session, found), tmp_path / "again")
    assert live.read_bytes() == again.read_bytes()


@pytest.mark.cc
@pytest.mark.slow
def test_a_board_dies_and_the_run_goes_on(tmp_path: Path) -> None:
    with driven(Options(10**9, tmp_path / "live")) as cell:
        cell.client.result("run", speed=0)
        cell.wait(lambda: cell.signal("time") > 1)
        board = next(b for b in cell.run._boards if b.program.name == "b")
        assert board._process is not None
        os.kill(board._process.pid, signal.SIGKILL)
        cell.wait(lambda: cell.drive.has_died)
        cell.wait(lambda: cell.states("rotator") == [])
        died = cell.drive.steps
        cell.wait(lambda: cell.drive.steps > died + 500)
        assert "was killed by signal 9" in cell.drive.notes[0]
        cell.post("restart", board="b")
        cell.wait(lambda: cell.states("rotator")[-1:] == ["unhomed"])
        cell.client.result("post", m="panel", event="restart", **{"with": {"board": "b"}})
        cell.wait(lambda: len(cell.drive.notes) == 2)
        assert "board b runs" in cell.drive.notes[1]
        cell.wait(lambda: cell.client.last("post")["how"] == "refused")
    assert cell.error is None


@pytest.mark.cc
def test_no_board_takes_events(tmp_path: Path) -> None:
    with driven(Options(10**9, tmp_path / "live", double=True)) as cell:
        answer = cell.client.say("post", m="feeder", event="stop")
        assert (answer["k"], answer["rule"]) == ("refused", "wrong-command")
        answer = cell.client.say("set", m="feeder", input="pocket_occupied", value=True)
        assert answer["k"] == "refused"
    assert cell.drive.steps == 0


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("[", "is no session"),
        ("a: 1", "is no session"),
        ("{options: {seed: 1}, steps: 0, done: []}", "`steps`"),
        ("{options: {sed: 1}, steps: 1, done: []}", "`sed`"),
        ("{options: {}, steps: 9, done: [press start]}", "number of a step"),
        ("{options: {}, steps: 9, done: [1 pres start]}", "pres"),
        ("{options: {}, steps: 9, done: [1 press strat]}", "strat"),
        ("{options: {}, steps: 9, done: [5 lay_block, 1 lay_block]}", "order of time"),
    ],
)
def test_a_file_that_is_no_session_is_refused(text: str, why: str) -> None:
    with pytest.raises(CellError, match=why):
        read(text)
