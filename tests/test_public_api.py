"""The public API: the verbs of the command line as functions."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import fsmkit
from devtools import api_page
from fsmkit.verify.resources.time import Time

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
    heavy = ("lark", "lxml", "yaml", "rich", "click")
    done = subprocess.run(
        [sys.executable, "-c", told % (heavy,)], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == ""


def test_load_and_compile(lamp: Path) -> None:
    chart = fsmkit.read_chart(lamp)
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
    again = fsmkit.check(fsmkit.read_chart(lamp), engine="python")
    assert again.exploration.states == report.exploration.states > 1


@pytest.mark.cc
@pytest.mark.parametrize(("time", "states"), [("discrete", 68), ("zones", 18)])
def test_check_lets_time_pass_as_it_is_told(time: Time, states: int) -> None:
    fischer = CELL.parent / "fischer" / "fischer.yaml"
    report = fsmkit.check(fsmkit.read_system(fischer), engine="c", time=time)
    assert report.exploration.states == states


def test_check_a_system_with_a_machine_replaced() -> None:
    defect = CELL / "defects" / "m5_feeder.yaml"
    system = fsmkit.read_system(CELL / "cell.yaml", replace={"feeder": defect})
    assert system.machines[0].chart == fsmkit.read_chart(defect)
    assert system.machines[1].chart == fsmkit.read_chart(CELL / "molder.yaml")
    assert system.replaced == (("feeder", str(defect)),)


def test_a_session(lamp: Path) -> None:
    calls: list[bool] = []
    session = fsmkit.Session(fsmkit.read_chart(lamp), {"light": calls.append})
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


@pytest.mark.slow
def test_a_file_is_what_it_holds(lamp: Path) -> None:
    assert isinstance(fsmkit.read(lamp), fsmkit.Chart)
    assert isinstance(fsmkit.read(CELL / "cell.yaml"), fsmkit.System)
    deployment = fsmkit.read(CELL / "deployment.yaml")
    assert isinstance(deployment, fsmkit.Deployment)
    assert fsmkit.read_system(CELL / "deployment.yaml") == deployment.written
    with pytest.raises(fsmkit.FsmkitError, match="is a deployment, not a chart"):
        fsmkit.read_chart(CELL / "deployment.yaml")


def test_a_file_is_read_once(lamp: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[Path] = []
    whole = Path.open

    def counted(path: Path, *arguments: Any, **options: Any) -> Any:
        opened.append(path)
        return whole(path, *arguments, **options)

    monkeypatch.setattr(Path, "open", counted)
    fsmkit.read(lamp)
    assert opened == [lamp]


def test_compile_of_systems_and_deployments() -> None:
    cell = fsmkit.compile(CELL / "cell.yaml")
    assert {"feeder.c", "molder.c", "cell.c", "cell.h"} <= set(cell)
    spread = fsmkit.compile(fsmkit.read(CELL / "deployment.yaml"))
    assert {"links.json", "a/feeder.c", "b/rotator.c"} <= set(spread)


@pytest.mark.parametrize("prefix", ["texts", "at", "e", "item_3", "stdio"])
@pytest.mark.parametrize("target", ["c", "pyext"])
def test_a_prefix_that_generated_c_uses_itself_is_refused(
    lamp: Path, prefix: str, target: str
) -> None:
    with pytest.raises(fsmkit.FsmkitError, match="it cannot be a prefix"):
        fsmkit.compile(lamp, target, prefix=prefix)


def test_an_option_of_another_target_is_refused(lamp: Path) -> None:
    with pytest.raises(fsmkit.FsmkitError, match="`python` has no option `optimize`"):
        fsmkit.compile(lamp, "python", optimize="size")
    with pytest.raises(fsmkit.FsmkitError, match="a prefix names one machine"):
        fsmkit.compile(CELL / "cell.yaml", prefix="cell")


@pytest.mark.cc
def test_compile_with_proved_bounds(lamp: Path) -> None:
    header = fsmkit.compile(lamp, bounds="from-check", time="discrete")["lamp.h"]
    assert "Proved to be enough" in header
    whole = fsmkit.compile(CELL / "cell.yaml", bounds="from-check", time="discrete")
    assert "Proved to be enough" in whole["feeder.h"]
    with pytest.raises(fsmkit.FsmkitError, match="proved bounds are for"):
        fsmkit.compile(lamp, "python", bounds="from-check")


def test_export(lamp: Path) -> None:
    written = fsmkit.export(lamp, "aut", time="untimed")
    assert written.text.startswith("des (0,")
    assert written.figures["states"] > 1
    with pytest.raises(fsmkit.FsmkitError, match="nothing is exported"):
        fsmkit.export(CELL / "cell.yaml", "aut", timeout=1e-6)


def test_draw_charts_and_systems(lamp: Path) -> None:
    assert "stateDiagram" in str(fsmkit.draw(lamp, "mmd", active=["lit"]))
    cell = str(fsmkit.draw(CELL / "cell.yaml", "dot"))
    assert "pushed, feeder_clear" in next(each for each in cell.splitlines() if "m0 -> m1" in each)
    ring = str(fsmkit.draw(CELL / "deployment.yaml", "dot"))
    assert ring.count("subgraph cluster_") == 2
    with pytest.raises(fsmkit.FsmkitError, match="has no state `lid`"):
        fsmkit.draw(lamp, "dot", active=["lid"])
    with pytest.raises(fsmkit.FsmkitError, match=r"cannot be drawn as `\.mmd`"):
        fsmkit.draw(CELL / "cell.yaml", "mmd")


def test_wrong_values_of_options_are_findings(lamp: Path) -> None:
    with pytest.raises(fsmkit.FsmkitError, match="no kind of time `dense`"):
        fsmkit.check(lamp, time="dense")  # type: ignore[arg-type]
    with pytest.raises(fsmkit.FsmkitError, match="only where time is untimed"):
        fsmkit.check(lamp, assume_watchdogs_silent=True)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"engine": "rust"}, "no engine `rust`"),
        ({"memory": -5}, "`memory` cannot be -5"),
        ({"memory": 1.5}, r"`memory` cannot be 1\.5"),
        ({"workers": -1}, "`workers` cannot be -1"),
        ({"timeout": float("nan")}, "`timeout` cannot be nan"),
        ({"max_pending": 1 << 32}, "`max_pending` cannot be 4294967296"),
    ],
)
def test_numbers_that_no_search_has(lamp: Path, given: dict[str, Any], says: str) -> None:
    with pytest.raises(fsmkit.FsmkitError, match=says):
        fsmkit.check(lamp, **given)


def test_ranks_are_counted_from_one() -> None:
    with pytest.raises(fsmkit.FsmkitError, match="0 ranks with"):
        fsmkit.Ranks(0)


def test_what_is_no_model_is_a_type_error() -> None:
    for function in (fsmkit.check, fsmkit.compile, fsmkit.draw):
        with pytest.raises(TypeError, match="neither a path nor"):
            function(3)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"fsmkit\.read_chart\(path\)"):
        fsmkit.Session("gate.yaml")  # type: ignore[arg-type]


def test_the_page_of_the_api_is_made_of_docstrings() -> None:
    assert api_page.PAGE.read_text(encoding="utf-8") == api_page.page(), (
        "python -m devtools.api_page"
    )
    functions = {name for name in fsmkit.__all__ if not isinstance(getattr(fsmkit, name), type)}
    assert functions == set(api_page.ORDER)


@pytest.mark.parametrize("name", api_page.ORDER)
def test_a_public_function_says_what_it_takes_returns_and_raises(name: str) -> None:
    function = getattr(fsmkit, name)
    text = inspect.getdoc(function) or ""
    told = re.findall(r"^    \*{0,2}(\w+): ", text[: text.index("Returns:")], re.MULTILINE)
    assert told == list(inspect.signature(function).parameters)
    assert "\nReturns:\n" in text
    assert "\nRaises:\n    FsmkitError: " in text
