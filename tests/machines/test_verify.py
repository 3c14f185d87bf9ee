"""`make verify`: a part of it that takes seconds, and what its tables rest on."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest
from rich.console import Console

import fsmkit
from tests.machines.cell_script import the_script
from tests.parameters import sampled

CELL = Path(__file__).parents[2] / "machines" / "production_cell"
needs_compiler = pytest.mark.cc


@pytest.fixture(name="verify", scope="module")
def verify_module() -> ModuleType:
    return the_script()


def systems() -> list[Path]:
    pairs, homing = (CELL / "pairs").glob("*-*.yaml"), (CELL / "homing").glob("*.yaml")
    return [CELL / "ring.yaml", *sorted(pairs), *sorted(homing), *alone()]


def alone() -> list[Path]:
    """Return the systems of a single module."""
    return [path for path in sorted((CELL / "alone").glob("*.yaml")) if path.stem != "supervisor"]


@pytest.mark.parametrize("path", sampled(systems(), every=4), ids=lambda path: path.stem)
def test_every_system_can_be_read(path: Path) -> None:
    system = fsmkit.read_system(path)
    assert {"L1"} <= {p.name for p in system.properties}


@pytest.mark.slow
def test_every_mutant_differs_from_its_reference_and_fits_its_system(verify: ModuleType) -> None:
    files = {chart for mutant in verify.MUTANTS for _, chart in mutant.run.replace}
    assert files == {
        str(path.relative_to(CELL))
        for folder in ("mutants", "defects")
        for path in (CELL / folder).glob("*.yaml")
    }
    for mutant in verify.MUTANTS:
        charts = {machine: CELL / chart for machine, chart in mutant.run.replace}
        system = fsmkit.read_system(CELL / mutant.run.system, replace=charts)
        names = {p.name for p in system.properties}
        assert not mutant.breaks or mutant.breaks in names


def test_every_module_of_the_ring_inherits_the_emergency_stop() -> None:
    system = fsmkit.read_system(CELL / "ring.yaml")
    modules = [m for m in system.machines if "emergency" in m.chart.state_index]
    assert len(modules) == 8
    for module in modules:
        chart = module.chart
        (stop,) = (
            t
            for t in chart.transitions
            if "estop" in t.descriptors and chart.states[t.source].id == "operational"
        )
        assert stop.guard is None
        assert [chart.states[target].id for target in stop.targets] == ["emergency"]


@pytest.mark.slow
@pytest.mark.cc
@needs_compiler
@pytest.mark.parametrize(("blocks", "time"), [(1, "untimed"), (3, "zones")])
def test_all_properties_of_the_ring_hold(verify: ModuleType, blocks: int, time: str) -> None:
    report = verify.check(verify.Run("ring.yaml", time, blocks))
    assert [r.name for r in report.results if r.verdict is not fsmkit.Verdict.HOLDS] == []
    assert report.exploration.states > 10_000


@pytest.mark.slow
@pytest.mark.cc
@needs_compiler
def test_whatever_time_limit_is_reached_the_ring_comes_to_no_harm(verify: ModuleType) -> None:
    run = verify.Run("ring.yaml", "untimed", 1, live=True, symbolic=True)
    report = verify.check(run)
    assert [r.name for r in report.results if r.verdict is not fsmkit.Verdict.HOLDS] == []
    assert report.exploration.states == 250_520_193
    assert not any("environment posts" in line for line in report.assumptions)


def links(path: Path) -> set[str]:
    """Return the lines of `connect` that speak of no stand-in."""
    connected = path.read_text(encoding="utf-8").partition("\nconnect:\n")[2]
    lines = connected.partition("\nenvironment:\n")[0].splitlines()
    return {line for line in lines if line.startswith("  - ") and "others." not in line}


@pytest.mark.parametrize("path", sorted((CELL / "homing").glob("*.yaml")), ids=lambda p: p.stem)
def test_who_is_brought_up_is_connected_as_in_the_ring(path: Path) -> None:
    assert len(links(path)) > 40
    assert links(path) <= links(CELL / "ring.yaml")


@pytest.mark.slow
@pytest.mark.cc
@needs_compiler
@pytest.mark.parametrize("path", sorted((CELL / "homing").glob("*.yaml")), ids=lambda p: p.stem)
def test_the_cell_is_brought_up(verify: ModuleType, path: Path) -> None:
    report = verify.check(verify.Run(f"homing/{path.name}", "zones"))
    assert [r.name for r in report.results if r.verdict is not fsmkit.Verdict.HOLDS] == []


@pytest.mark.slow
@pytest.mark.cc
@needs_compiler
@pytest.mark.parametrize(
    ("stage", "count", "broken"),
    [
        ("READY_1", 1, "R1_homing_2"),
        ("READY_2", 4, "R1_homing_3"),
        ("READY_3", 5, "R1_homing_4"),
        ("READY_4", 7, "R1_all"),
    ],
)
def test_a_supervisor_that_waits_for_too_few_is_found(
    tmp_path: Path, stage: str, count: int, broken: str
) -> None:
    hasty = tmp_path / "hasty.yaml"
    hasty.write_text(
        f"chart: Hasty\nextends: {CELL}/supervisor.yaml\nconstants: {{{stage}: {count}}}\n"
    )
    system = fsmkit.read_system(CELL / "homing" / "molder.yaml", replace={"supervisor": hasty})
    (found,) = fsmkit.check(system, properties=(broken,)).results[-1:]
    assert (found.name, found.verdict) == (broken, fsmkit.Verdict.VIOLATED)


@pytest.mark.slow
@pytest.mark.cc
@needs_compiler
@pytest.mark.parametrize("name", ["M5", "M17", "M22", "M23"])
def test_a_mutant_is_found(verify: ModuleType, name: str) -> None:
    (mutant,) = (m for m in verify.MUTANTS if m.name == name)
    report = verify.check(mutant.run, (mutant.breaks,))
    assert verify.is_as_expected(mutant, report)
    trace = next(r.trace for r in report.results if r.name == mutant.breaks)
    assert trace.replayed
    assert verify.length(mutant, report) == len(trace.steps) > 40


@pytest.mark.slow
def test_every_module_is_explored_alone(verify: ModuleType) -> None:
    ring = fsmkit.read_system(CELL / "ring.yaml")
    charts = {m.chart.name for m in ring.machines if "emergency" in m.chart.state_index}
    assert {path.relative_to(CELL) for path in alone()} == set(map(Path, verify.ALONE))
    explored = {m.chart.name for path in alone() for m in fsmkit.read_system(path).machines}
    assert charts - explored == {"Rotator"}  # the extractor with another constant


@pytest.mark.parametrize("path", alone(), ids=lambda path: path.stem)
def test_every_effect_of_a_module_is_observed(path: Path) -> None:
    system = fsmkit.read_system(path)
    (module,) = (m for m in system.machines if "emergency" in m.chart.state_index)
    connected = path.read_text(encoding="utf-8").partition("\nconnect:\n")[2]
    for operation in module.chart.operations:
        if module.chart.name == "Camera" and not operation.name.startswith("motor_"):
            continue  # it has no axis
        if module.chart.name == "Sorter" and operation.name in {"hold", "seek", "goto"}:
            continue  # likewise
        assert f"  - {module.name}.{operation.name} -> " in connected, operation.name


@pytest.mark.slow
@pytest.mark.cc
@needs_compiler
@pytest.mark.parametrize("path", alone(), ids=lambda path: path.stem)
def test_all_properties_of_a_module_hold_whatever_jams(verify: ModuleType, path: Path) -> None:
    report = verify.check(verify.Run(f"alone/{path.name}", "zones"))
    assert [r.name for r in report.results if r.verdict is not fsmkit.Verdict.HOLDS] == []
    counted = f" {report.exploration.states:,} "
    assert counted in (CELL / "README.md").read_text(encoding="utf-8")


MISTAKES = "M41 M42 M51 M57 M69 M75 M78 M81 M92 M95"
"""At least one mistake in each system of one module; `make verify` checks all of them."""


@pytest.mark.slow
@pytest.mark.cc
@needs_compiler
@pytest.mark.parametrize("name", MISTAKES.split())
def test_a_mistake_of_one_module_is_found(verify: ModuleType, name: str) -> None:
    (mutant,) = (m for m in verify.MUTANTS if m.name == name)
    report = verify.check(mutant.run, (mutant.breaks,))
    assert verify.is_as_expected(mutant, report)


@pytest.mark.slow
@pytest.mark.cc
@needs_compiler
def test_a_verdict_that_is_not_expected_is_told(verify: ModuleType) -> None:
    (found,) = (m for m in verify.MUTANTS if m.name == "M5")
    wrong = verify.Mutant("X", "the reference", verify.Run("ring.yaml", "untimed", 1), "P2")
    console = Console(record=True, width=120)
    assert not verify.hunt([wrong], console)
    assert "NOT P2" in console.export_text()
    assert not verify.prove([found.run], console)
