"""The programs of the boards: they come up, keep to the protocol, stop, say why, and replay."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import fsmkit
from fsmkit.carriers.wires.registers import Registers, places_of
from fsmkit.cli.tools.paths import PATHS
from fsmkit.runtime.recording import replay
from tests.machines.boards.playing import CELL, Board, Cell, Plant

pytestmark = pytest.mark.cc
"""All run the programs, or read what they left."""

MACHINES = {
    "a": ("supervisor", "feeder_belt", "feeder", "molder", "extractor"),
    "b": ("extraction_belt", "sorter", "camera", "rotator"),
}


def begun(programs: dict[str, Path], folder: Path) -> Cell:
    """Return both boards, connected, before their first step."""
    folder.mkdir()
    links = f"ipc://{folder}/link_a,ipc://{folder}/link_b"
    cell = Cell(
        {name: Board(program, name, folder, "--links", links) for name, program in programs.items()}
    )
    for board in cell.boards.values():
        assert board.check() == {"ok": True}
    return cell


@pytest.fixture(scope="module")
def history(programs: dict[str, Path], sockets: Path) -> Iterator[dict[str, Any]]:
    """Bring the cell up, open the chain, recover, cut the link; return what was seen on the way."""
    cell = begun(programs, sockets / "history")
    seen: dict[str, Any] = {}
    try:
        cell.until("supervisor", "standing_by")
        seen["ready"] = cell.states()
        seen["positions"] = {name: axis.position for name, axis in cell.plant.axes.items()}
        cell.press("start")
        cell.steps(300)
        seen["producing"] = cell.state("supervisor"), cell.outputs["lamp"], cell.states()
        cell.press("stop")
        cell.until("supervisor", "draining")
        cell.until("supervisor", "standing_by")
        cell.plant.values["estop"] = 1
        cell.step()
        seen["stopped"] = dict(cell.outputs)
        cell.plant.values["estop"] = 0
        moved = 0
        for _ in range(2500):
            cell.step()
            moved += sum(cell.outputs[f"{name}.enable"] for name in cell.plant.axes)
        seen["enabled before reset"] = moved
        cell.press("reset")
        cell.until("supervisor", "standing_by")
        seen["recovered"] = cell.states()
        cell.boards["b"].request(b"P", b'{"name": "link.dead", "value": 1}')
        cell.steps(130)
        seen["cut off"] = {name: cell.state(name) for name in MACHINES["b"]}
        seen["reports"] = {name: board.report() for name, board in cell.boards.items()}
        seen["said"] = [board.end() for board in cell.boards.values()]
        seen["logs"] = {name: board.log.read_bytes() for name, board in cell.boards.items()}
        yield seen
    finally:
        cell.kill()


@pytest.mark.slow
def test_cell_comes_up_and_produces(history: dict[str, Any]) -> None:
    """Power, homing in the supervisor's order, inventory; all are ready where they should be."""
    assert history["ready"] == {"ready"}
    wanted = {"feeder": 0, "molder": 0, "extractor": 1000, "rotator": 1000}
    for name, place in wanted.items():
        assert abs(history["positions"][name] - place) < 5
    for name in ("feeder_belt", "extraction_belt"):
        assert abs(history["positions"][name]) < 5
    supervisor, lamp, states = history["producing"]
    assert supervisor == "producing"
    assert lamp == 1
    assert {"idle", "at_home", "pulled_back", "waiting_for_block"} <= states


def test_open_chain_takes_power_from_all_motors_in_the_same_step(history: dict[str, Any]) -> None:
    """On both boards, and until it is closed and reset was pressed; then all home again."""
    stopped = history["stopped"]
    for name, value in stopped.items():
        if name.endswith((".pwm", ".enable")) or name in ("lamp", "sorter.out"):
            assert value == 0, name
    assert history["enabled before reset"] == 0
    assert history["recovered"] == {"ready"}


def test_cut_link_stops_the_board_that_hears_nothing(history: dict[str, Any]) -> None:
    """Within 100 ms, and it says why."""
    assert set(history["cut off"].values()) == {"error"}
    report = history["reports"]["b"]
    assert report["notes"][-1]["text"] == "link: board a silent for 100 ms"
    assert report["faults"]["rotator"] == "link"
    assert report["refused"] == 0


@pytest.mark.parametrize(
    ("board", "machine"), [(b, machine) for b, found in MACHINES.items() for machine in found]
)
def test_log_is_performed_again_by_the_interpreter(
    history: dict[str, Any], board: str, machine: str
) -> None:
    """Each machine of a run on boards, and it ends in the same state."""
    suffix = "scxml" if machine == "camera" else "yaml"
    chart = fsmkit.read_chart(CELL / f"{machine}.{suffix}")
    log = history["logs"][board]
    lines = list(replay(chart, log))
    assert sum(line.startswith("t ") for line in lines) >= 8
    entered = [line[2:] for line in lines if line.startswith("= ")]
    assert history["reports"][board]["states"][machine] in entered[-1].split()


def test_same_inputs_give_the_same_outputs(programs: dict[str, Path], sockets: Path) -> None:
    """Two boards in two processes, step by step to the last bit, however fast they are."""
    traces = []
    for number in range(2):
        cell = begun(programs, sockets / f"again{number}")
        try:
            cell.steps(2000)
            traces.append(cell.trace)
            assert cell.boards["a"].report()["sent"] > 200
        finally:
            cell.kill()
    assert traces[0] == traces[1]


def test_registers_stand_for_requests(programs: dict[str, Path], sockets: Path) -> None:
    """The wires in a window: requests bring zeros, and what the plant does is the same."""
    folder = sockets / "window"
    folder.mkdir()
    described = json.loads((programs["a"].parent / "generated/a/board_a_io.json").read_text())
    plants = Plant(), Plant()
    with Registers(folder / "window_a", places_of(described), create=True) as registers:
        boards = (
            Board(programs["a"], "plain", folder, "--alone"),
            Board(programs["a"], "mapped", folder, "--alone", "--map", str(folder / "window_a")),
        )
        try:
            for number in range(1, 3000):
                told = boards[0].step(number, [0], plants[0])
                plants[0].step(told)
                for name in boards[1].inputs:
                    registers.set(name, plants[1].read(name, number))
                boards[1].step(number, [0], Plant(values={}, axes={}))
                found = {n: registers.get(n) for n in boards[1].outputs if n in registers.places}
                plants[1].step(found)
                assert found == {name: told[name] for name in found}, number
            assert any(axis.velocity for axis in plants[1].axes.values())
        finally:
            for board in boards:
                board.kill()


@pytest.mark.parametrize("words", [("--map", "missing"), ("--map", "short"), ("--from", "x")])
def test_windows_that_do_not_do_are_refused(
    programs: dict[str, Path], tmp_path: Path, words: tuple[str, str]
) -> None:
    (tmp_path / "short").write_bytes(bytes(8))
    command = [str(programs["a"]), "--cosim", f"ipc://{tmp_path}/s", "--alone", *words]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith((words[1], "usage: "))


def test_board_that_begins_anew_is_heard_again(programs: dict[str, Path], sockets: Path) -> None:
    """The other fails at once, and says why; the new one knows of the power after a second."""
    folder = sockets / "anew"
    cell = begun(programs, folder)
    try:
        cell.steps(1000)
        cell.boards["b"].kill()
        links = f"ipc://{folder}/link_a,ipc://{folder}/link_b"
        cell.boards["b"] = Board(programs["b"], "b", folder, "--links", links)
        assert cell.boards["b"].check() == {"ok": True}
        cell.steps(1100)
        assert cell.state("supervisor") == "faulted"
        texts = [note["text"] for note in cell.boards["a"].report()["notes"]]
        assert texts == ["link: board b was restarted"]
        assert cell.state("rotator") == "unhomed"
        assert cell.boards["b"].report()["links"]["a"]["lost_events"] == 0
    finally:
        cell.kill()


@pytest.mark.external
def test_clang_has_nothing_to_say(
    programs: dict[str, Path], require_tool: Callable[[str], str]
) -> None:
    """All of the boards' own sources, with the strictest warnings."""
    folders = [CELL / "boards", CELL / "controller"]
    folders += [PATHS[name] for name in ("hosts", "links", "wires", "zeromq")]
    for name, program in programs.items():
        generated = program.parent / "generated" / name
        sources = sorted(CELL.glob("boards/*.c"))
        own = [path for path in sources if not path.stem.startswith("board_")]
        subprocess.run(
            [
                require_tool("clang"),
                *("-std=c99", "-fsyntax-only", "-Wall", "-Wextra", "-Wpedantic"),
                *("-Wconversion", "-Wshadow", "-Werror"),
                *(f"-I{folder}" for folder in (*folders, generated)),
                *map(str, own),
                str(CELL / "boards" / f"board_{name}.c"),
                *map(str, sorted(PATHS["wires"].glob("fsm_io_*.c"))),
                *(str(generated / file) for file in (f"board_{name}_io.c", "fsm_io.c")),
            ],
            check=True,
        )


@pytest.fixture
def lone(programs: dict[str, Path], sockets: Path) -> Iterator[Board]:
    """Return board A without links."""
    folder = sockets / "lone"
    folder.mkdir()
    board = Board(programs["a"], "a", folder, "--alone")
    yield board
    board.kill()
    for path in folder.iterdir():
        path.unlink()
    folder.rmdir()


@pytest.mark.parametrize(
    ("request_", "why"),
    [
        (b"", "empty"),
        (b"x", "no such request"),
        (b"C{}", "protocol 1"),
        (b'C{"protocol": 2}', "protocol 1"),
        (b"I123", "number of inputs"),
        (b"S123", "length"),
        (b"S" + bytes(5000), "too long"),
        (b"P{}", "needs a name"),
        (b'P{"name": "feeder.kp"}', "needs a name"),
        (b'P{"name": "feeder.kp", "value": -1}', "no such parameter"),
        (b'P{"name": "feeder.nothing", "value": 1}', "no such parameter"),
        (b'P{"name": "link.loss", "value": 2}', "no such parameter"),
        (b"P" + b'"' * 5000, "too long"),
    ],
)
def test_what_makes_no_sense_is_refused(lone: Board, request_: bytes, why: str) -> None:
    """By a sentence, and the board goes on."""
    reply = lone.tell(request_)
    assert reply[:1] == b"E"
    assert why in reply.decode()
    assert lone.check() == {"ok": True}


def test_a_broken_step_turns_everything_off(lone: Board) -> None:
    """Outputs are safe from then on, until a step makes sense again."""
    plant = Plant()
    for number in range(1, 700):
        outputs = lone.step(number, [0], plant)
    assert outputs["extractor.enable"] == 1
    assert lone.tell(b"S123")[:1] == b"E"
    report = lone.report()
    assert report["is_off"] is True
    assert report["notes"][-1]["text"].startswith("protocol")
    assert lone.step(700, [0], plant)["extractor.enable"] == 0


def test_parameters_are_set_while_it_runs(lone: Board) -> None:
    """A top speed of 100 counts a second is kept from then on."""
    for name, value in (("top_speed", 100), ("kf", 0)):  # its axis has no friction to feed forward
        asked = json.dumps({"name": f"extractor.{name}", "value": value})
        assert json.loads(lone.request(b"P", asked.encode())) == {"ok": True}
    plant = Plant()
    fastest = 0.0
    for number in range(1, 1500):
        outputs = lone.step(number, [0], plant)
        plant.step(outputs)
        fastest = max(fastest, abs(plant.axes["extractor"].velocity))
    assert outputs["extractor.enable"] == 1
    assert 90 < fastest < 125


def test_real_time_loop_holds_inputs_and_is_safe_without(
    programs: dict[str, Path], sockets: Path
) -> None:
    """1 kHz with absolute deadlines; inputs hold for 100 ms, then all is off; jitter is counted."""
    zmq = pytest.importorskip("zmq")
    endpoint = f"ipc://{sockets}/real"
    process = subprocess.Popen(
        [str(programs["a"]), "--realtime", endpoint, "--alone", "--seconds", "20"],
        stdout=subprocess.PIPE,
        text=True,
    )
    context = zmq.Context()
    socket = context.socket(zmq.REQ)
    socket.linger, socket.rcvtimeo = 0, 10_000
    socket.connect(endpoint)

    def request(request: bytes) -> bytes:
        socket.send(request)
        reply = socket.recv()
        assert reply[:1] == request[:1]
        return bytes(reply[1:])

    about = json.loads(request(b'C{"protocol": 1}'))
    inputs = [signal["name"] for signal in about["inputs"]]
    values = [int(name == "power") for name in inputs]
    begun_at = time.monotonic()
    while time.monotonic() - begun_at < 2.0:
        request(b"S" + struct.pack(f"<II{len(values)}i", 1, 0, *values))
        time.sleep(0.005)
    report = json.loads(request(b"R"))
    assert report["is_off"] is False
    assert report["faults"]["extractor"] in ("none", "stall")  # the encoders stand still
    assert report["states"]["feeder"] == "unhomed"
    time.sleep(0.4)
    report = json.loads(request(b"R"))
    assert report["is_off"] is True
    assert "no inputs for 100 ms" in [note["text"] for note in report["notes"]]
    assert report["cycles"] + report["missed"] > 2000
    assert set(report["reasons"]) == {"woken late", "step long", "preempted", "page fault"}
    assert sum(report["reasons"].values()) == report["overruns"]
    assert len(report["last_overruns"]) == min(16, report["overruns"])
    awake = sum(count for *_, count in report["jitter_ns"])  # that of the reporting cycle too
    assert awake == report["cycles"] + 1
    request(b"Q")
    printed, _ = process.communicate(timeout=20)
    socket.close()
    context.term()
    assert process.returncode == 0
    assert "overruns" in printed
    assert "late by" in printed


@pytest.mark.parametrize(
    "words",
    [[], ["--cosim"], ["--wrong", "x"], ["--cosim", "nonsense"], ["--cosim", "ipc:///x/y/z"]],
)
def test_command_lines_that_do_not_do(programs: dict[str, Path], words: list[str]) -> None:
    """They end with status 2 and a line on stderr."""
    done = subprocess.run(
        [str(programs["a"]), *words, "--alone"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stderr


ABANDONS = """
import subprocess, sys, zmq
begun = subprocess.Popen([sys.argv[1], "--cosim", sys.argv[2], "--alone"])
client = zmq.Context().socket(zmq.REQ)
client.connect(sys.argv[2])
client.send(b"K")
assert client.recv()[:1] == b"K"
client.close(linger=0)
"""


def test_a_board_does_not_outlive_who_began_it(programs: dict[str, Path], sockets: Path) -> None:
    command = [sys.executable, "-c", ABANDONS, str(programs["a"]), f"ipc://{sockets}/abandoned"]
    # the board has the pipe, too: this returns when it has ended
    done = subprocess.run(command, capture_output=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
