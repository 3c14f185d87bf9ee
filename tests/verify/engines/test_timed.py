"""Dense time by zones against discrete time: the same configurations, verdicts and coverage."""

from __future__ import annotations

import json
import os
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import assume, given

from fsmkit.diagnostics import Findings
from fsmkit.system.system import System
from fsmkit.verify.engines.c.engine import CEngine
from fsmkit.verify.engines.python.oracle import Oracle
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.counterexample import explorer_state
from fsmkit.verify.report.verdict import Verdict
from fsmkit.verify.resources.deadline import Deadline
from fsmkit.verify.separation_times import Limit, separation_times
from fsmkit.verify.statespace.actions import Action
from fsmkit.verify.statespace.closed_system import ClosedSystem, close
from fsmkit.verify.statespace.exploration import End, Exploration
from fsmkit.verify.testgen.save import document
from tests.verify.conftest import Load
from tests.verify.random_systems import load_files
from tests.verify.systems import SYSTEMS
from tests.verify.timed_systems import (
    BETWEEN,
    FOLLOWED,
    HEATER,
    HEATING,
    OVERTAKING,
    SPINS,
    drawn,
    systems,
)

EXAMPLES = int(os.environ.get("FSMKIT_TIMED_EXAMPLES", "6"))
"""Random systems tried; each takes seconds to compile."""
PARTS = 8
"""The unit of time divided by that: so fine that clocks of four timers can be told apart."""


pytestmark = [pytest.mark.cc, pytest.mark.usefixtures("own_cache", "quickly_compiled")]


def by_zones(system: System) -> tuple[Exploration, frozenset[tuple[str, ...]]]:
    with closing(CEngine(close(system, zones=True), Findings())) as engine:
        return engine.explore(1 << 30, 60, None), engine.shown()


def by_units(closed: ClosedSystem) -> tuple[Exploration, frozenset[tuple[str, ...]]]:
    oracle = Oracle(closed)
    found = oracle.run(deadline=Deadline(20))
    shown = {
        tuple(
            line
            for chart, snapshot in zip(closed.charts, oracle.snapshots(state), strict=True)
            for line in explorer_state(chart, snapshot)
        )
        for state in oracle.reached
    }
    return found, frozenset(shown)


def facts(found: Exploration) -> dict[str, object]:
    return {
        "marks": {mark.number for mark in found.marks},
        "livelock": (found.livelock_known, found.livelock is not None),
        "covered": [(figures.states, figures.transitions) for figures in found.machines],
        "bounds": [(f.queue, f.timers, f.microsteps) for f in found.machines],
    }


@pytest.mark.slow
@drawn(EXAMPLES)
@given(files=systems())
def test_zones_reach_what_discrete_time_reaches(files: dict[str, str]) -> None:
    system = load_files(files)
    closed = close(system)
    assume(closed.unit > 0)
    coarse, shown_coarse = by_units(closed)
    assume(coarse.end is End.COMPLETE and coarse.states < 300)
    fine, shown_fine = by_units(replace(closed, unit=closed.unit // PARTS))
    assume(fine.end is End.COMPLETE)
    zones, shown = by_zones(system)
    assert zones.end is End.COMPLETE
    assert shown_coarse <= shown
    assert shown == shown_fine
    assert facts(zones) == facts(fine)


@drawn(EXAMPLES)
@given(files=systems())
def test_paths_are_performed_alike(files: dict[str, str]) -> None:
    """Each witness runs in the interpreter at the instants computed, and in generated C."""
    system = load_files(files)
    assume(close(system).unit > 0)
    report = check(system, Findings(), options=ExplorationOptions("c", memory=1 << 30, timeout=60))
    assert report.exploration.end is End.COMPLETE
    for result in report.results:
        if result.trace is not None:
            assert result.trace.differs == ""
            assert result.trace.replayed == ("interpreter", "generated C")
            times = [step.at for step in result.trace.steps if step.at is not None]
            assert times == sorted(times)


def verdicts(system: System, *, zones: bool) -> dict[str, str]:
    options = ExplorationOptions(
        "c", time="zones" if zones else "discrete", memory=1 << 30, timeout=60
    )
    report = check(system, Findings(), options=options)
    assert report.exploration.end is End.COMPLETE
    return {result.name: result.verdict.value for result in report.results}


@pytest.mark.parametrize("name", SYSTEMS)
def test_verdicts_are_those_of_discrete_time(load: Load, name: str) -> None:
    system = load(**SYSTEMS[name])
    assert verdicts(system, zones=True) == verdicts(system, zones=False)


@pytest.mark.parametrize("text", [FOLLOWED, SPINS], ids=["followed", "spins"])
def test_one_chart_alone_is_evaluated_as_in_discrete_time(load: Load, text: str) -> None:
    system = load(chart=text)
    assert verdicts(system, zones=True) == verdicts(system, zones=False)


def test_a_cycle_of_timers_that_take_no_time_is_a_livelock(load: Load) -> None:
    report = check(load(spins=SPINS), Findings(), options=ExplorationOptions("c"))
    (found,) = [r for r in report.results if r.name == "livelock"]
    assert found.verdict is Verdict.VIOLATED
    assert found.trace is not None
    assert found.trace.replayed == ("interpreter", "generated C")
    assert found.trace.loop is not None
    assert {step.at for step in found.trace.steps[found.trace.loop :]} == {0}


def test_intervals_are_reached_as_in_discrete_time(load: Load) -> None:
    system = load(heating=HEATING, heater=HEATER)
    closed = close(system)
    assert closed.unit == 10
    zones, shown = by_zones(system)
    units, shown_by_units = by_units(closed)
    assert shown == shown_by_units
    assert facts(zones) == facts(units)
    assert zones.states == 4


def test_what_happens_only_between_ticks_is_found_and_performed(load: Load) -> None:
    system = load(overtaking=OVERTAKING, between=BETWEEN)
    assert verdicts(system, zones=False)["both"] == "violated"
    report = check(system, Findings(), options=ExplorationOptions("c"))
    (found,) = [r for r in report.results if r.name == "both"]
    assert found.verdict is Verdict.HOLDS
    assert found.trace is not None
    assert found.trace.replayed == ("interpreter", "generated C"), found.trace.differs
    (a, b) = (step.at for step in found.trace.steps if step.action is Action.OCCUR)
    assert a is not None
    assert b is not None
    assert 0 < b - a < 40_000
    recorded = document(report.closed, found, found.trace, Path(__file__))
    trail = json.loads(json.dumps(recorded["trail"]))
    assert any("/" in ticks for ((*_, ticks),) in trail[1:])


def test_the_time_between_two_configurations(load: Load) -> None:
    system = load(heating=HEATING, heater=HEATER)
    heated = separation_times(system, "heater.In(warming)", "heater.In(on)")
    assert heated.least == Limit(150, reached=True)
    assert (heated.greatest, heated.pending) == (None, None)  # it may be cut off for long
    left = separation_times(system, "heater.In(warming)", "heater.In(on) or heater.In(off)")
    assert (left.least, left.greatest) == (Limit(0, reached=True), Limit(180, reached=True))
    nearly = separation_times(system, "heater.In(nearly)", "heater.In(on)")
    assert (nearly.least, nearly.greatest, nearly.pending) == (
        Limit(50, reached=True), Limit(80, reached=True), Limit(80, reached=True),
    )  # fmt: skip
    assert nearly.is_within(80)
    assert not nearly.is_within(79)
    at_once = separation_times(system, "heater.In(on)", "not heater.In(off)")
    assert (at_once.least, at_once.greatest) == (Limit(0, reached=True), Limit(0, reached=True))
    never = separation_times(system, "heater.In(on) and heater.In(off)", "heater.In(on)")
    assert (never.least, never.greatest, never.pending) == (None, None, Limit(0, reached=True))
    short = separation_times(system, "heater.In(warming)", "heater.In(on)", most=100)
    assert (short.least, short.greatest, short.most) == (None, None, 100)
