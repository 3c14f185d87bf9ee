"""The production cell: it produces, its properties hold, its seeded defects are found."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

import fsmkit
from fsmkit.cli.common.writing import write_files
from fsmkit.runtime.system_session import SystemSession
from fsmkit.verify.replay import perform
from fsmkit.verify.testgen.save import saved
from tests.parameters import sampled

CELL = Path(__file__).parents[2] / "machines" / "production_cell"
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
BUILT = ("feeder", "molder")
RequireTool = Callable[[str], str]


@pytest.fixture(scope="module")
def generated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the machines in C and in Python."""
    folder = tmp_path_factory.mktemp("generated")
    for name in (*BUILT, "plant"):
        chart = fsmkit.read_chart(CELL / f"{name}.yaml")
        for target in ("c", "python"):
            for path, text in fsmkit.compile(chart, target).items():
                (folder / path).write_text(text, encoding="utf-8")
    return folder


# --- the charts ----------------------------------------------------------------------------------


def started() -> SystemSession:
    """Return the cell in production."""
    session = SystemSession(fsmkit.read_system(CELL / "cell.yaml"))
    session.start()
    session.run(10_000)
    assert session.is_in("plant", "standing_by")
    session.post("plant", "press_start")
    return session


def blocks(session: SystemSession, until: int) -> int:
    """Run to a time, and count the blocks taken out."""
    happened = session.run(until)
    return sum(
        step.machine == "plant"
        and any(
            "arm_in" in {session.system.machines[2].chart.states[s].id for s in small.entered}
            for small in step.macrostep.microsteps
        )
        for step in happened
    )


def test_it_moulds_block_after_block() -> None:
    session = started()
    assert blocks(session, 70_000) >= 10
    assert session.value("feeder", "fault_code") == "none"
    assert session.value("molder", "fault_code") == "none"


def test_a_pause_stops_it_and_resume_goes_on_where_it_was() -> None:
    session = started()
    while not session.is_in("molder", "molding"):
        session.run(session.now + 500)
    before = session.active("feeder"), session.active("molder")
    for machine in ("feeder", "molder"):
        session.post(machine, "pause")
    assert blocks(session, session.now + 10_000) == 0
    assert (session.active("feeder"), session.active("molder")) == (("paused",), ("paused",))
    for machine in ("feeder", "molder"):
        session.post(machine, "resume")
    session.run(session.now)
    assert (session.active("feeder"), session.active("molder")) == before
    assert blocks(session, session.now + 30_000) >= 5


@pytest.mark.parametrize("at", sampled(range(10_000, 16_000, 500), every=4))
def test_it_recovers_from_an_emergency_stop_at_any_time(at: int) -> None:
    session = started()
    session.run(at)
    session.post("plant", "press_estop")
    session.run(at)
    assert session.is_in("feeder", "emergency")
    assert session.is_in("molder", "emergency")
    session.run(at + 12_000)
    assert session.is_in("plant", "standing_by")
    session.post("plant", "press_start")
    assert blocks(session, at + 40_000) >= 3


@pytest.mark.parametrize("at", sampled(range(10_000, 16_000, 500), every=4))
def test_it_starts_again_after_a_stop_at_any_time(at: int) -> None:
    session = started()
    session.run(at)
    session.post("plant", "press_stop")
    session.run(at + 5_000)
    assert session.is_in("plant", "standing_by")
    assert not session.value("plant", "feeder_forward")
    session.post("plant", "press_start")
    assert blocks(session, at + 40_000) >= 4


def test_the_derived_charts_use_inheritance_in_every_way() -> None:
    feeder, molder = (
        fsmkit.read_chart(CELL / "feeder.yaml"),
        fsmkit.read_chart(CELL / "molder.yaml"),
    )
    base = {state.id for state in fsmkit.read_chart(CELL / "module.scxml").states}
    origins = {
        (chart.name, state.id): state.origin.value
        for chart in (feeder, molder)
        for state in chart.states
    }
    assert {s.id for s in feeder.states} > base - {"Module"}
    assert origins["Molder", "warming_up"] == "own"  # a state in an inherited compound
    assert origins["Feeder", "pushing"] == "own"  # in an abstract leaf that is filled
    working = molder.states[molder.state_index["working"]]
    assert {molder.states[child].id for child in working.children} == {"door", "heater"}
    overridden = {
        (chart.name, chart.states[t.source].id)
        for chart in (feeder, molder)
        for t in chart.transitions
        if t.origin.value == "overridden"
    }
    assert {("Feeder", "ready"), ("Molder", "inventory"), ("Molder", "ready")} <= overridden


# --- what is proved ------------------------------------------------------------------------------


def verdicts(report: fsmkit.Report) -> dict[str, str]:
    return {result.name: result.verdict.value for result in report.results}


@pytest.mark.cc
def test_its_properties_hold(require_tool: RequireTool) -> None:
    require_tool("cc")
    report = fsmkit.check(CELL / "cell.yaml", engine="c", time="discrete")
    names = ["livelock", "P2", "P2_press", "P3", "H3", "D", "produces"]
    assert verdicts(report) == dict.fromkeys(names, "holds")
    assert report.verdict is fsmkit.Verdict.HOLDS
    states = report.exploration.states
    assert states < 300_000  # `make demo` explores it in Python too
    for page in (CELL / "README.md", CELL.parents[1] / "README.md"):
        assert f"{states:,} states" in page.read_text(encoding="utf-8")


@pytest.mark.cc
@pytest.mark.parametrize("name", BUILT)
def test_each_chart_alone_never_gets_stuck(name: str, require_tool: RequireTool) -> None:
    require_tool("cc")
    report = fsmkit.check(CELL / f"{name}.yaml", engine="c")
    assert verdicts(report) == {"trap": "holds", "livelock": "holds"}


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize(
    ("defect", "property_", "untimed"), [("m5", "P2", False), ("m2", "D", True)]
)
def test_a_defect_is_found_by_both_explorers(
    defect: str, property_: str, untimed: bool, require_tool: RequireTool
) -> None:
    require_tool("cc")
    chart = CELL / "defects" / f"{defect}_feeder.yaml"
    system = fsmkit.read_system(CELL / "cell.yaml", replace={"feeder": chart})
    found = []
    for engine in ("c", "python"):
        report = fsmkit.check(
            system,
            properties=(property_,),
            time="untimed" if untimed else "discrete",
            assume_watchdogs_silent=untimed,
            engine=engine,
        )
        result = next(r for r in report.results if r.name == property_)
        assert result.verdict is fsmkit.Verdict.VIOLATED
        assert result.trace is not None
        assert not result.trace.differs
        assert ("generated C" in result.trace.replayed) == (engine == "c")
        steps = result.trace.steps
        found.append(len(steps))
    assert found[0] == found[1]
    if defect == "m5":
        assert steps[-1].machine == "plant"
        assert "feeder_to_far" in steps[-1].after
    else:
        assert any(s.cause == "mold_ready" and s.before == s.after for s in steps)


# --- the loops -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def printed_in_python(generated: Path) -> str:
    """Return what the Python loop prints."""
    done = subprocess.run(
        [sys.executable, CELL / "controller" / "loop.py", "60"],
        env={**os.environ, "PYTHONPATH": str(generated)},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_the_loops_print_the_same(
    compiler: str,
    generated: Path,
    printed_in_python: str,
    tmp_path: Path,
    require_tool: RequireTool,
) -> None:
    sources = [CELL / "controller" / name for name in ("loop.c", "axis.c")]
    sources += [generated / f"{name}.c" for name in (*BUILT, "fsm")]
    program = tmp_path / "loop"
    subprocess.run(
        [require_tool(compiler), "-std=c99", *WARNINGS, f"-I{generated}", *sources, "-o", program],
        check=True,
    )
    in_c = subprocess.run([program, "60"], capture_output=True, text=True, check=True).stdout
    assert in_c == printed_in_python
    assert "QUEUE FULL" not in in_c
    assert in_c.splitlines()[-1] == "60000 cell 12 blocks moulded"


# --- the demo ------------------------------------------------------------------------------------


@pytest.fixture
def demo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    spec = importlib.util.spec_from_file_location("cell_demo", CELL / "demo.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "cell_demo", module)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "OUT", tmp_path / "demo")
    monkeypatch.setattr(module, "SECONDS", 5)
    return module


@pytest.mark.external
def test_the_demo_shows_what_it_can_without_a_compiler(
    demo: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    summary = demo.Summary()
    for step in (demo.compile_charts, demo.run_loops, demo.check_charts, demo.draw):
        step(summary)
    assert summary.exit_code == 0
    missing = [what for what, result, _ in summary.rows if result == demo.MISSING]
    assert len([what for what in missing if "SVG" not in what]) == 2
    assert "feeder" in capsys.readouterr().out
    assert (demo.OUT / "diagrams" / "feeder.mmd").exists()
    assert (demo.OUT / "generated" / "python" / "molder.py").exists()


@pytest.mark.cc
def test_the_demo_fails_where_something_does_not_hold(
    demo: ModuleType, monkeypatch: pytest.MonkeyPatch, require_tool: RequireTool
) -> None:
    require_tool("cc")

    def wrong(command: list[str], _: object = None) -> tuple[str, float]:
        return f"1 cell 0 blocks moulded by {len(command)}\n", 0.0

    monkeypatch.setattr(demo, "timed", wrong)
    summary = demo.Summary()
    demo.compile_charts(summary)
    demo.run_loops(summary)
    assert summary.exit_code == 1


@pytest.mark.slow
@pytest.mark.cc
def test_a_saved_trace_of_a_replaced_machine_is_performed_again(tmp_path: Path) -> None:
    chart = CELL / "defects" / "m5_feeder.yaml"
    system = fsmkit.read_system(CELL / "cell.yaml", replace={"feeder": chart})
    report = fsmkit.check(system, properties=("produces",))
    write_files(saved(report, CELL / "cell.yaml", tmp_path))
    recorded = json.loads((tmp_path / "Cell_produces.json").read_text())
    assert recorded["replaced"] == {"feeder": str(chart)}
    assert perform(recorded) == [step["lines"] for step in recorded["steps"]]
