"""The engine in C against the oracle: the same states, steps, marks and nearest witnesses."""

from __future__ import annotations

import re
from dataclasses import replace
from math import prod
from pathlib import Path

import pytest

from devtools.random_charts.charts import random_document
from devtools.random_charts.choices import SeededChoices
from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.any_file import load_any
from fsmkit.system.of_one_chart import system_of
from fsmkit.system.system import System
from fsmkit.verify.explore import ExplorationOptions, check, explore
from fsmkit.verify.report.counterexample import Counterexample
from fsmkit.verify.report.verdict import Report, Verdict, conclude
from fsmkit.verify.statespace.closed_system import close
from fsmkit.verify.statespace.exploration import End, Exploration
from tests.verify.conftest import Load
from tests.verify.random_systems import random_system
from tests.verify.systems import SYSTEMS

CELL = Path(__file__).parents[3] / "machines/production_cell"
MANNERS = [(False, False), (True, False), (True, True)]
MANNER_NAMES = ["discrete", "untimed", "silent"]


pytestmark = [pytest.mark.cc, pytest.mark.usefixtures("own_cache", "quickly_compiled")]


def facts(found: Exploration) -> dict[str, object]:
    """Return what both engines must agree on."""
    return {
        "end": found.end,
        "states": found.states,
        "transitions": found.transitions,
        "depth": found.depth,
        "marks": {mark.number: (mark.count, len(mark.path)) for mark in found.marks},
        "livelock": found.livelock is not None,
        "traps": len(found.traps),
        "covered": [(figures.states, figures.transitions) for figures in found.machines],
        "bounds": [(figures.queue, figures.timers) for figures in found.machines],
    }


def both(system: System, *, untimed: bool = False, silent: bool = False) -> None:
    options = ExplorationOptions(
        "c",
        time="untimed" if untimed else "discrete",
        assume_watchdogs_silent=silent,
        memory=1 << 30,
        timeout=60,
    )
    in_c = explore(system, Findings(), replace(options, reductions=frozenset({"dead"})))
    in_python = explore(system, Findings(), replace(options, engine="python"))
    assert facts(in_c) == facts(in_python)
    assert in_c.end is End.COMPLETE
    sleeping = explore(system, Findings(), options)
    assert facts(replace(sleeping, marks=in_c.marks)) == facts(in_c)  # some marked steps sleep
    ways = ({mark.number: len(mark.path) for mark in found.marks} for found in (in_c, sleeping))
    assert next(ways) == next(ways)


@pytest.mark.slow
@pytest.mark.parametrize(("untimed", "silent"), MANNERS, ids=MANNER_NAMES)
@pytest.mark.parametrize("name", SYSTEMS)
def test_engines_agree_on_systems(load: Load, name: str, untimed: bool, silent: bool) -> None:
    both(load(**SYSTEMS[name]), untimed=untimed, silent=silent)


OPEN = {
    "defers": """
chart: Defers
capacity: {queue: 3}
data: {n: 0..2 = 0}
events: {in: ["job(size 0..2)", done, reset], internal: [more]}
initial: idle
states:
  idle:
    on: {job: {target: busy, do: n = event.size}}
  busy:
    defer: [job]
    on:
      done: {if: n == 0, target: idle}
      reset: {target: idle, do: send more; n = 0}
      more: {do: n = 2}
    after: {20ms: {target: idle, do: send more after 30ms as later}}
    every: {15ms: {if: n > 0, do: n -= 1}}
    exit: cancel later
""",
    "regions": """
chart: Regions
inputs: {level: -3..3, on: bool}
outputs: {sum: -20..20 = 0, last: float64 = 0.5}
data: {seen: "uint8[2] = 0"}
operations: [probe(at 0..3) -> -1..1, tell(x float64)]
events: {in: [tick, stop, go], out: ["told(what -3..3)"]}
initial: work
states:
  work:
    regions:
      one:
        initial: a
        states:
          a:
            on: {tick: {target: b, do: 'seen[0] = 1; send told(what = level)'}}
          b:
            on: {tick: {if: probe(2) > 0, target: a}}
            always: [{if: level > 2 and on, target: a}]
      two:
        initial: c
        states:
          c: {on: {tick: {if: In(b), target: d, do: tell(last); last = 0.75 - last}}}
          d: {after: {40ms: c}, exit: 'seen[1] = 2'}
    on: {stop: halted}
  halted: {on: {go: back}}
  back_to:
    initial: halt2
    states: {halt2: {}, back: {history: deep, default: halt2}}
""",
    "ends": """
chart: Ends
data: {n: 0..3 fault = 0, m: 0..1 = 0}
events: {in: [a, b, c]}
initial: first
states:
  first: {on: {a: {do: n += 1}, b: second, c: {do: m = n}}}
  second: {initial: inner, states: {inner: {on: {a: over}}, over: {final: true}},
           on: {done.state.second: last, c: first}}
  last: {final: true}
""",
    "remembers": """
chart: Remembers
events: {in: [on, back, next, leave, end]}
initial: off
states:
  off: {on: {on: work, back: memory, end: over}}
  work:
    on: {leave: off, end: over}
    regions:
      memory: {history: deep, initial: [one, left]}
      first: {states: {one: {on: {next: two}}, two: {on: {next: {if: In(left), target: one}}}}}
      second: {states: {left: {on: {next: right}}, right: {on: {next: left}}}}
  over: {final: true}
""",
    "chooses": """
chart: Chooses
inputs: {a: bool, temp: -400..1000, b: "bool[3]", level: 0..1, c: bool, d: 0..9}
data: {n: 0..1 = 0}
outputs: {shown: 0..1}
events: {in: [go, "set(to 0..2)"]}
operations: ["ask() -> 0..1"]
initial: off
states:
  off:
    on:
      go: {if: "c ? d > 3 : (temp > 100 and ask() == 1)", target: on, do: n = level}
      set: {if: "b[event.to]", do: shown = n}
  on:
    invariant: not a
    always: [{if: "d == 9 and c and ask() > 0", target: hot}, {if: level < n, target: off}]
  hot: {after: {2s: off}, always: {if: "c and not b[2]", target: off, do: shown = level}}
""",
}  # fmt: skip


@pytest.mark.parametrize("untimed", [False, True], ids=["discrete", "untimed"])
@pytest.mark.parametrize("name", OPEN)
def test_engines_agree_on_open_charts(load: Load, name: str, untimed: bool) -> None:
    both(load(**{name: OPEN[name]}), untimed=untimed)


def random_chart(seed: int) -> Chart | None:
    """Return a random chart that does not take too much from outside to be tried in Python."""
    document = random_document(SeededChoices(f"explorer {seed}"), 6)
    chart = elaborate((document,), Findings())
    if chart is None:
        return None
    closed = close(system_of(chart))
    inputs = prod(len(free.values) for free in closed.free_inputs)
    answers = prod(len(values) for values in closed.results[0].values())
    return chart if (len(closed.possible) + 2) * inputs * answers < 300 else None


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
def test_engines_agree_on_random_charts(seed: int) -> None:
    chart = random_chart(seed)
    if chart is None:
        return  # too many inputs to try all of in Python
    system = system_of(chart)
    for untimed in (False, True):
        memory = 64 << 20  # memory, not time: that a busy machine does not shorten it
        try:
            in_c = explore(
                system,
                Findings(),
                ExplorationOptions("c", time="untimed" if untimed else "discrete", memory=memory),
            )
        except FsmkitError:
            return  # the target says what it cannot express; other tests see to that
        if in_c.end is not End.COMPLETE or in_c.transitions > 600:
            continue
        in_python = explore(
            system,
            Findings(),
            ExplorationOptions("python", time="untimed" if untimed else "discrete"),
        )
        assert facts(in_c) == facts(in_python)


@pytest.mark.parametrize("seed", [1, 5, 19])
def test_engines_agree_on_random_systems(load: Load, seed: int) -> None:
    both(load(**random_system(seed)))


# --- the production cell ----------------------------------------------------------------------


def cell(tmp_path: Path, defect: str = "") -> System:
    """Return the cell, with the feeder of a defect if one is named."""
    text = (CELL / "cell.yaml").read_text(encoding="utf-8")
    for name in ("feeder", "molder", "plant"):
        path = CELL / f"{name}.yaml"
        if name == "feeder" and defect:
            path = CELL / "defects" / f"{defect}_feeder.yaml"
        text = re.sub(rf"{name}: \S*{name}.yaml", f"{name}: {path}", text)
    file = tmp_path / "cell.yaml"
    file.write_text(text, encoding="utf-8")
    return load_any(file, Findings())


def verdict(report: Report, name: str) -> str:
    (result,) = [r for r in report.results if r.name == name]
    if result.trace is not None:
        assert result.trace.replayed == ("interpreter", "generated C"), result.trace.differs
    return result.verdict.value


def test_the_cell_is_safe_and_free_of_deadlock(tmp_path: Path) -> None:
    report = check(cell(tmp_path), Findings(), options=ExplorationOptions("c", time="discrete"))
    assert {verdict(report, name) for name in ("P2", "D", "livelock")} == {"holds"}
    assert report.exploration.states > 10_000


@pytest.mark.slow
def test_defect_m5_is_found_at_the_plant(tmp_path: Path) -> None:
    names = frozenset({"P2"})
    report = check(
        cell(tmp_path, "m5"),
        Findings(),
        options=ExplorationOptions("c", time="discrete"),
        properties=names,
    )
    assert verdict(report, "P2") == "violated"


def test_defect_m2_is_a_deadlock(tmp_path: Path) -> None:
    options = ExplorationOptions("c", time="untimed", assume_watchdogs_silent=True)
    names = frozenset({"D"})
    report = check(cell(tmp_path, "m2"), Findings(), options=options, properties=names)
    assert verdict(report, "D") == "violated"
    assert report.exploration.end is End.DECIDED


def test_nearest_counterexamples_are_as_near_in_both_engines(tmp_path: Path) -> None:
    lengths = []
    for engine in ("c", "python"):
        options = ExplorationOptions(engine, time="untimed", assume_watchdogs_silent=True)
        names = frozenset({"D"})
        report = check(cell(tmp_path, "m2"), Findings(), options=options, properties=names)
        (result,) = [r for r in report.results if r.name == "D"]
        assert result.trace is not None
        lengths.append(len(result.trace.steps))
    assert lengths[0] == lengths[1]


def test_what_was_seen_is_told_though_memory_for_the_way_there_ran_out(load: Load) -> None:
    system = load(**SYSTEMS["livelock"])
    closed = close(system)
    found = explore(
        system, Findings(), ExplorationOptions("c", time="discrete", memory=1 << 30, timeout=60)
    )
    assert found.livelock is not None
    lost = replace(
        found,
        marks=tuple(replace(mark, path=()) for mark in found.marks),
        livelock=((), found.livelock[1]),
    )

    def show(path: tuple[int, ...], cycle: tuple[int, ...]) -> Counterexample:
        raise AssertionError((path, cycle))

    findings = Findings()
    results = conclude(closed, lost, show, frozenset(), findings).results
    violated = [result for result in results if result.verdict is Verdict.VIOLATED]
    assert violated
    for result in violated:
        assert result.trace is None
        assert "memory or time for its path ran out" in result.reason
