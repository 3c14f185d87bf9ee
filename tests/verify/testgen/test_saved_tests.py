"""`fsmkit check --save-test`: what is written passes, and fails where the chart differs."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import load_any
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.testgen.replay_python import in_python
from tests.verify.systems import SYSTEMS

ROOT = Path(__file__).parents[3]

CHART = """
chart: Sender
types: {kind: [a, b]}
inputs: {level: 0..5}
outputs: {lamp: bool = false}
events: {in: ["go(n 0..3, k kind)", fin, tick], out: ["done(n 0..3)"]}
operations: ["ask(k kind) -> 0..2", hit()]
data: {seen: 0..9 = 0}
initial: one
states:
  one:
    defer: [fin]
    on:
      go: {target: two, do: "seen = event.n; send tick after 10ms; send done(n = event.n)"}
  two:
    entry: lamp = true
    after: {5ms: {target: one, if: "ask(kind.b) == 1"}}
    on: {tick: three, fin: over}
  three:
    invariant: seen == 3
    always: {if: "level > 4", target: over}
    on: {fin: over}
  over: {final: true}
"""


def written(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    return folder / f"{next(iter(files))}.yaml"


def pytest_passes(path: Path) -> bool:
    command = [sys.executable, "-m", "pytest", "-q", str(path), "-p", "no:cacheprovider"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(command, check=False, cwd=path.parent, env=environment).returncode == 0


def c_fails(path: Path, charts: list[Path]) -> str:
    """Compile a C test as its comment says, and return what it prints; empty if it passes."""
    folder = path.parent
    for chart in charts:
        assert execute(["compile", str(chart), "--out", str(folder / "generated")]) == 0
    lines = path.read_text(encoding="utf-8").splitlines()
    command = next(line for line in lines if "cc -I generated" in line).strip(" *").split()
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-o", "again"]
    subprocess.run([*command, *flags], check=True, cwd=folder)
    done = subprocess.run(["./again"], check=False, cwd=folder, capture_output=True, text=True)
    assert (done.returncode == 0) == (not done.stdout)
    return done.stdout


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize("options", [[], ["--time", "untimed"]])
def test_a_chart_performs_again_what_was_found(
    tmp_path: Path, require_tool: Callable[[str], str], options: list[str]
) -> None:
    require_tool("cc")
    chart = written(tmp_path, {"sender": CHART})
    python, c = tmp_path / "test_sender.py", tmp_path / "sender_again.c"
    command = ["check", str(chart), *options, "--save-test", str(python), "--save-test", str(c)]
    assert execute(command) == 1
    assert pytest_passes(python)
    assert c_fails(c, [chart]) == ""
    chart.write_text(CHART.replace("tick: three", "tick: {target: three, do: hit()}"))
    assert not pytest_passes(python)
    assert "op hit" in c_fails(c, [chart])


BELL = r"""
chart: Bell
events: {in: [go], out: ["told(s symbol)"]}
operations: ["say(s symbol)"]
initial: a
states:
  a: {on: {go: {target: b, do: "say('x\ty\u0007??/ ö'); send told(s = 'LONG')"}}}
  b: {on: {go: c}}
  c: {}
"""


@pytest.mark.cc
def test_texts_are_expected_as_they_are(tmp_path: Path) -> None:
    chart = written(tmp_path, {"bell": BELL.replace("LONG", "y" * 3000)})
    c = tmp_path / "bell_again.c"
    execute(["check", str(chart), "--save-test", str(c)])
    assert c_fails(c, [chart]) == ""


@pytest.mark.cc
def test_a_delay_that_changed_is_told(tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    require_tool("cc")
    chart = written(tmp_path, {"sender": CHART})
    c = tmp_path / "sender_again.c"
    execute(["check", str(chart), "--save-test", str(c)])
    chart.write_text(CHART.replace("tick after 10ms", "tick after 11ms"))
    assert "not due, but in 1 ticks" in c_fails(c, [chart])


@pytest.mark.cc
def test_machines_of_a_system_perform_again_what_was_found(
    tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    require_tool("cc")
    file = written(tmp_path, SYSTEMS["drive"])
    python, c = tmp_path / "test_drive.py", tmp_path / "drive_again.c"
    execute(["check", str(file), "--save-test", str(python), "--save-test", str(c)])
    assert f"fsmkit compile {tmp_path}/driver.yaml --out generated" in c.read_text()
    assert pytest_passes(python)
    driver = tmp_path / "driver.yaml"
    assert c_fails(c, [driver]) == ""
    driver.write_text(driver.read_text().replace("tries += 1", "tries += 2"))
    assert "violates_never_twice, step 6" in c_fails(c, [driver])


BEATS = """
chart: Beats
events: {out: [beat]}
initial: first
states:
  first: {after: {25ms: {target: second, do: send beat after 2ms}}}
  second: {rest: true, after: {10ms: {target: third, do: send beat}}}
  third: {rest: true}
"""
LATE = """
system: Late
machines: {beats: beats.yaml}
MANNER
properties: {never_third: {never: PLACE}}
"""


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize(
    ("manner", "place"),
    [
        ("schedule: {cyclic: [beats], period: 20ms}", "beats.In(third)"),
        (
            "environment: {freezes: {node: {machines: [beats], continues: 60ms}}}",
            '"beats.In(third) and node.In(resumed)"',
        ),
    ],
    ids=["turns", "frozen"],
)
def test_timers_that_fire_late_do_so_again(tmp_path: Path, manner: str, place: str) -> None:
    system = LATE.replace("MANNER", manner).replace("PLACE", place)
    file = written(tmp_path, {"late": system, "beats": BEATS})
    python, c = tmp_path / "test_late.py", tmp_path / "late_again.c"
    options = ["--engine", "python", "--time", "discrete"]
    command = ["check", str(file), *options, "--save-test", str(python), "--save-test", str(c)]
    assert execute(command) == 1
    assert pytest_passes(python)
    beats = tmp_path / "beats.yaml"
    assert re.search(r"_fire\(.*, true, [1-9]\d*u", c.read_text()), "no timer is late"
    assert c_fails(c, [beats]) == ""
    beats.write_text(BEATS.replace("10ms", "11ms"))
    assert "not due, but in" in c_fails(c, [beats])


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(SYSTEMS) - {"shared"}))
@pytest.mark.parametrize(
    "options",
    [ExplorationOptions("python", time="discrete"), ExplorationOptions("python", time="untimed")],
    ids=["time", "untimed"],
)
def test_generated_python_does_what_the_interpreter_does(
    tmp_path: Path, name: str, options: ExplorationOptions
) -> None:
    file = written(tmp_path, SYSTEMS[name])
    report = check(load_any(file, Findings()), Findings(), options=options)
    found = [result.trace.steps for result in report.results if result.trace is not None]
    for steps in found:
        expected = [[x for x in step.lines if not x.startswith("@")] for step in steps]
        assert in_python(report.closed, steps) == expected


def test_an_unknown_language_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chart = written(tmp_path, {"sender": CHART})
    assert execute(["check", str(chart), "--save-test", "a.rs"]) == 2
    assert "unknown-suffix" in capsys.readouterr().err
