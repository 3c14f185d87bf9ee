"""Ten tasks of a new user, solved with `fsmkit --help` and one `VERB --help` each."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fsmkit.cli import execute

STUCK = """\
chart: Stuck
events: {in: [go]}
initial: a
states:
  a: {rest: true, on: {go: b}}
  b: {}
"""
TASKS = {
    "generate small C": ("compile gate.yaml --optimize size --out small", 0, "small/gate.c"),
    "find a trap and save its path": ("check stuck.yaml --save-trace traces", 1, "traces"),
    "prove one property without time": (
        "check gate.system.yaml --property together --time untimed", 0, "",
    ),
    "measure two properties with mutants": (
        "mutants gate.system.yaml --property together --property never_stuck --sample 4", 1, "",
    ),
    "prove a refinement": ("refine gate.yaml gate.yaml --timeout 60s", 0, ""),
    "export a model for UPPAAL": (
        "export gate.system.yaml --to uppaal --out yard.xml", 0, "yard.xml",
    ),
    "draw a chart with an active state": (
        "draw gate.yaml --active opening --out gate.dot", 0, "gate.dot",
    ),
    "run a script on generated C": ("run gate.yaml --target c --script steps.txt", 0, ""),
    "generate tests that cover a chart": ("cover gate.yaml --out covered", 0, "covered"),
    "measure the coverage of tests": ("test gate.test.yaml --cov", 0, ".fsmkit-coverage"),
}  # fmt: skip


def printed(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert execute(arguments) == 0
    return capsys.readouterr().out


STARTS_TOOLS = ("export a model for UPPAAL", "run a script on generated C")
"""Tasks that start `dot` or `clang` where they are installed."""


@pytest.mark.cc
@pytest.mark.parametrize(
    "task",
    [
        pytest.param(task, marks=pytest.mark.external if task in STARTS_TOOLS else ())
        for task in TASKS
    ],
)
def test_help_names_what_solves_a_task(
    task: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    command, code, written = TASKS[task]
    verb, *arguments = command.split()
    assert re.search(rf"^ +{verb} ", printed(["--help"], capsys), re.MULTILINE)
    options = printed([verb, "--help"], capsys)
    for option in (each for each in arguments if each.startswith("--")):
        assert re.search(rf"(^|[ ,]){option}\b", options, re.MULTILINE), option
    monkeypatch.chdir(tmp_path)
    assert execute(["new", "--examples", "examples"]) == 0
    monkeypatch.chdir(tmp_path / "examples" / "gate")
    Path("stuck.yaml").write_text(STUCK, encoding="utf-8")
    Path("steps.txt").write_text("start 0\npost request\nrun 1000\n", encoding="utf-8")
    assert execute([verb, *arguments]) == code, capsys.readouterr().err
    assert Path(written or ".").exists()
