"""``fsmkit run`` of a system: what `SystemSession` does, told line by line."""

from __future__ import annotations

import io
import json
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.diagnostics import Findings
from fsmkit.runtime.interpreter.trace import trace_lines
from fsmkit.runtime.system_session import SystemSession
from fsmkit.system.system_file import load_system

CELL = str(Path(__file__).parents[2] / "machines/production_cell/cell.yaml")
PAIR = """\
system: Pair
machines: {left: ball.yaml, right: ball.yaml}
connect:
  - left.hit -> right.ball
  - right.hit -> left.ball
environment: {may: [left.serve, right.serve]}
"""
BALL = """\
chart: Player
data: {hits: 0..5 fault = 0}
operations: [aim() -> 0..9]
events: {in: [ball, serve(speed 0..9)], out: [hit]}
initial: waiting
states:
  waiting:
    on:
      ball: hitting
      serve: {if: event.speed > 0, target: hitting}
  hitting:
    entry: log "aims", aim()
    after: {1s: {target: waiting, do: hits += 1; send hit}}
"""


@pytest.fixture
def pair(tmp_path: Path) -> str:
    path = tmp_path / "pair.yaml"
    path.write_text(PAIR, encoding="utf-8")
    (tmp_path / "ball.yaml").write_text(BALL, encoding="utf-8")
    return str(path)


def test_the_cell_runs_as_its_session_does(capsys: pytest.CaptureFixture[str]) -> None:
    events = "wait 8s; plant.press_start; wait 12s; feeder.pause; wait 1500ms; feeder.resume"
    assert execute(["run", CELL, "--events", events, "--trace"]) == 0
    system = load_system(Path(CELL), Findings())
    session = SystemSession(system)
    done = [*session.start(), *session.run(8000)]
    session.post("plant", "press_start")
    done += [*session.run(8000), *session.run(20_000)]
    session.post("feeder", "pause")
    done += [*session.run(20_000), *session.run(21_500)]
    session.post("feeder", "resume")
    done += session.run(21_500)
    charts = {machine.name: machine.chart for machine in system.machines}
    expected = [
        f"{happening.machine}: {line}"
        for happening in done
        for line in trace_lines(charts[happening.machine], (happening.macrostep,))
    ]
    told = capsys.readouterr().out.splitlines()
    assert told == expected
    assert "feeder: + pushing" in told


def test_machines_answer_each_other(pair: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["run", pair, "--events", "left.serve speed=3; wait 2500ms"]) == 0
    told = capsys.readouterr().out
    for line in (
        "left       0ms  serve speed=3",
        "right       1s  ball",
        "left        2s  ball",
    ):
        assert line in told


def test_scripts_and_json(pair: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    script = tmp_path / "script.txt"
    script.write_text("start\npost left.serve 3\nrun 2500\n", encoding="utf-8")
    assert execute(["run", pair, "--script", str(script), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["active"] == {"left": ["hitting"], "right": ["waiting"]}
    assert document["data"]["left"]["hits"] == document["data"]["right"]["hits"] == 1
    assert document["now"] == 2500
    assert [step["machine"] for step in document["steps"][:4]] == ["left", "right", "left", "left"]


def test_a_fault_of_one_machine_is_not_fine(pair: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["run", pair, "--events", "left.serve speed=3; wait 20s", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["faults"] == {"left": "range"}
    assert execute(["run", pair, "--events", "left.serve speed=3; wait 20s"]) == 1
    assert "left stopped with the fault range" in capsys.readouterr().out


def test_full_queues_are_told(
    pair: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    script = tmp_path / "script.txt"
    script.write_text("start\n" + "post right.serve 0\n" * 9, encoding="utf-8")
    assert execute(["run", pair, "--script", str(script)]) == 0
    assert capsys.readouterr().out.count("right: full queue") == 1


def test_seeds_choose_results(pair: str, capsys: pytest.CaptureFixture[str]) -> None:
    told = set()
    for seed in ("1", "2", "1"):
        execute(["run", pair, "--seed", seed, "--events", "left.serve speed=3; wait 9s"])
        told.add(capsys.readouterr().out)
    assert len(told) == 2


def test_conversation(
    pair: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    typed = "help\nstate\nevents\ndata\nleft.serve speed=1\nwait 1s\nstate\nquit\n"
    monkeypatch.setattr("sys.stdin", io.StringIO(typed))
    assert execute(["run", pair]) == 0
    told = capsys.readouterr().out
    assert "MACHINE.EVENT a=1" in told
    assert "  * left.serve(speed 0..9)" in told
    assert "  right.hits = 0" in told
    assert told.rstrip().endswith("right: hitting")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--events", "serve speed=1"), "`serve` names no event of a machine"),
        (("--events", "middle.serve"), "there is no machine `middle`"),
        (("--events", "left.hit"), "there is no event of `left` `hit`"),
        (("--events", "left.serve"), "`speed` of `serve`"),
        (("--events", "left.serve speed=10"), "`speed` of `serve`"),
        (("--events", "left.ball ball"), "does not take `ball`"),
        (("--events", "wait long"), "the time to wait"),
    ],
)
def test_wrong_events_are_diagnostics(
    arguments: tuple[str, ...], message: str, pair: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["run", pair, *arguments]) == 1
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("start\nstart\n", "a system is started once"),
        ("start 5\n", "the time of a system starts at 0"),
        ("start\nrun 9\nrun 8\n", "it is 9 already"),
        ("start\nrun soon\n", "`soon` is not a number"),
        ("start\ndispatch left.ball\n", "`dispatch` is not a script line of a system"),
        ("start\nrun 1 2\n", "there are words left"),
    ],
)
def test_wrong_scripts_are_diagnostics(
    lines: str, message: str, pair: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    script = tmp_path / "script.txt"
    script.write_text(lines, encoding="utf-8")
    assert execute(["run", pair, "--script", str(script)]) == 1
    assert message in capsys.readouterr().err


def test_only_the_interpreter_runs_systems(pair: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["run", pair, "--events", "left.ball", "--target", "c"]) == 2
    assert "a system is run by the interpreter alone" in capsys.readouterr().err
