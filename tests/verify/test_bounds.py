"""`fsmkit compile --bounds from-check`: smaller, enough, and refused where that is not proved."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.any_file import load_any
from fsmkit.system.of_one_chart import system_of
from fsmkit.verify.bounds import prove_bounds
from fsmkit.verify.explore import ExplorationOptions, check
from tests.verify.systems import SYSTEMS
from tests.verify.testgen.test_saved_tests import CHART, written


def compiled(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, dict[str, int]]:
    """Return the capacities and the size of each machine that is compiled."""
    capsys.readouterr()
    assert execute(["compile", *words, "--json"]) == 0
    machines = json.loads(capsys.readouterr().out)["machines"]
    return {m["name"]: m["capacities"] | {"bytes": m["struct_bytes"]} for m in machines}


@pytest.mark.cc
@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("drive", ExplorationOptions("python", time="discrete")),
        ("drive", ExplorationOptions("c")),
        ("livelock", ExplorationOptions("python", time="discrete")),
        ("kitchen", ExplorationOptions("python", time="discrete")),
    ],
)
def test_what_is_proved_is_enough(
    tmp_path: Path, require_tool: Callable[[str], str], name: str, options: ExplorationOptions
) -> None:
    require_tool("cc")
    system = load_any(written(tmp_path, SYSTEMS[name]), Findings())
    proof = prove_bounds(system, Findings(), options)
    machines = tuple(
        replace(machine, chart=proof.of(machine.chart) or machine.chart)
        for machine in system.machines
    )
    small = replace(system, machines=machines)
    before, after = (check(s, Findings(), options=options) for s in (system, small))
    assert [(r.name, r.verdict) for r in after.results] == [
        (r.name, r.verdict) for r in before.results
    ]
    assert after.exploration.states == before.exploration.states
    for machine, figures in zip(small.machines, after.exploration.machines, strict=True):
        room = machine.chart.capacities
        assert figures.queue <= room.queue < 8
        assert figures.microsteps <= room.microsteps < 100


@pytest.mark.cc
def test_a_machine_is_smaller_and_says_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], require_tool: Callable[[str], str]
) -> None:
    require_tool("cc")
    system = written(tmp_path, SYSTEMS["drive"])
    chart, out = str(tmp_path / "driver.yaml"), str(tmp_path / "made")
    before = compiled(capsys, chart, "--out", str(tmp_path / "before"))["Driver"]
    words = [chart, "--out", out, "--bounds", "from-check", "--system", str(system)]
    after = compiled(capsys, *words)["Driver"]
    assert after["queue"] == 1 + 2
    assert after["bytes"] < before["bytes"]
    header = (tmp_path / "made/driver.h").read_text(encoding="utf-8")
    comment = re.search(r"/\* Bounds and figures\..*?\*/", header, re.DOTALL)
    assert comment is not None
    assert "Drive: this system; dense time" in comment[0]
    assert "at most 2 external events" in comment[0]
    assert "#define DRIVER_QUEUE 3u" in header
    words = [chart, "--out", out, "--bounds", "from-check", "--system", str(system)]
    execute(["compile", *words, "--time", "untimed"])
    header = (tmp_path / "made/driver.h").read_text(encoding="utf-8")
    assert "timers fire at any time" in header


@pytest.mark.cc
def test_a_queue_that_overflows_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], require_tool: Callable[[str], str]
) -> None:
    require_tool("cc")
    chart = written(tmp_path, {"sender": CHART})
    words = ["compile", str(chart), "--bounds", "from-check", "--out", str(tmp_path / "made")]
    assert execute(words) == 1
    told = capsys.readouterr().err
    assert "bounds-not-proved" in told
    assert "a queue of `Sender` can overflow" in told
    assert not (tmp_path / "made").exists()


def test_samples_prove_nothing(tmp_path: Path) -> None:
    chart = "chart: A\nevents: {in: ['go(x int32, y int32)']}\ninitial: one\nstates:\n"
    chart += "  one: {rest: true, on: {go: {if: event.x * event.y > 40, target: two}}}\n"
    chart += "  two: {rest: true}\n"
    system = load_any(written(tmp_path, {"a": chart}), Findings())
    with pytest.raises(FsmkitError, match="only samples"):
        prove_bounds(system, Findings(), ExplorationOptions("python", time="discrete"))


@pytest.mark.cc
def test_a_chart_that_does_not_run_there_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], require_tool: Callable[[str], str]
) -> None:
    require_tool("cc")
    system = written(tmp_path, {**SYSTEMS["drive"], "other": SYSTEMS["deadlock"]["left"]})
    other = str(tmp_path / "other.yaml")
    words = ["compile", other, "--bounds", "from-check", "--system", str(system)]
    assert execute([*words, "--out", str(tmp_path / "made")]) == 1
    assert "no machine of that system runs `Left`" in capsys.readouterr().err


def test_a_chart_that_sends_to_itself_keeps_its_microsteps(tmp_path: Path) -> None:
    chart = "chart: A\nevents: {in: [go, on]}\ninitial: one\nstates:\n"
    chart += "  one: {rest: true, on: {go: {do: send on}, on: two}}\n  two: {rest: true}\n"
    system = load_any(written(tmp_path, {"a": chart}), Findings())
    own = system.machines[0].chart
    small = prove_bounds(
        system_of(own), Findings(), ExplorationOptions("python", time="discrete")
    ).of(own)
    assert small is not None
    assert small.capacities.microsteps == own.capacities.microsteps
    assert small.capacities.queue < own.capacities.queue
