"""Dead variables: what may be reset, and that resetting it changes no verdict."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import fsmkit
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.any_file import load_any
from fsmkit.system.system import System
from fsmkit.verify.engines.python.oracle import Oracle
from fsmkit.verify.explore import REDUCTIONS, ExplorationOptions, check, explore
from fsmkit.verify.report.counterexample import explorer_step
from fsmkit.verify.report.verdict import Verdict
from fsmkit.verify.resources.deadline import Deadline
from fsmkit.verify.statespace.closed_system import ClosedSystem, close
from fsmkit.verify.statespace.dead_variables import ResettableVariable
from fsmkit.verify.statespace.exploration import End
from fsmkit.verify.statespace.sessions import active_configuration
from tests.verify.conftest import Load
from tests.verify.random_systems import random_system
from tests.verify.statespace.dead_charts import SYSTEM, random_chart_text

KEEPING = ExplorationOptions(
    "python", time="discrete", reductions=frozenset(REDUCTIONS) - frozenset({"dead"})
)


def where_live(system: System, machine: int = 0) -> dict[str, set[str]]:
    """Return for each variable that is dead somewhere the names of the states where it lives."""
    closed = close(system, untimed=True)
    chart = closed.charts[machine]
    return {
        chart.data[found.data].name: {chart.states[leaf].id for leaf in found.live}
        for found in closed.mortal[machine]
    }


def chart(states: str, data: str = "x: 0..3 = 0", more: str = "") -> str:
    return f"""
chart: Some
data: {{{data}}}
events: {{in: ["set(v 0..3)", go, back]}}
operations: [tell(v 0..3)]
{more}
initial: a
states:
{states}
"""


# --- what the analysis says -----------------------------------------------------------------------

LIVES: dict[str, tuple[str, set[str] | None]] = {
    "read on the way out, written on the way in": (
        """
  a: {on: {set: {target: b, do: x = event.v}}}
  b: {on: {go: {target: a, do: tell(x)}}}
""",
        {"b"},
    ),
    "never read": ("  a: {on: {set: {do: x = event.v}}}", set()),
    "read by itself only": ("  a: {on: {set: {do: 'x = min(x + 1, 3)'}}}", None),
    "kept through a state that does not touch it": (
        """
  a: {on: {set: {target: b, do: x = event.v}}}
  b: {on: {go: c, back: a}}
  c: {on: {go: {if: x == 2, target: a}}}
""",
        {"b", "c"},
    ),
    "written by one branch only": (
        """
  a: {on: {set: {target: b, do: x = event.v}}}
  b: {on: {go: {target: c, do: "if In(a) { x = 0 }"}}}
  c: {on: {go: {target: a, do: tell(x)}}}
""",
        {"b", "c"},
    ),
    "written by both branches": (
        """
  a: {on: {set: {target: b, do: x = event.v}}}
  b: {on: {go: {target: c, do: "if In(a) { x = 0 } else { x = 1 }"}}}
  c: {on: {go: {target: a, do: tell(x)}}}
""",
        {"c"},
    ),
    "written by the exit of what is left": (
        """
  a: {exit: x = 1, on: {go: b}}
  b: {on: {go: {target: a, do: tell(x)}}}
""",
        {"b"},
    ),
    "read by an exit handler": (
        """
  a: {on: {set: {target: b, do: x = event.v}}}
  b: {exit: tell(x), on: {go: a}}
""",
        {"b"},
    ),
    "read by the entry of what a history brings back": (
        """
  a: {on: {set: {do: x = event.v}, go: h}}
  c:
    initial: d
    states:
      d: {on: {go: e}}
      e: {entry: tell(x)}
      h: {history: shallow, default: d}
    on: {back: a}
""",
        None,
    ),
    "read in another region": (
        """
  a:
    regions:
      one: {initial: b, states: {b: {on: {set: {target: c, do: x = event.v}}}, c: {}}}
      two: {initial: d, states: {d: {on: {go: {if: x == 1, target: e}}}, e: {}}}
""",
        {"d"},
    ),
    "read by a guard after a deferral": (
        """
  a: {on: {set: {target: b, do: x = event.v}}}
  b: {defer: [go], on: {back: c}}
  c: {on: {go: {if: x == 1, target: a}}}
""",
        {"b", "c"},
    ),
    "read after a delay": (
        """
  a: {on: {set: {target: b, do: x = event.v}}}
  b: {after: {10ms: {if: x == 1, target: a}}}
""",
        {"b"},
    ),
    "read by the invariant of a state": (
        """
  a: {on: {set: {target: b, do: x = event.v}}}
  b: {invariant: x < 3, on: {go: a}}
""",
        None,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", LIVES)
def test_a_variable_lives_from_write_to_read(load: Load, name: str) -> None:
    states, expected = LIVES[name]
    found = where_live(load(chart=chart(states)))
    assert found == ({} if expected is None else {"x": expected})


def test_an_element_written_does_not_end_the_life_of_its_array(load: Load) -> None:
    states = """
  a: {on: {set: {target: b, do: "x[1] = event.v"}}}
  b: {on: {back: a, go: {if: "x[0] == 1", target: a}}}
"""
    assert where_live(load(chart=chart(states, data='x: "0..3[2] = 0"'))) == {}


def test_a_write_after_what_can_fail_ends_no_life(load: Load) -> None:
    states = """
  a: {on: {set: {target: b, do: "y = 6 / event.v; x = 0"}}}
  b: {on: {go: {target: a, do: tell(x)}}}
"""
    text = chart(states, data="x: 0..3 = 0, y: 0..6 = 0")
    assert where_live(load(chart=text)) == {"y": set()}


def test_saturation_is_no_failure(load: Load) -> None:
    states = """
  a: {on: {set: {target: b, do: "y = event.v; x = 0"}}}
  b: {on: {go: {target: a, do: tell(x)}}}
"""
    text = chart(states, data="x: 0..3 = 0, y: 0..2 = 0")
    assert where_live(load(chart=text)) == {"x": {"b"}, "y": set()}


OBSERVED = """
system: Watched
machines: {one: chart.yaml}
environment: {will: [one.set]}
properties:
  low: {never: one.y == 3}
"""


def test_what_a_property_reads_lives_everywhere(load: Load) -> None:
    states = "  a: {on: {set: {target: b, do: x = event.v; y = event.v}}}\n  b: {on: {back: a}}"
    text = chart(states, data="x: 0..3 = 0, y: 0..3 = 0")
    assert where_live(load(system=OBSERVED, chart=text)) == {"x": set()}


def test_a_step_from_outside_that_only_writes_still_counts(load: Load) -> None:
    states = "  a: {on: {set: {do: x = event.v; y = 0}}}"
    text = chart(states, data="x: 0..3 = 0, y: 0..3 = 0")
    system = load(system=OBSERVED, chart=text)
    assert where_live(system) == {}
    verdicts = [
        [(r.name, r.verdict) for r in check(system, Findings(), options=options).results]
        for options in (ExplorationOptions("python", time="discrete"), KEEPING)
    ]
    assert verdicts[0] == verdicts[1]


# --- what it changes ------------------------------------------------------------------------------


def facts(closed: ClosedSystem, seconds: float) -> tuple[Mapping[str, object], int] | None:
    """Return what no reduction may change, and how many states there were; None if too many."""
    oracle = Oracle(closed)
    found = oracle.run(deadline=Deadline(seconds), traps=closed.is_open)
    if found.end is not End.COMPLETE:
        return None
    return {
        "configurations": {
            tuple(map(active_configuration, oracle.snapshots(s))) for s in oracle.reached
        },
        "marks": [(mark.number, len(mark.path)) for mark in found.marks],
        "livelock": found.livelock is not None,
        "traps": len(found.traps),
        "temporal": [(a.known, a.violated) for a in found.temporal],
        "machines": [
            (f.states, f.transitions, f.queue, f.timers, f.microsteps) for f in found.machines
        ],
    }, found.states


def random_of(seed: int, *, is_open: bool) -> System:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "chart.yaml"
        path.write_text(random_chart_text(seed), encoding="utf-8")
        system = Path(folder) / "system.yaml"
        system.write_text(SYSTEM, encoding="utf-8")
        return load_any(path if is_open else system, Findings())


@pytest.mark.slow
@settings(max_examples=40, derandomize=True, suppress_health_check=list(HealthCheck))
@given(st.integers(0, 100_000), st.booleans(), st.booleans())
def test_random_charts_are_evaluated_alike(seed: int, is_open: bool, untimed: bool) -> None:
    system = random_of(seed, is_open=is_open)
    reduced = facts(close(system, untimed=untimed), 0.5)
    assume(reduced is not None)
    whole = facts(close(system, untimed=untimed, keeps_dead=True), 2)
    assume(whole is not None)
    assert reduced is not None
    assert whole is not None
    assert reduced[0] == whole[0]
    assert reduced[1] <= whole[1]


REDUCED = (12, 14, 22, 23, 29, 32, 40)
"""Charts of the random ones that have fewer states when what is dead is reset."""


def test_resetting_too_much_would_be_noticed() -> None:
    noticed = 0
    for seed in REDUCED:
        closed = close(random_of(seed, is_open=True), untimed=True)
        everything = tuple(
            ResettableVariable(n, frozenset(), d.init.value)
            for n, d in enumerate(closed.charts[0].data)
        )
        whole = facts(replace(closed, mortal=()), 20)
        right = facts(closed, 20)
        wrong = facts(replace(closed, mortal=(everything,)), 20)
        assert whole is not None
        assert right is not None
        assert wrong is not None
        assert right[0] == whole[0]
        assert right[1] < whole[1]
        noticed += wrong[0] != whole[0]
    assert noticed >= 3


@pytest.mark.cc
@pytest.mark.parametrize(
    "without", [frozenset[str](), frozenset({"dead"})], ids=["with", "without"]
)
@pytest.mark.parametrize(("seed", "is_open"), [(22, True), (23, True), (22, False)])
def test_engines_agree(seed: int, is_open: bool, without: frozenset[str]) -> None:
    system = random_of(seed, is_open=is_open)
    found = [
        explore(
            system,
            Findings(),
            ExplorationOptions(
                engine,
                time="untimed",
                memory=1 << 30,
                timeout=20,
                reductions=frozenset(REDUCTIONS) - without,
            ),
        )
        for engine in ("c", "python")
    ]
    assert {f.end for f in found} == {End.COMPLETE}
    one, other = ((f.states, f.transitions, f.depth, len(f.traps)) for f in found)
    assert one == other


@pytest.mark.parametrize("seed", [1, 5])
def test_random_systems_are_evaluated_alike(load: Load, seed: int) -> None:
    system = load(**random_system(seed))
    reduced, whole = (facts(close(system, keeps_dead=keeps), 20) for keeps in (False, True))
    assert reduced is not None
    assert whole is not None
    assert reduced[0] == whole[0]


SHOWN = """
chart: Shown
data: {x: 0..3 = 0}
events: {in: ["set(v 3..3)", go]}
operations: [tell(v 0..3)]
initial: a
states:
  a: {on: {set: {target: b, do: x = event.v}}}
  b: {on: {go: {target: c, do: tell(x)}}}
  c: {invariant: not In(c)}
"""


@pytest.mark.cc
@pytest.mark.parametrize("engine", ["c", "python"])
def test_counterexamples_show_true_values(load: Load, engine: str) -> None:
    system = load(chart=SHOWN)
    assert where_live(system) == {"x": {"b"}}
    report = check(system, Findings(), options=ExplorationOptions(engine, time="discrete"))
    (result,) = [r for r in report.results if r.verdict is Verdict.VIOLATED and r.kind is not None]
    assert result.trace is not None
    assert "d x 3" in explorer_step(system.machines[0].chart, result.trace.steps[-1])
    expected = ("interpreter", "generated C") if engine == "c" else ("interpreter",)
    assert result.trace.replayed == expected, result.trace.differs


def test_the_switch_is_one_of_the_api_too(tmp_path: Path) -> None:
    path = tmp_path / "chart.yaml"
    path.write_text(SHOWN, encoding="utf-8")
    counts = [
        fsmkit.check(path, engine="python", reductions=names).exploration.states
        for names in (("dead", "sleep"), ("sleep",))
    ]
    assert counts[0] <= counts[1]
    with pytest.raises(FsmkitError, match="there is no reduction `order`"):
        fsmkit.check(path, engine="python", reductions=("order",))
