from __future__ import annotations

import io
import json
from pathlib import Path

import pytest

from fsmkit.cli import execute

CHART = """\
chart: Door
types:
  Why: [wind, hand]
data:
  n: 0..9 = 0
inputs:
  locked: bool
operations:
  - sense() -> 0..9
events:
  in: [open(why Why), shut]
initial: closed
states:
  closed:
    on:
      open: {if: not locked, target: opened, do: n = sense()}
  opened:
    after: {2s: closed}
    on: {shut: closed}
"""


@pytest.fixture
def door(tmp_path: Path) -> str:
    path = tmp_path / "door.yaml"
    path.write_text(CHART, encoding="utf-8")
    return str(path)


def test_events_print_what_happened(door: str, capsys: pytest.CaptureFixture[str]) -> None:
    events = "open why=hand; wait 500ms; shut; set locked true; open hand"
    assert execute(["run", door, "--events", events]) == 0
    out = capsys.readouterr().out
    assert "open why=hand" in out
    assert "closed -> opened on open" in out
    assert "door.yaml:16" in out
    assert "sense() = " in out
    assert "500ms  shut" in out
    assert "nothing reacts to open" in out


def test_traces_are_those_of_the_scripts(
    door: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    script = tmp_path / "script.txt"
    script.write_text("start 0\npost open 1\nrun 0\nrun 2000\nrun 2500\n")
    assert execute(["run", door, "--script", str(script)]) == 0
    by_script = capsys.readouterr().out
    assert execute(["run", door, "--events", "open hand; wait 2s; wait 500ms", "--trace"]) == 0
    assert capsys.readouterr().out == by_script
    assert "@2000 > timeout" in by_script


def test_json_is_one_document(door: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["run", door, "--events", "open wind", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["active"] == ["opened"]
    assert document["steps"][1]["microsteps"][0]["entered"] == ["opened"]
    assert document["fault"] is None


def test_seeds_choose_results(door: str, capsys: pytest.CaptureFixture[str]) -> None:
    outputs = set()
    for seed in range(8):
        assert execute(["run", door, "--events", "open wind", "--trace", "--seed", str(seed)]) == 0
        outputs.add(capsys.readouterr().out)
    assert len(outputs) > 1


def test_conversation(
    door: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = "help\nevents\nopen wind\nstate\ndata\nset locked 1\nwait 3s\n\nquit\nshut\n"
    monkeypatch.setattr("sys.stdin", io.StringIO(lines))
    assert execute(["run", door]) == 0
    out = capsys.readouterr().out
    assert "let time pass" in out
    assert "* open(why Why)" in out
    assert "  locked = false" in out
    assert "after 2s" in out
    assert "nothing reacts" not in out


@pytest.mark.parametrize(
    ("events", "told"),
    [
        ("opn", "did you mean `open`"),
        ("open", "`why` of `open` needs a value"),
        ("open fire", "not a member of `Why`"),
        ("open hand 3", "does not take `3`"),
        ("set lock 1", "did you mean `locked`"),
        ("wait", "not a duration"),
        ("wait 1.5us", "finer"),
    ],
)
def test_wrong_events_are_diagnostics(
    door: str, events: str, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["run", door, "--events", events]) == 1
    err = capsys.readouterr().err
    assert "FK0580" in err
    assert told in err
    assert "Traceback" not in err


def test_a_missing_chart_and_a_wrong_target(door: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["run", "nowhere.yaml", "--events", ""]) == 1
    assert execute(["run", door, "--events", "", "--target", "cobol"]) == 2
    assert "there is no target `cobol`: interpreter, c" in capsys.readouterr().err
    assert execute(["run", door, "--events", "", "--script", "x"]) == 2


def test_a_fault_is_not_fine(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(
        "chart: Bad\nevents: {in: [go]}\ninitial: a\n"
        "states:\n  a: {on: {go: b}}\n  b: {always: c}\n  c: {always: b}\n"
    )
    assert execute(["run", str(path), "--events", "go"]) == 1
    assert "the machine stops: microsteps" in capsys.readouterr().out
