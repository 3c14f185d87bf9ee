"""Refinement: what a derived chart may do and what not; the modules of the Production Cell."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.loading import load_with_findings
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Trigger
from fsmkit.verify.properties.refinement import Refinement, refines
from fsmkit.verify.properties.refinement_report import document
from fsmkit.verify.report.counterexample import leaves

CELL = Path(__file__).parents[3] / "machines/production_cell"

BASE = """
chart: Base
abstract: true
constants: {SPEED: 20}
data: {failed: bool = false}
inputs: {far: bool}
outputs: {lamp: bool = false}
operations: ["move(speed 0..100)", stop()]
events: {in: [go, halt, fault(code 0..2)], out: [done, bad(code 0..2)]}
initial: idle
states:
  idle: {entry: stop(), on: {go: working}}
  working:
    abstract: true
    on: {halt: idle, fault: {target: down, do: send bad(code = event.code)}}
  moving: {entry: move(SPEED), after: {1s: {target: idle, do: send done}}, on: {halt: idle}}
  down: {entry: stop(); lamp = true, on: {go: {if: far, target: moving, do: lamp = false}}}
"""


Compare = Callable[[str, str], Refinement]


@pytest.fixture
def compared(tmp_path: Path) -> Compare:
    """Return what compares a chart, given as what it refines and declares, with the base."""

    def compare(refine: str, more: str) -> Refinement:
        (tmp_path / "base.yaml").write_text(BASE)
        text = f"chart: Derived\nextends: base.yaml\n{more}\nrefine:\n{refine}\n"
        (tmp_path / "derived.yaml").write_text(text)
        derived, base = (
            load_with_findings(tmp_path / f"{name}.yaml", Findings())
            for name in ("derived", "base")
        )
        return refines(derived, base)

    return compare


FILLED = """
  working:
    initial: near
    states:
      near: {entry: move(50), on: {go: away}, after: {100ms: away}}
      away: {exit: stop(), always: {if: far, target: near, do: send done}}
"""

ALLOWED = {
    "an abstract state filled": (FILLED, ""),
    "an event of its own that shows nothing": (
        FILLED + "  idle: {on: {poke: {do: n = 1}}}", "events: {in: [poke]}\ndata: {n: 0..1 = 0}",
    ),
    "what the base does for an event, for another one": (
        FILLED.replace("{go: away}", "{go: away, poke: {do: raise fault(code = 1)}}"),
        "events: {in: [poke]}",
    ),
    "a stronger guard": (
        FILLED + "  down: {on: {go: {override: true, if: super and not failed}}}", "",
    ),
    "operations of its own": (
        FILLED + "  idle: {entry: super; blink(), override: [entry]}", "operations: [blink()]",
    ),
    "leaving the abstract state by itself": (
        FILLED.replace("after: {100ms: away}", "after: {100ms: down}"), "",
    ),
    "leaving it spontaneously": (
        FILLED.replace("after: {100ms: away}", "sometimes: {target: down}"), "",
    ),
    "spontaneously what the base does by a timeout": (
        FILLED + "  moving: {sometimes: {target: idle, do: send done}}", "",
    ),
    "spontaneously what shows nothing": (
        FILLED + "  idle: {sometimes: {do: n = 1}}", "data: {n: 0..1 = 0}",
    ),
}  # fmt: skip

REFUSED = {
    "an operation too many": (FILLED + "  idle: {entry: super; move(1)}", ""),
    "another argument": (FILLED, "constants: {SPEED: 30}"),
    "an event of the base answered otherwise": (
        FILLED.replace("on: {go: away}", "on: {go: away, halt: away}"), "",
    ),
    "an event of the base where it is passed over": (
        FILLED + "  idle: {on: {halt: {do: send done}}}", "",
    ),
    "an event of its own that shows something": (
        FILLED + "  idle: {on: {poke: {do: send done}}}", "events: {in: [poke]}",
    ),
    "spontaneously what the base does for an event": (
        FILLED + "  down: {sometimes: {target: moving, do: lamp = false}}", "",
    ),
    "another output": (FILLED + "  moving: {entry: super; lamp = true}", ""),
    "a weaker guard": (FILLED + "  down: {on: {go: {override: true, if: super or failed or true}}}",
                       ""),
}  # fmt: skip


@pytest.mark.parametrize("name", ALLOWED)
def test_what_a_derived_chart_may_do(compared: Compare, name: str) -> None:
    refine, more = ALLOWED[name]
    found = compared(refine, more)
    assert (found.violated, found.doubt) == (False, "")
    assert found.pairs > 4


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_derived_chart_may_not_do(compared: Compare, name: str) -> None:
    refine, more = REFUSED[name]
    found = compared(refine, more)
    assert found.violated


def test_the_way_to_a_violation_is_shortest(compared: Compare) -> None:
    found = compared(FILLED, "constants: {SPEED: 30}")
    done = [step.done for step in found.path]
    ids = [leaves(found.derived, macrostep.after) for macrostep in done]
    assert ids == [("idle",), ("near",), ("down",), ("moving",)]
    assert [[found.base.states[s].id for s in b.configuration] for b in found.bases] == [
        ["Base", "down"]
    ]


def test_a_chart_refines_itself_and_its_base_does_not_refine_a_stricter_one(
    tmp_path: Path,
) -> None:
    loose = BASE.replace("    abstract: true\n", "").replace("abstract: true\n", "")
    strict = loose.replace("if: far, target: moving", "if: far and failed, target: moving")
    charts = []
    for name, text in (("loose", loose), ("strict", strict)):
        (tmp_path / f"{name}.yaml").write_text(text)
        charts.append(load_with_findings(tmp_path / f"{name}.yaml", Findings()))
    base, guarded = charts
    assert not refines(base, base).violated
    assert not refines(guarded, base).violated
    assert refines(base, guarded).violated


SPONTANEOUS = """
chart: Spontaneous
operations: [op()]
events: {in: [go], out: [done]}
initial: waiting
states:
  waiting: {rest: true, on: {go: busy}}
  busy: {rest: true, sometimes: {target: waiting, do: "op(); send done"}}
"""
IN_TWO_STEPS = SPONTANEOUS.replace(
    'target: waiting, do: "op(); send done"', "target: late, do: op()"
)
IN_TWO_STEPS += "  late: {after: {1s: {target: waiting, do: send done}}}\n"


def test_spontaneous_transitions_of_derived_chart_and_base(tmp_path: Path) -> None:
    """The base may show the same step at once or in several; the report names the transition."""
    charts = []
    for name, text in (("once", SPONTANEOUS), ("twice", IN_TWO_STEPS)):
        (tmp_path / f"{name}.yaml").write_text(text)
        charts.append(load_with_findings(tmp_path / f"{name}.yaml", Findings()))
    once, twice = charts
    assert [refines(*pair).violated for pair in ((once, once), (twice, twice), (once, twice))] == [
        False, False, False,
    ]  # fmt: skip
    trace = document(refines(twice, once))["trace"]
    assert isinstance(trace, list)
    causes = [step["event"] for step in trace]
    assert causes == ["start", "go", "spontaneously leaves busy"]


DONE_LATER = """
  busy: {after: {5s: {target: idle, do: send done}}}
  idle: {on: {go: busy}}
"""
DONE_AT_ONCE = "\n  idle: {on: {go: {target: idle, do: send done}}}"
PAIRS = {
    "an ignored event shows what a timeout of the base can": (
        "busy",
        "\n  busy: {on: {go extra: {target: idle, do: send done}}}\n  idle: {on: {go: busy}}",
        DONE_LATER,
    ),
    "a reaction without delay": ("idle", DONE_AT_ONCE, DONE_LATER),
    "a reaction and the timeout after it": (
        "idle",
        DONE_AT_ONCE.replace("do: send done", 'do: "op(); send done"'),
        DONE_LATER.replace("go: busy", "go: {target: busy, do: op()}"),
    ),
}
"""The initial state, and the states of a derived chart and of its base."""


@pytest.mark.parametrize("name", PAIRS)
def test_the_base_may_take_spontaneous_steps_within_a_step(tmp_path: Path, name: str) -> None:
    charts = []
    initial, *states = PAIRS[name]
    declared = f"operations: [op()]\nevents: {{in: [go, extra], out: [done]}}\ninitial: {initial}"
    for chart, text in zip(("Derived", "Base"), states, strict=True):
        (tmp_path / f"{chart}.yaml").write_text(f"chart: {chart}\n{declared}\nstates: {text}\n")
        charts.append(load_with_findings(tmp_path / f"{chart}.yaml", Findings()))
    derived, base = charts
    assert not refines(derived, base).violated
    assert refines(derived, replace(base, transitions=without_timeouts(base))).violated


def without_timeouts(chart: Chart) -> tuple[Transition, ...]:
    """Return the transitions of a chart, where what a timeout did does nothing."""
    return tuple(
        replace(t, content=()) if t.trigger is Trigger.AFTER else t for t in chart.transitions
    )


def test_without_time_enough_nothing_is_said(compared: Compare) -> None:
    found = compared(FILLED, "")
    again = refines(found.derived, found.base, seconds=1e-9)
    assert not again.violated
    assert again.doubt.startswith("the time limit of 1e-09 s was reached")


def _module(name: str) -> tuple[Chart, Chart]:
    paths = CELL / name, CELL / "module.scxml"
    derived, base = (load_with_findings(path, Findings()) for path in paths)
    return derived, base


@pytest.mark.parametrize(
    ("name", "steps"), [("camera.scxml", 3), ("sorter.yaml", 3), ("belt.yaml", 4)]
)
def test_modules_that_home_in_another_way_are_no_refinements(name: str, steps: int) -> None:
    found = refines(*_module(name))
    assert found.violated
    assert len(found.path) == steps


@pytest.mark.slow
def test_the_feeder_is_compared_with_the_module_as_long_as_there_is_time() -> None:
    found = refines(*_module("feeder.yaml"), seconds=5)
    assert not found.violated
    assert found.doubt  # it takes most of a minute to the end
    assert found.pairs > 50


def test_the_command_line_tells_the_steps(capsys: pytest.CaptureFixture[str]) -> None:
    paths = [str(CELL / name) for name in ("belt.yaml", "module.scxml")]
    assert execute(["refine", paths[0], paths[1]]) == 1
    told = capsys.readouterr().out
    assert "VIOLATED  `Belt` refines `Module`" in told
    assert "4     limit         inventory  is_homed" in told
    assert "`Module`, then in seeking, cannot do the last step" in told
    assert execute(["refine", paths[0], paths[1], "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert document["verdict"] == "violated"
    assert [step["event"] for step in document["trace"]] == [
        "start", "power_ok", "home_permit", "limit",
    ]  # fmt: skip


# a deadline that comes while a file is opened leaves it to the garbage collector
@pytest.mark.filterwarnings("ignore::ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["cell.yaml", "module.scxml"], 1, "not-a-chart"),
        (["belt.yaml", "nowhere.yaml"], 1, "unreadable-file"),
        (["belt.yaml", "module.scxml", "--property", "P"], 2, "No such option"),
        (["feeder.yaml", "module.scxml", "--timeout", "1ms"], 1, "time limit"),
    ],
)
def test_what_cannot_be_compared_is_told(
    arguments: list[str], code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = [str(CELL / a) if a.endswith((".yaml", ".scxml")) else a for a in arguments]
    assert execute(["refine", *paths]) == code
    told = capsys.readouterr()
    assert said in told.out + told.err
