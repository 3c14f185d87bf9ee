"""The public API: the verbs of the command line as functions."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import fsmkit

CELL = Path(__file__).parents[1] / "machines" / "production_cell"
LAMP = """\
chart: Lamp
operations:
  - light(on bool)
events:
  in: [press]
  out: [switched]
initial: off
states:
  off: {on: {press: {target: lit, do: send switched}}}
  lit:
    entry: light(true)
    exit: light(false)
    after: {2s: off}
"""


@pytest.fixture
def lamp(tmp_path: Path) -> Path:
    path = tmp_path / "lamp.yaml"
    path.write_text(LAMP)
    return path


def test_every_name_is_there() -> None:
    for name in fsmkit.__all__:
        assert getattr(fsmkit, name) is not None
    assert set(fsmkit.__all__) <= set(dir(fsmkit))


def test_what_is_not_there_is_said() -> None:
    with pytest.raises(AttributeError, match="no attribute `charts`"):
        fsmkit.charts  # noqa: B018


@pytest.mark.cc
def test_importing_it_imports_nothing_heavy() -> None:
    told = "import sys, fsmkit; print(*[m for m in sys.modules if m.split('.')[0] in %r])"
    heavy = ("lark", "lxml", "yaml", "rich", "click", "graphviz")
    done = subprocess.run(
        [sys.executable, "-c", told % (heavy,)], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == ""


def test_load_and_compile(lamp: Path) -> None:
    chart = fsmkit.load(lamp)
    assert chart.name == "Lamp"
    assert {"lamp.c", "lamp.h", "fsm.h"} <= set(fsmkit.compile(chart))
    assert fsmkit.compile(lamp, "python") == fsmkit.compile(chart, target="python")
    assert "led.c" in fsmkit.compile(chart, prefix="led")


def test_compile_says_what_it_cannot(lamp: Path) -> None:
    with pytest.raises(fsmkit.FsmkitError, match="there is no target `cobol`"):
        fsmkit.compile(lamp, "cobol")
    with pytest.raises(fsmkit.FsmkitError, match="abstract"):
        fsmkit.compile(CELL / "module.scxml")


def test_check_a_chart_and_a_path(lamp: Path) -> None:
    report = fsmkit.check(lamp, engine="python")
    assert report.verdict is fsmkit.Verdict.HOLDS
    again = fsmkit.check(fsmkit.load(lamp), engine="python")
    assert again.exploration.states == report.exploration.states > 1


@pytest.mark.cc
@pytest.mark.parametrize("zones", [False, True], ids=["discrete", "zones"])
def test_check_lets_time_pass_as_it_is_told(*, zones: bool) -> None:
    fischer = CELL.parent / "fischer" / "fischer.yaml"
    report = fsmkit.check(fsmkit.load_system(fischer), engine="c", zones=zones)
    assert report.exploration.states == (18 if zones else 68)


def test_check_a_system_with_a_machine_replaced() -> None:
    defect = CELL / "defects" / "m5_feeder.yaml"
    system = fsmkit.load_system(CELL / "cell.yaml", replace={"feeder": defect})
    assert system.machines[0].chart == fsmkit.load(defect)
    assert system.machines[1].chart == fsmkit.load(CELL / "molder.yaml")
    assert system.replaced == (("feeder", str(defect)),)


def test_a_session(lamp: Path) -> None:
    calls: list[bool] = []
    session = fsmkit.Session(fsmkit.load(lamp), {"light": calls.append})
    assert session.post("press")
    session.run()
    session.advance("2s")
    assert calls == [True, False]
    assert [delivery.event for delivery in session.sent] == ["switched"]


def test_a_class_bound_to_a_chart_beside_it(
    lamp: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = """
import fsmkit

@fsmkit.machine("lamp.yaml")
class Lamp:
    def __init__(self):
        self.lit = False
        self.times = 0
    def light(self, on):
        self.lit = on
    def on_switched(self):
        self.times += 1
"""
    assert lamp.exists()
    monkeypatch.chdir("/")
    names = {"__file__": str(tmp_path / "lamp.py"), "__name__": "lamp"}
    exec(compile(text, "lamp.py", "exec"), names)
    made = names["Lamp"]()  # type: ignore[operator]
    assert made.machine.dispatch("press")
    assert (made.lit, made.times) == (True, 1)
    made.machine.advance("2s")
    assert not made.lit


def test_a_class_bound_to_a_chart_of_the_working_directory(
    lamp: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(lamp.parent)

    @fsmkit.machine("lamp.yaml")
    class Lamp:
        def light(self, on: bool) -> None:
            self.lit = on

    made = Lamp()
    made.machine.dispatch("press")  # type: ignore[attr-defined]
    assert made.lit


def test_a_class_without_the_operations_is_refused(lamp: Path) -> None:
    class Dark:
        pass

    with pytest.raises(fsmkit.FsmkitError, match="nothing performs the operation `light`"):
        fsmkit.machine(lamp)(Dark)
    with pytest.raises(fsmkit.FsmkitError, match="cannot read"):
        fsmkit.machine("nowhere.yaml")
