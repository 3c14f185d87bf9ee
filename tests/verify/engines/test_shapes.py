"""Machines that differ in constants share one C file: nothing else of them is different."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings
from fsmkit.system.system import System
from fsmkit.system.system_file import load_system
from fsmkit.verify.engines.c import engine
from fsmkit.verify.engines.c.shapes import Shape, shapes_of
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Verdict
from fsmkit.verify.statespace.closed_system import close
from fsmkit.verify.statespace.exploration import Exploration
from fsmkit.verify.statespace.symbolic_search import Search
from tests.machines.test_philosophers import sized
from tests.verify.random_systems import load_files, random_system

SYSTEM = """
system: Shop
machines:
  "m[i in 0..2]": {chart: clerk.yaml, with: {ME: i, STEP: i % 2 + 1, WAIT: {wait}}}
  other: other.yaml
shared: {turn: 0..5 = 0}
environment: {may: ["m[i].ring"]}
properties:
  P: {reachable: "m[2].total == 2 and m[1].total == 2"}
  Q: {invariant: "turn < 5"}
"""
CLERK = """
chart: Clerk
constants: {ME: 0, STEP: 1, WAIT: 10ms}
events: {in: [ring], out: ["done(who 0..9)"]}
operations: [tell(n 0..9), 'free -> bool']
data: {turn: 0..5 = 0, total: 0..9 = 0}
initial: idle
states:
  idle:
    rest: true
    on: {ring: {if: "turn == ME and free()", target: busy, do: "total = (total + STEP) % 3"}}
  busy:
    entry: "tell(ME + STEP); send done(who = ME)"
    after: {WAIT: {target: idle, do: "turn = (ME + 1) % 3"}}
"""
OTHER = """
chart: Other
initial: idle
data: {turn: 0..5 = 0}
states: {idle: {rest: true}}
"""


def shop(wait: str) -> System:
    files = {"system": SYSTEM.replace("{wait}", wait), "clerk": CLERK, "other": OTHER}
    return load_files(files)


def charts_of(wait: str = "10ms") -> tuple[Chart, ...]:
    return close(shop(wait)).charts


def test_constants_are_inputs_of_the_common_chart() -> None:
    first, second = shapes_of(charts_of())
    assert (first.machines, second.machines) == ((0, 1, 2), (3,))
    assert [data.name for data in first.chart.inputs] == [
        f"constant.{n}" for n in range(len(first.values[0]))
    ]
    by_constant = set(zip(*first.values, strict=True))
    assert by_constant == {(0, 1, 2), (1, 2, 1)}
    assert second.values == ((),)


def test_what_is_not_a_number_in_an_expression_makes_shapes_of_their_own() -> None:
    assert [shape.machines for shape in shapes_of(charts_of("10ms * (i + 1)"))] == [
        (0,),
        (1,),
        (2,),
        (3,),
    ]


def test_many_philosophers_have_one_shape(tmp_path: Path) -> None:
    system = load_system(sized("ordered_table.yaml", 12, tmp_path), Findings())
    (shape,) = shapes_of(close(system).charts)
    assert shape.values[3] == (3, 4)
    assert shape.values[11] == (0, 11)


# --- in C -----------------------------------------------------------------------------------------


def alone(charts: Sequence[Chart]) -> Iterator[Shape]:
    for number, chart in enumerate(charts):
        yield Shape(chart, (number,), ((),))


def explored(system: System, *, untimed: bool) -> Exploration:
    with closing(engine.CEngine(close(system, untimed=untimed), Findings())) as built:
        return replace(built.explore(1 << 28, 0, None), seconds=0, bytes=0)


@pytest.mark.cc
@pytest.mark.usefixtures("own_cache", "quickly_compiled")
@pytest.mark.parametrize("untimed", [True, False])
def test_all_that_is_found_is_as_of_machines_alone(
    untimed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = explored(shop("10ms"), untimed=untimed)
    monkeypatch.setattr(engine, "shapes_of", alone)
    assert found == explored(shop("10ms"), untimed=untimed)


@pytest.mark.cc
@pytest.mark.usefixtures("own_cache", "quickly_compiled")
def test_random_systems_are_as_of_machines_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    found = explored(load_files(random_system(5)), untimed=True)
    monkeypatch.setattr(engine, "shapes_of", alone)
    assert found == explored(load_files(random_system(5)), untimed=True)


@pytest.mark.cc
@pytest.mark.usefixtures("own_cache", "quickly_compiled")
def test_a_deadlock_of_many_is_shown_by_a_way_that_was_replayed(tmp_path: Path) -> None:
    table = load_system(sized("table.yaml", 120, tmp_path), Findings())
    options = ExplorationOptions("c", time="untimed", search=Search.SYMBOLIC)
    report = check(table, Findings(), options=options, properties=frozenset({"D"}))
    (deadlock,) = [one for one in report.results if one.name == "D"]
    assert deadlock.verdict is Verdict.VIOLATED
    assert deadlock.trace is not None
    assert deadlock.trace.replayed == ("interpreter", "generated C")
    assert deadlock.trace.is_longer
    assert len(deadlock.trace.steps) >= 120
