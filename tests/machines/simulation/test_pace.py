"""Hardware in the loop: the clock, boards that are late, and boards in loops of their own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from machines.production_cell.simulation import nodes, recording
from machines.production_cell.simulation.__main__ import main
from machines.production_cell.simulation.camera import Judgement
from machines.production_cell.simulation.nodes import CellError, Program
from machines.production_cell.simulation.orchestrator import Orchestrator, Outcome, Setup
from machines.production_cell.simulation.pace import Pace, WallClock
from machines.production_cell.simulation.panel import Operator
from machines.production_cell.simulation.signals import COMMANDS
from machines.production_cell.simulation.world import World

SLOW = """
import json, struct, sys, time, zmq
socket = zmq.Context().socket(zmq.REP)
socket.bind(sys.argv[1])
writes = WRITES
while True:
    request = socket.recv()
    kind, body = request[:1], b"{}"
    if kind == b"C":
        outputs = [{"name": name} for name in writes]
        body = json.dumps({"protocol": 1, "name": "x", "peers": [], "inputs": [{"name": "power"}],
                           "outputs": outputs}).encode()
    elif kind == b"I":
        body = bytes(4 * len(writes))
    elif kind == b"K":
        body = b'{"ok": true}'
    elif kind == b"S":
        number = int.from_bytes(request[1:5], "little")
        if number == 201:
            HAPPENS
        body = struct.pack(f"<II{len(writes)}i", number, 0, *[number] * len(writes))
    socket.send(kind + body)
    if kind == b"Q":
        break
"""


class Watch:
    """A clock that is set by hand; ``stalls``: how much longer the n-th sleep takes."""

    def __init__(self, stalls: dict[int, float]) -> None:
        self.time = 5.0
        self.sleeps = 0
        self.stalls = stalls

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.sleeps += 1
        self.time += seconds + self.stalls.get(self.sleeps, 0.0)


def test_deadlines_are_absolute_and_those_that_passed_are_missed() -> None:
    watch = Watch({2: 0.015, 4: 0.3125})
    clock = WallClock(0.0625, watch.now, watch.sleep)
    begun = []
    for _ in range(8):
        clock.wait()
        begun.append(watch.time)
        watch.time += 0.005
    assert begun == pytest.approx([5.0, 5.0625, 5.14, 5.1875, 5.5625, 5.625, 5.6875, 5.75])
    assert (clock.cycles, clock.late, clock.missed) == (8, 1, 5)
    assert clock.worst == pytest.approx(0.3125)


def test_a_board_has_its_time_to_answer_in_a_cycle_that_began_late() -> None:
    watch = Watch({1: 0.05})
    clock = WallClock(0.0625, watch.now, watch.sleep)
    clock.wait()
    clock.wait()
    assert clock.time_to_answer() == pytest.approx(0.6 * 0.0625)
    watch.time += 1
    assert clock.time_to_answer() == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--hz", "300"], "--hz 300 is no divisor of 1000"),
        (["--hz", "-1"], "--hz -1 is no divisor of 1000"),
        (["--hz", "200", "--double"], "--double has no loop of its own"),
        (["--priority", "80"], "--priority needs --hz"),
    ],
)
def test_options_that_contradict_each_other(words: list[str], said: str, tmp_path: Path) -> None:
    done = CliRunner().invoke(main, [*words, "--out", str(tmp_path)])
    assert done.exit_code == 2
    assert said in " ".join(done.output.split())


def run(folder: Path, steps: int, happens: str) -> Outcome:
    """Run a board at 50 Hz to which something happens in step 201."""
    path = folder / "board.py"
    text = SLOW.replace("WRITES", repr([*COMMANDS, "lamp", "supervisor.state"]))
    path.write_text(text.replace("HAPPENS", happens))
    program = Program("board", (sys.executable, str(path), "{endpoint}"))
    with tempfile.TemporaryDirectory() as sockets:
        setup = Setup(
            steps, (program,), nodes.plant_program(1), folder, Path(sockets), pings=5,
            pace=Pace(50),
        )  # fmt: skip
        return Orchestrator(setup, lambda states: World(Operator(), Judgement(), states)).run()


@pytest.mark.cc
def test_a_board_that_is_late_keeps_its_outputs_and_is_not_waited_for(tmp_path: Path) -> None:
    outcome = run(tmp_path, 2000, "time.sleep(0.4)")
    assert outcome.seconds > 1.9
    assert outcome.steps == 2000
    exchange = outcome.pace["exchange"]["board"]
    assert outcome.pace["cycles"] == 100
    # 0.4 s are 20 cycles; fewer on a machine that is so busy that cycles are missed
    assert exchange["unanswered"] + outcome.pace["missed"] >= 10
    assert exchange["answers"] + exchange["unanswered"] == 100
    assert exchange["max_ms"] >= 400
    lamp = recording.read(tmp_path / "run.rec")["lamp"]
    assert lamp[200] < 201  # the answer to step 201 was still to come
    assert lamp[-1] > 1500


@pytest.mark.cc
def test_a_board_that_ends_in_a_run_of_the_clock(tmp_path: Path) -> None:
    with pytest.raises(CellError, match="board ended with exit code 1\n  out of smoke"):
        run(tmp_path, 2000, 'sys.exit("out of smoke")')


@pytest.mark.cc
@pytest.mark.slow
def test_boards_go_off_while_the_orchestrator_stands_still_and_come_back(tmp_path: Path) -> None:
    root = Path(__file__).resolve().parents[3]
    command = [sys.executable, "-m", "machines.production_cell.simulation", "--hz", "200"]
    process = subprocess.Popen(
        [*command, "--seconds", "12", "--out", str(tmp_path)],
        cwd=root,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        record = tmp_path / "run.rec"
        patience = time.monotonic() + 120
        while not (
            record.exists() and record.stat().st_size > 10_000
        ):  # the first pieces are there
            assert process.poll() is None
            assert time.monotonic() < patience
            time.sleep(0.1)
        os.kill(process.pid, signal.SIGSTOP)
        time.sleep(0.3)
        os.kill(process.pid, signal.SIGCONT)
        printed, _ = process.communicate(timeout=120)
    finally:
        process.kill()
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["pace"]["worst_ms"] > 250, printed
    for name in ("a", "b"):
        report = result["reports"][name]
        assert "no inputs for 100 ms" in [note["text"] for note in report["notes"]][-3:]
        assert sum(report["reasons"].values()) == report["overruns"]
        assert not report["is_off"]
    assert result["figures"]["collisions"] == 0
