"""Processes stepped together: plant and the double of the boards, and processes that misbehave."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from machines.production_cell.simulation import monitor, nodes, recording
from machines.production_cell.simulation.camera import Judgement
from machines.production_cell.simulation.effects import effects
from machines.production_cell.simulation.faults import Action, Fault, Trigger
from machines.production_cell.simulation.nodes import CellError, Program
from machines.production_cell.simulation.orchestrator import (
    Orchestrator,
    Outcome,
    Setup,
    Steering,
)
from machines.production_cell.simulation.panel import Operator
from machines.production_cell.simulation.recording import Recording
from machines.production_cell.simulation.signals import COMMANDS
from machines.production_cell.simulation.tally import Tally, tally
from machines.production_cell.simulation.world import World

SERVER = """
import json, sys, time, zmq
socket = zmq.Context().socket(zmq.REP)
socket.bind(sys.argv[1])
writes = WRITES
while True:
    request = socket.recv()
    kind = request[:1]
    if kind == b"C":
        told = {"protocol": PROTOCOL, "name": "x", "peers": [], "inputs": [{"name": "READS"}],
                "outputs": [{"name": name} for name in writes]}
        socket.send(b"C" + json.dumps(told).encode())
    elif kind == b"I":
        socket.send(b"I" + bytes(4 * len(writes)))
    elif kind == b"K":
        socket.send(b"K" + json.dumps(CHECK).encode())
    elif kind == b"S":
        ANSWER
    else:
        socket.send(kind)
    if kind == b"Q":
        break
"""
WRITES = repr([*COMMANDS, "lamp", "supervisor.state"])
GOOD: dict[str, str] = {
    "WRITES": WRITES,
    "PROTOCOL": "1",
    "READS": "power",
    "CHECK": '{"ok": True}',
    "ANSWER": 'socket.send(b"S" + request[1:5] + bytes(4 + 4 * len(writes)))',
}


def board(folder: Path, **other: str) -> Program:
    """A board that keeps to the protocol but for this."""
    text = SERVER
    for word, meaning in (GOOD | other).items():
        text = text.replace(word, meaning)
    path = folder / "board.py"
    path.write_text(text)
    return Program("board", (sys.executable, str(path), "{endpoint}"))


def run(
    out: Path,
    *boards: Program,
    steps: int,
    schedule: tuple[Fault, ...] = (),
    timeout: float = 60.0,
    steering: Steering | None = None,
) -> Orchestrator:
    """Run on a machine that may be busy: ``timeout`` in s."""
    with tempfile.TemporaryDirectory() as sockets:
        setup = Setup(
            steps, boards, nodes.plant_program(1), out, Path(sockets), schedule, {}, timeout, 5
        )
        made = Orchestrator(setup, lambda states: World(Operator(), Judgement(), states), steering)
        made.run()
    return made


def children() -> set[str]:
    """The processes that this one began and that still run."""
    found = Path(f"/proc/self/task/{Path('/proc/self').resolve().name}/children")
    return set(found.read_text().split()) if found.exists() else set()


@pytest.fixture(autouse=True)
def nobody_is_left_behind() -> Iterator[None]:
    before = children()
    yield
    assert children() <= before


@pytest.mark.cc
def test_a_board_that_keeps_to_the_protocol(tmp_path: Path) -> None:
    outcome = run(tmp_path, board(tmp_path), steps=20).outcome
    assert outcome.steps == 20
    assert outcome.ping_rate > 0
    assert outcome.step_rate > 0
    made = recording.read(tmp_path / "run.rec")
    assert len(made) == 20


@pytest.mark.cc
@pytest.mark.parametrize(
    ("other", "told"),
    [
        ({"PROTOCOL": "7"}, "board speaks protocol 7, not 1"),
        ({"READS": "gravity"}, "board reads `gravity`, which nobody writes"),
        ({"WRITES": '["B_F0"]'}, "`B_F0` is written by board and plant"),
        ({"WRITES": '["lamp", "supervisor.state"]'}, "plant reads `feeder_belt.pwm`"),
        ({"CHECK": '{"ok": False, "why": "no oil"}'}, "board is not ready: no oil"),
        ({"ANSWER": 'sys.exit("out of smoke")'}, "board ended with exit code 1\n  out of smoke"),
        ({"ANSWER": "import os; os.kill(os.getpid(), 9)"}, "board was killed by signal 9"),
        ({"ANSWER": "time.sleep(3)"}, "board did not answer for 1 s"),
        ({"ANSWER": 'socket.send(b"Eoverheated")'}, "board rejects the request: overheated"),
        ({"ANSWER": 'socket.send(b"S")'}, "board answers a step with 0 bytes"),
        (
            {"ANSWER": 'socket.send(b"S" + bytes(8 + 4 * len(writes)))'},
            "board answers step 0, not 1",
        ),
    ],
)
def test_what_goes_wrong_is_told_of(tmp_path: Path, other: dict[str, str], told: str) -> None:
    with pytest.raises(CellError) as error:
        run(tmp_path, board(tmp_path, **other), steps=20, timeout=1.0)
    assert told in str(error.value)


@pytest.mark.cc
def test_a_program_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(CellError, match="board cannot be started"):
        run(tmp_path, Program("board", ("/no/such/board",)), steps=1)


@pytest.mark.cc
def test_a_board_is_killed_and_begun_again(tmp_path: Path) -> None:
    ones = 'socket.send(b"S" + request[1:5] + bytes(4) + b"\\x01\\x00\\x00\\x00" * len(writes))'
    actions = (Action(0, "kill", "board"), Action(5, "restart", "board"))
    schedule = (Fault("kill", Trigger(5), actions),)
    made = run(tmp_path, board(tmp_path, ANSWER=ones), steps=15, schedule=schedule)
    record = recording.read(tmp_path / "run.rec")
    assert record["feeder.enable"].tolist() == [1] * 4 + [0] * 5 + [1] * 6
    assert record["rotator.magnet"].tolist() == [1] * 15
    assert len(made.outcome.lives["board"]) == 1


@pytest.mark.cc
@pytest.mark.parametrize("resets", [False, True])
def test_a_magnet_holds_though_its_board_begins_anew(tmp_path: Path, *, resets: bool) -> None:
    """In its first life the board has all outputs on, then all off: the magnets alone stay."""
    value = '(b"\\x01" if int.from_bytes(request[1:5], "little") <= 4 else b"\\x00") + bytes(3)'
    answer = f'socket.send(b"S" + request[1:5] + bytes(4) + ({value}) * len(writes))'
    actions = (Action(0, "kill", "board"), Action(3, "restart", "board"))
    schedule = (Fault("kill", Trigger(5), actions),)

    class Resetting(Unhurried):
        def before(self, number: int) -> None:
            if resets and number == 12:
                self.run.operate(lambda state: replace(state, asked="reset"))

    run(tmp_path, board(tmp_path, ANSWER=answer), steps=15, schedule=schedule, steering=Resetting())
    record = recording.read(tmp_path / "run.rec")
    assert record["feeder.enable"].tolist() == [1] * 4 + [0] * 11
    for place, magnet in enumerate(("extractor.magnet", "rotator.magnet")):
        # the reset of step 12 is seen in step 13: the block is off, and the magnet lets go
        held = 11 if resets else 15
        assert record[magnet].tolist() == [1] * held + [0] * (15 - held), place
    clear = record["operator.clear"].tolist()
    assert [(step, what) for step, what in enumerate(clear, 1) if what] == (
        [(12, 1 + 2 + 4)] if resets else []
    )


class Unhurried:
    """Who drives by hand and does nothing."""

    def begin(self, run: Orchestrator) -> None:
        self.run = run

    def before(self, number: int) -> None:
        """Wait for nothing."""

    def after(self, number: int) -> None:
        """Look at nothing."""

    def died(self, number: int, board: str, why: str) -> bool:
        raise AssertionError(number, board, why)


@pytest.mark.cc
def test_a_run_that_is_stopped_reports(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    step = Orchestrator._step_plant

    def stop(self: Orchestrator, number: int) -> None:
        step(self, number)
        if number == 3:
            self.stop()

    monkeypatch.setattr(Orchestrator, "_step_plant", stop)
    outcome = run(tmp_path, board(tmp_path), steps=20).outcome
    assert outcome.steps == 3
    assert outcome.reports["plant"] == {"events": []}


@pytest.mark.cc
def test_ctrl_c_ends_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(self: Orchestrator, number: int) -> None:
        del self
        if number == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(Orchestrator, "_step_plant", interrupt)
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, board(tmp_path), steps=20)
    assert len(recording.read(tmp_path / "run.rec")) == 2


# --- the real charts ------------------------------------------------------------------------------

STEPS = 17_000
"""Homing takes the half; then the first block is moulded."""
Ran = tuple[Recording, Outcome, Tally]


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Ran:
    out = tmp_path_factory.mktemp("cell")
    actions = (Action(0, "plant", "take.f0", 1),)
    schedule = (
        Fault("lost_block f0", Trigger(16_000, slot="f0"), actions),
        Fault("estop", Trigger(0, "feeder", "at_home", 9), (Action(0, "estop", "", 1),)),
    )
    outcome = run(out, nodes.double_program(), steps=STEPS, schedule=schedule).outcome
    record = recording.read(out / "run.rec")
    return record, outcome, tally(record, outcome)


@pytest.mark.slow
@pytest.mark.cc
def test_the_cell_homes_and_produces(ran: Ran) -> None:
    record, outcome, figures = ran
    assert outcome.steps == len(record) == STEPS
    assert figures.ends_in == "producing"
    assert figures.inserted == 2
    assert figures.moulded >= 1
    assert (figures.collisions, figures.doubled, figures.refused) == (0, 0, 0)


@pytest.mark.slow
@pytest.mark.cc
def test_a_block_that_is_taken_away_is_accounted_for(ran: Ran) -> None:
    _, _, figures = ran
    assert figures.lost == 1
    assert figures.is_accounted_for
    assert "fault: plant take.f0 1" in [what for _, what in figures.timeline]


@pytest.mark.slow
@pytest.mark.cc
def test_faults_begin_when_their_state_is_entered_or_not_at_all(ran: Ran, tmp_path: Path) -> None:
    record, outcome, _ = ran
    assert [fault for _, fault in outcome.begun] == ["lost_block f0"]
    assert outcome.not_begun == ["estop"]
    first = record.about["states"]["feeder"].index("seeking")  # the first below `homing`
    entered = np.flatnonzero(record["feeder.state"] == first)
    at = int(entered[0]) + 1  # the boards' step comes before that of the faults' clock
    actions = (Action(0, "estop", "", 1),)
    schedule = (Fault("estop", Trigger(0, "feeder", "homing", 1, 20), actions),)
    made = run(tmp_path, nodes.double_program(), steps=at + 200, schedule=schedule).outcome
    assert made.begun == [(at + 1 + 20, "estop")]
    (effect,) = effects(recording.read(tmp_path / "run.rec"), made)
    assert effect.met["feeder"] in {"homing", "seeking", "backing_off", "settling"}
    assert effect.state in {"emergency", "latched", "fallen"}
    assert effect.after is not None
    assert 0 <= effect.after < 0.1


@pytest.mark.slow
@pytest.mark.cc
def test_a_state_that_no_machine_has_is_refused(tmp_path: Path) -> None:
    schedule = (Fault("estop", Trigger(0, "feeder", "pushhing"), ()),)
    with pytest.raises(CellError, match=r"feeder has no state `pushhing`; it has .*pushing"):
        run(tmp_path, nodes.double_program(), steps=10, schedule=schedule)


@pytest.mark.slow
@pytest.mark.cc
def test_the_properties_hold_of_it(ran: Ran) -> None:
    record, outcome, _ = ran
    judged = monitor.judge(record, outcome.reports["plant"]["events"])
    assert len(judged) == 25
    assert [j.name for j in judged if j.holds is False] == ["produces"]
    assert {j.name: j.reason for j in judged if j.holds is None} == {
        "P10_power": "`pusher.In(forth)` is not recorded",
        "L1": "a run cannot show it",
        "Q6": "`feeder_belt.in_ring` is not recorded",
    }


@pytest.mark.parametrize(("waits", "holds"), [(0, True), (499, True), (500, False), (501, False)])
def test_a_verdict_that_came_too_late_is_seen_in_the_states(
    tmp_path: Path, waits: int, holds: bool
) -> None:
    rows = [0] * 10 + [1] * waits + [2] * 10
    about = {"states": {"sorter": ["pulled_back", "waiting_for_verdict", "pushing_out"]}}
    found = judged_on(tmp_path, "sorter", "Q", "{never: sorter.late}", rows, about)
    assert found.holds is holds


@pytest.mark.parametrize(
    ("rows", "holds"),
    [
        ([0, 1, 1, 2, 0], True),
        ([0, 1, 3, 1, 2], True),  # a pause does not end it
        ([0, 1, 3], None),
        ([0, 2, 0, 1], None),
        ([0, 0], True),
    ],
)
def test_a_request_is_open_until_the_rotator_goes_on(
    tmp_path: Path, rows: list[int], holds: bool | None
) -> None:
    about = {"states": {"rotator": ["waiting_for_block", "waiting_for_place", "placing", "paused"]}}
    text = "{leads_to: [feeder_belt.requested, not feeder_belt.requested]}"
    found = judged_on(tmp_path, "rotator", "L", text, rows, about)
    assert found.holds is holds
    assert bool(found.reason) is (holds is None)


def judged_on(
    folder: Path, signal: str, name: str, text: str, rows: list[int], about: dict[str, Any]
) -> monitor.Judged:
    """Return what the states of a machine, one a step, show of a property."""
    path = folder / "system.yaml"
    machines = "".join(
        f"  {machine}: {monitor.CELL}/{machine}.yaml\n" for machine in ("sorter", "feeder_belt")
    )
    path.write_text(f"system: S\nmachines:\n{machines}properties:\n  {name}: {text}\n")
    frames = np.array(rows, np.int32).reshape(-1, 1)
    record = Recording([f"{signal}.state"], frames, about)
    (found,) = monitor.judge(record, [], path, homed=0)
    return found


@pytest.mark.slow
@pytest.mark.cc
def test_the_same_seed_gives_the_same_run(ran: Ran, tmp_path: Path) -> None:
    record, _, _ = ran
    run(tmp_path, nodes.double_program(), steps=1000)
    again = recording.read(tmp_path / "run.rec")
    assert again.names == record.names
    assert (again.frames == record.frames[:1000]).all()
