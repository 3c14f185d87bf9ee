"""`fsmkit cover`: suites take all there is, pass, and fail where the chart differs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import load_any
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.testgen.cover import Cover, Item, cover
from fsmkit.verify.testgen.replay_python import in_python
from tests.verify.systems import SYSTEMS
from tests.verify.testgen.test_saved_tests import CHART, c_fails, pytest_passes, written

CELL = Path(__file__).parents[3] / "machines/production_cell"


def covered(file: Path, options: ExplorationOptions) -> Cover:
    return cover(check(load_any(file, Findings()), Findings(), options=options))


@pytest.mark.cc
@pytest.mark.parametrize(("name", "untimed"), [("drive", False), ("losing", True)])
def test_both_engines_cover_what_they_see(
    tmp_path: Path, require_tool: Callable[[str], str], name: str, untimed: bool
) -> None:
    require_tool("cc")
    file = written(tmp_path, SYSTEMS[name])
    whole = []
    for engine in ("c", "python"):
        report = check(
            load_any(file, Findings()),
            Findings(),
            options=ExplorationOptions(
                engine, time="untimed" if untimed else "discrete", covers=True
            ),
        )
        found = cover(report)
        assert found.is_whole
        whole.append(found.covered)
        for item in found.wanted - found.covered:
            figures = report.exploration.machines[item.machine]
            assert item.number not in (figures.states if item.is_state else figures.transitions)
    assert whole[0] == whole[1]


@pytest.mark.cc
def test_marking_changes_no_verdict(tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    require_tool("cc")
    file = written(tmp_path, SYSTEMS["drive"])
    seen = []
    for covers in (False, True):
        options = ExplorationOptions("c", covers=covers)
        report = check(load_any(file, Findings()), Findings(), options=options)
        seen.append([(result.name, result.verdict) for result in report.results])
    assert seen[0] == seen[1]


@pytest.mark.slow
def test_paths_are_few_and_short(tmp_path: Path) -> None:
    chart = written(tmp_path, {"sender": CHART})
    found = covered(chart, ExplorationOptions("python", time="discrete", covers=True))
    assert len(found.paths) <= 4
    assert max(len(path.steps) for path in found.paths) <= 5


def test_what_cannot_be_reached_has_a_reason(tmp_path: Path) -> None:
    left = "chart: A\nevents: {in: [go, on]}\ninitial: one\nstates:\n  one: {rest: true, on: "
    chart = left + "{go: two, on: {if: 1 > 2, target: three}}}\n  two: {rest: true}\n"
    chart += "  three: {on: {go: two}}\n"
    found = covered(
        written(tmp_path, {"a": chart}), ExplorationOptions("python", time="discrete", covers=True)
    )
    reasons = {missed.text: missed.reason for missed in found.uncovered}
    assert reasons["state three"] == "no transition to it is ever taken"
    assert reasons["three on go -> two"] == "`three` is never entered"
    assert reasons["one on on -> three"].startswith("where its source is active it is never enab")
    assert found.covered == found.wanted - {missed.item for missed in found.uncovered}
    assert Item(0, is_state=True, number=1) in found.covered


@pytest.mark.slow
@pytest.mark.cc
def test_a_suite_passes_and_a_mutant_fails(
    tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    require_tool("cc")
    chart, folder = written(tmp_path, {"sender": CHART}), tmp_path / "suite"
    assert execute(["cover", str(chart), "--out", str(folder)]) == 0
    page = (folder / "coverage.md").read_text()
    assert "| Sender | 6 of 6 | 4 of 4 |" in page
    python, c = folder / "test_sender_cover.py", folder / "sender_cover.c"
    assert pytest_passes(python)
    assert c_fails(c, [chart]) == ""
    chart.write_text(CHART.replace("fin: over}\n  three", "fin: one}\n  three"))
    assert not pytest_passes(python)
    assert "expected" in c_fails(c, [chart])


@pytest.mark.slow
@pytest.mark.cc
def test_the_suite_of_the_cell_finds_its_mutants(
    tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    require_tool("cc")
    execute(["cover", str(CELL / "cell.yaml"), "--out", str(tmp_path)])
    c = tmp_path / "cell_cover.c"
    assert c_fails(c, [CELL / "feeder.yaml", CELL / "molder.yaml"]) == ""
    for mutant in ("m2_feeder", "m5_feeder"):
        assert "expected" in c_fails(c, [CELL / f"defects/{mutant}.yaml"]), mutant


def test_generated_python_performs_the_suite(tmp_path: Path) -> None:
    file = written(tmp_path, SYSTEMS["drive"])
    found = covered(file, ExplorationOptions("python", time="untimed", covers=True))
    for path in found.paths:
        expected = [[x for x in step.lines if not x.startswith("@")] for step in path.steps]
        assert in_python(found.closed, path.steps) == expected
