"""Cyclic schedules: order, period, jitter; the same in both engines."""

from __future__ import annotations

import pytest

from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.limits_of_c import report_limits
from fsmkit.verify.engines.c.engine import compiler
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Verdict
from fsmkit.verify.statespace.closed_system import close
from tests.verify.conftest import Load
from tests.verify.engines.test_engines import both
from tests.verify.random_systems import random_loop

ENGINES = ["python", *(["c"] if compiler() is not None else [])]


pytestmark = pytest.mark.usefixtures("own_cache", "quickly_compiled")


TIMER = """
chart: Timer
events: {in: [go], out: [gone]}
initial: idle
states:
  idle: {after: {50ms: {target: busy, do: send gone}}, on: {go: away}}
  busy: {rest: true, on: {go: away}}
  away: {rest: true}
"""

RACE = """
system: Race
machines: {a: timer.yaml, b: timer.yaml}
connect: [a.gone -> b.go, b.gone -> a.go]
SCHEDULE
properties:
  a_is_cut_off: {reachable: a.In(away)}
  b_is_cut_off: {reachable: b.In(away)}
  a_alone: {reachable: a.In(busy) and b.In(idle)}
  b_alone: {reachable: b.In(busy) and a.In(idle)}
"""

LOOP = """
system: Loop
machines: {t: timer.yaml}
schedule: {cyclic: [t], period: 7ms, jitter: 3ms}
environment: {may: [t.go]}
properties:
  bound: {within: [t.In(idle), 60ms, not t.In(idle)]}
  least: {within: [t.In(idle), 59ms, not t.In(idle)]}
  less: {within: [t.In(idle), 58ms, not t.In(idle)]}
"""


def verdicts(
    load: Load, engine: str, files: dict[str, str], *, untimed: bool = False
) -> dict[str, bool]:
    """Return what holds; each path shown was taken again by all that can."""
    report = check(
        load(**files),
        Findings(),
        options=ExplorationOptions(engine, time="untimed" if untimed else "discrete"),
    )
    for result in report.results:
        assert result.verdict is not Verdict.UNDECIDED, result.reason
        if result.trace is not None:
            again = ("interpreter", "generated C") if engine == "c" else ("interpreter",)
            assert result.trace.replayed == again, result.trace.differs
    return {result.name: result.verdict is Verdict.HOLDS for result in report.results}


def race(schedule: str) -> dict[str, str]:
    return {"race": RACE.replace("SCHEDULE", schedule), "timer": TIMER}


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize("engine", ENGINES)
def test_order_decides_a_race(load: Load, engine: str) -> None:
    names = ("a_is_cut_off", "b_is_cut_off", "a_alone", "b_alone")
    for schedule, expected in (
        ("schedule: interleaved", (True, True, True, True)),
        ("schedule: {cyclic: [a, b], period: 20ms}", (False, True, True, False)),
        ("schedule: {cyclic: [b, a], period: 20ms, jitter: 4ms}", (True, False, False, True)),
    ):
        found = verdicts(load, engine, race(schedule))
        assert tuple(found[name] for name in names) == expected, schedule


@pytest.mark.cc
@pytest.mark.parametrize("engine", ENGINES)
def test_untimed_the_order_holds_of_messages(load: Load, engine: str) -> None:
    found = verdicts(load, engine, race("schedule: {cyclic: [a, b], period: 1ms}"), untimed=True)
    assert found["a_is_cut_off"]
    assert found["b_is_cut_off"]


@pytest.mark.cc
@pytest.mark.parametrize("engine", ENGINES)
def test_a_timer_fires_up_to_period_and_jitter_late(load: Load, engine: str) -> None:
    found = verdicts(load, engine, {"loop": LOOP, "timer": TIMER})
    assert found["bound"]
    assert found["least"]  # 50 + 7 + 3, but for a unit: a deadline is reached or it is not
    assert not found["less"]
    assert found["deadlock"]


PLANT = """
chart: Plant
outputs: {shut: bool = true}
initial: closed
states:
  closed: {after: {5ms..: {target: opened, do: shut = false}}}
  opened: {rest: true}
"""

GUARD = """
chart: Guard
inputs: {shut: bool}
initial: off
states:
  off: {rest: true, always: {if: not shut, target: alarm}}
  alarm: {rest: true}
"""

BETWEEN = """
system: Between
machines: {one: guard.yaml, two: guard.yaml, plant: plant.yaml}
connect: [plant.shut -> one.shut, plant.shut -> two.shut]
environment: {will: [plant]}
schedule: {cyclic: [one, two], period: 10ms}
properties:
  one_first: {reachable: one.In(alarm) and two.In(off)}
  two_first: {reachable: two.In(alarm) and one.In(off)}
  T: {within: [plant.In(opened), 10ms, one.In(alarm)]}
  less: {within: [plant.In(opened), 9ms, one.In(alarm)]}
"""


@pytest.mark.cc
@pytest.mark.parametrize("engine", ENGINES)
def test_the_environment_moves_between_machines(load: Load, engine: str) -> None:
    found = verdicts(load, engine, {"between": BETWEEN, "guard": GUARD, "plant": PLANT})
    assert found["one_first"]
    assert found["two_first"]  # the plant opens after the turn of one, before that of two
    assert found["T"]
    assert not found["less"]


ASKED = """
system: Asked
machines: {a: button.yaml, b: button.yaml}
environment: {may: [a.press, b.press]}
schedule: {cyclic: [a, b], period: 10ms}
properties:
  both: {reachable: a.In(on) and b.In(on)}
  D: deadlock_free
"""

BUTTON = """
chart: Button
events: {in: [press]}
initial: "off"
states:
  "off": {rest: true, on: {press: "on"}}
  "on": {on: {press: "on"}}
"""


@pytest.mark.cc
@pytest.mark.parametrize("engine", ENGINES)
def test_time_that_only_the_loop_counts_hides_no_deadlock(load: Load, engine: str) -> None:
    found = verdicts(load, engine, {"asked": ASKED, "button": BUTTON})
    assert found["both"]
    assert not found["D"]


@pytest.mark.cc
@pytest.mark.parametrize("untimed", [False, True], ids=["discrete", "untimed"])
def test_engines_agree_on_the_race(load: Load, untimed: bool) -> None:
    both(load(**race("schedule: {cyclic: [b, a], period: 6ms, jitter: 4ms}")), untimed=untimed)


@pytest.mark.cc
@pytest.mark.parametrize("seed", [1, 4])
def test_engines_agree_on_random_loops(load: Load, seed: int) -> None:
    for untimed in (False, True):
        both(load(**random_loop(seed)), untimed=untimed)


def test_zones_are_refused(load: Load) -> None:
    system = load(**race("schedule: {cyclic: [a, b], period: 20ms}"))
    with pytest.raises(FsmkitError) as refused:
        close(system, zones=True)
    (found,) = refused.value.diagnostics
    assert (found.rule.name, found.help) == (
        "not-explored-yet",
        "use `--time discrete`, or `--time untimed`",
    )


def test_the_loop_is_not_joined_in_c(load: Load) -> None:
    findings = Findings()
    assert not report_limits(load(**race("schedule: {cyclic: [a, b], period: 20ms}")), findings)
    assert [found.rule.name for found in findings] == ["not-joined"]


OWED = """
system: Owed
machines: {a: button.yaml}
environment: {will: [a.press]}
schedule: {cyclic: [a], period: 10ms}
properties:
  L: {leads_to: ["a.In(off)", a.In(on)]}
"""


def test_what_is_owed_in_a_turn_leaves_leads_to_undecided(load: Load) -> None:
    report = check(
        load(fair=OWED, button=BUTTON),
        Findings(),
        options=ExplorationOptions("python", time="discrete"),
    )
    (result,) = [result for result in report.results if result.name == "L"]
    assert result.verdict is Verdict.UNDECIDED
    assert "turn" in result.reason
    assert any("the loop runs a in this order every 10ms" in a for a in report.assumptions)
