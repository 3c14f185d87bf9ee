"""`fsmkit convert` of machines of other tools: report, stubs, proofs."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from fsmkit.cli import execute

LAMP = r"""@startuml Lamp
[*] --> Off
Off : enter / dark();
Off --> On : PRESS [is_fine] / "*/ int x; /*"; shine();
state On {
  [*] --> Low
  Low --> High : PRESS
  High --> On : PRESS
}
On --> Off : HOLD
%s
@enduml
"""
PROGRAM = """
import sys
state, happened, fine = "off", ["dark"], False
for line in sys.stdin:
    word, *rest = line.split()
    if word == "set":
        fine = rest[1] == "true"
    elif word == "post":
        if rest == ["PRESS"] and state == "off" and fine:
            state = "low"
            happened += ["int_x", "shine"]
        elif rest == ["PRESS"] and state != "off":
            state = {"low": "high", "high": HIGH}[state]
        elif rest == ["HOLD"] and state != "off":
            state = "off"
            happened += ["dark"]
    elif word != "advance":
        print(*happened, f"state {state}", "end", sep="\\n", flush=True)
        happened = []
"""


@pytest.fixture
def lamp(tmp_path: Path) -> Path:
    path = tmp_path / "lamp.puml"
    path.write_text(LAMP % "")
    return path


def test_the_report_as_json(lamp: Path, capsys: pytest.CaptureFixture[str]) -> None:
    report = lamp.with_suffix(".json")
    assert execute(["convert", str(lamp), "--to", "yaml", "--report", str(report), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["report"] == json.loads(report.read_text())
    assert printed["report"]["read"] == {"states": 4, "transitions": 4, "events": 2}
    assert [one["rule"] for one in printed["report"]["rewritten"]] == ["R1"]


def test_rejected_parts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "lamp.puml"
    path.write_text(LAMP % "On --> [*] : END")
    assert execute(["convert", str(path), "--to", "yaml"]) == 1
    assert "StateSmith has no final states" in capsys.readouterr().err
    assert execute(["convert", str(path), "--to", "yaml", "--partial", "--json"]) == 1
    report = json.loads(capsys.readouterr().out)["report"]
    assert [one["code"] for one in report["rejected"]] == ["FK0682"]


@pytest.mark.parametrize(
    ("options", "code"),
    [
        (["--stubs", "c"], 2),
        (["--prove-with", "x"], 2),
        (["--prove", "0"], 2),
        (["--from", "mermaid"], 1),
        (["--machine", "Lamps"], 1),
    ],
)
def test_wrong_options(lamp: Path, options: list[str], code: int) -> None:
    assert execute(["convert", str(lamp), "--to", "yaml", *options]) == code


def test_options_of_imports_need_one(tmp_path: Path) -> None:
    assert execute(["new", str(tmp_path / "gate.yaml")]) == 0
    assert execute(["convert", str(tmp_path / "gate.yaml"), "--to", "scxml", "--partial"]) == 2


@pytest.mark.slow
@pytest.mark.cc
def test_stubs_compile_with_the_machine(lamp: Path) -> None:
    chart = lamp.with_suffix(".yaml")
    for language in ("c", "python"):
        assert execute(["convert", str(lamp), "--out", str(chart), "--stubs", language]) == 0
    assert execute(["compile", str(lamp), "--out", str(lamp.parent)]) == 0
    warnings = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    sources = ["lamp.c", "lamp_host.c", "fsm.c"]
    subprocess.run(["cc", *warnings, "-c", *sources], cwd=lamp.parent, check=True)
    compile((lamp.parent / "lamp_host.py").read_text(), "lamp_host.py", "exec")


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.external
@pytest.mark.parametrize("high", ["'low'", "'high'"])
def test_a_program_of_the_tool(lamp: Path, high: str, capsys: pytest.CaptureFixture[str]) -> None:
    program = lamp.parent / "lamp.py"
    program.write_text(PROGRAM.replace("HIGH", high))
    command = f"{sys.executable} {program}"
    given = ["convert", str(lamp), "--to", "yaml", "--prove", "700", "--prove-with", command]
    is_right = high == "'low'"
    assert execute(given) == int(not is_right)
    printed = capsys.readouterr().err
    if is_right:
        assert "compared   700 random events: interpreter, generated C" in printed
    else:
        assert "state high" in printed
        assert "differ after 4 steps" in printed, "the shortest: start, three presses"


@pytest.mark.parametrize("command", ["/nonexistent", "true", f"{sys.executable} -c 'print(1)'"])
@pytest.mark.cc
@pytest.mark.external
def test_a_program_that_does_not_answer(
    lamp: Path, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    given = ["convert", str(lamp), "--to", "yaml", "--prove", "10", "--prove-with", command]
    assert execute(given) == 1
    assert "broken-proof" in capsys.readouterr().err
