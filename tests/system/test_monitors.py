"""Monitors: what they see, what they judge, and that the others do what they do without them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.system.system import System
from fsmkit.verify.engines.c.engine import compiler
from fsmkit.verify.engines.python.oracle import Oracle
from fsmkit.verify.explore import ExplorationOptions, explore
from fsmkit.verify.resources.deadline import Deadline
from fsmkit.verify.resources.time import Time
from fsmkit.verify.statespace.closed_system import close
from tests.verify.conftest import Load, messages
from tests.verify.random_systems import random_system
from tests.verify.results import result

ENGINES = ["python"] + ["c"] * (compiler() is not None)

LAMP = """
chart: Lamp
data: {n: 0..3 = 0}
outputs: {level: 0..2 = 0}
events: {in: [press(hard bool), blow, mend], out: [lit(n 0..3)]}
initial: "off"
states:
  "off":
    rest: true
    entry: level = 0
    on:
      press: {target: warming, do: "level = event.hard ? 2 : 1; n = n < 3 ? n + 1 : n"}
      blow: broken
  warming: {after: {100ms: {target: "on", do: send lit(n = n)}}, on: {press: {MORE}, blow: broken}}
  "on": {on: {press: {MORE}}, entry: level = 0, after: {200ms: "off"}}
  broken: {entry: level = 0, on: {press: {MORE}, mend: "off"}}
""".replace("MORE", 'do: "n = n < 3 ? n + 1 : n"')

ANSWERED = """
chart: Answered
doc: After a hard press the lamp is lit in time, or blows.
constants: {TIME: 150ms}
inputs: {level: 0..2}
events: {in: [press(hard bool), lit, blow]}
initial: idle
states:
  idle: {on: {press: {if: event.hard and level == 2, target: waiting}}}
  waiting: {on: {lit: idle, blow: idle}, after: {TIME: error}}
  error: {}
"""


def room(watch: str, monitor: str = "watch.yaml", more: str = "") -> str:
    return f"""
system: Room
machines: {{lamp: lamp.yaml}}
environment: {{may: [lamp.press, lamp.blow, lamp.mend]}}
properties:
  seen:
    monitor: {monitor}
    watch: [{watch}]
{more}
"""


ALL = "occurs(lamp.press) -> press, lamp.lit -> lit, occurs(lamp.blow) -> blow, lamp.level -> level"


@pytest.mark.cc
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("zones", [False, True], ids=["discrete", "zones"])
def test_a_monitor_counts_time(load: Load, engine: str, zones: bool) -> None:
    for time, verdict in (("150ms", "holds"), ("50ms", "violated")):
        given = f"{{chart: watch.yaml, with: {{TIME: {time}}}}}"
        system = load(room=room(ALL, given), lamp=LAMP, watch=ANSWERED)
        found = result(
            system, "seen", ExplorationOptions(engine, time="zones" if zones else "discrete")
        )
        assert found.verdict.value == verdict
    assert found.trace is not None
    done = [(step.machine, step.after, step.at) for step in found.trace.steps if step.machine]
    assert done == [
        ("seen", ("idle",), 0),
        ("lamp", ("off",), 0),
        ("lamp", ("warming",), 0),
        ("seen", ("waiting",), 0),
        ("seen", ("error",), 50_000),
    ]
    assert found.trace.replayed == ("interpreter", "generated C")[: 1 + (engine == "c")]


@pytest.mark.cc
@pytest.mark.parametrize("engine", ENGINES)
def test_untimed_a_monitor_that_counts_time_violates_nothing(load: Load, engine: str) -> None:
    options = ExplorationOptions(engine, time="untimed")
    system = load(room=room(ALL), lamp=LAMP, watch=ANSWERED)
    found = result(system, "seen", options)
    assert (found.verdict.value, found.reason) == (
        "undecided", "its timeouts come at any time when untimed",
    )  # fmt: skip
    soft = LAMP.replace("events: {in: [press(hard bool)", "events: {in: [other, press(hard bool)")
    unheard = room("occurs(lamp.other) -> lit")
    assert result(load(room=unheard, lamp=soft, watch=ANSWERED), "seen", options).verdict.value == (
        "holds"
    )


COUNTS = """
chart: Counts
doc: Counts presses in its own way; the lamp does so in its data.
inputs: {n: 0..3}
data: {c: 0..3 = 0}
events: {in: [press]}
initial: watching
states:
  watching:
    on: {press: {if: c < 3, target: comparing, do: c += 1}}
  comparing:
    always: [{if: CONDITION, target: error}, {target: watching}]
  error: {}
"""


@pytest.mark.cc
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("untimed", [False, True], ids=["discrete", "untimed"])
def test_a_monitor_sees_each_event_once_and_the_data_after_it(
    load: Load, engine: str, untimed: bool
) -> None:
    watch = "occurs(lamp.press) -> press, lamp.n -> n"
    for condition, verdict in (("c != n", "holds"), ("n == 3", "violated")):
        system = load(room=room(watch), lamp=LAMP, watch=COUNTS.replace("CONDITION", condition))
        assert (
            result(
                system,
                "seen",
                ExplorationOptions(engine, time="untimed" if untimed else "discrete"),
            ).verdict.value
            == verdict
        )


FOLLOWS = """
chart: Follows
inputs: {level: 0..2}
initial: dark
states:
  dark: {always: [{if: level == 2, target: WRONG}, {if: level > 0, target: bright}]}
  bright: {always: {if: level == 0, target: dark}}
  error: {always: {if: level == 3, target: dark}}
"""


@pytest.mark.cc
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("time", ["discrete", "untimed", "zones"])
def test_a_monitor_follows_its_inputs_at_once(load: Load, engine: str, time: Time) -> None:
    options = ExplorationOptions(engine, time=time)
    for wrong, verdict in (("bright", "holds"), ("error", "violated")):
        monitor = FOLLOWS.replace("WRONG", wrong).replace("level == 3", "level > 5 - 3")
        system = load(room=room("lamp.level -> level"), lamp=LAMP, watch=monitor)
        found = result(system, "seen", options)
        assert found.verdict.value == verdict
    assert found.trace is not None
    assert [s.cause for s in found.trace.steps if s.machine][2:] == [
        "press(hard = true)", "inputs changed",
    ]  # fmt: skip


@pytest.mark.cc
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("zones", [False, True], ids=["discrete", "zones"])
def test_the_timer_of_a_monitor_hides_no_deadlock(load: Load, engine: str, zones: bool) -> None:
    ticks = """
chart: Ticks
events: {in: [blow]}
initial: a
states: {a: {after: {100ms: b}}, b: {after: {100ms: a}}, error: {}}
"""
    more = "  dead: deadlock_free"
    text = room("occurs(lamp.blow) -> blow", more=more).replace(", lamp.mend", "")
    mends = text.replace("lamp.blow]", "lamp.blow], will: [lamp.mend]")
    system = load(room=text, lamp=LAMP, watch=ticks)
    options = ExplorationOptions(engine, time="zones" if zones else "discrete")
    assert result(system, "dead", options).verdict.value == "violated"
    assert (
        result(load(room=mends, lamp=LAMP, watch=ticks), "dead", options).verdict.value == "holds"
    )


@pytest.mark.cc
@pytest.mark.parametrize("engine", ENGINES)
def test_a_monitor_that_misses_something_proves_nothing(load: Load, engine: str) -> None:
    small = ANSWERED.replace("events:", "capacity: {queue: 1}\nevents:")
    twice = "occurs(lamp.press) -> press, occurs(lamp.press) -> lit"
    found = result(
        load(room=room(twice), lamp=LAMP, watch=small),
        "seen",
        ExplorationOptions(engine, time="discrete"),
    )
    assert (found.verdict.value, found.reason) == (
        "undecided", "its queue can overflow: it does not see everything",
    )  # fmt: skip


# --- what the others do ---------------------------------------------------------------------------

LISTENER = """
chart: Listener
inputs: {own: 0..2}
data: {odd: bool = false}
events: {in: [x(v 0..2), y]}
initial: even
states:
  even: {on: {x: {if: event.v > 0, target: two}, y: two}, after: {120ms: two}}
  two: {on: {x: even}, always: {if: own == 2, target: even}}
  error: {}
"""
SEEDS = [3, 8, 13, 14, 24, 26]
LISTENS = """
  w:
    monitor: w.yaml
    watch: ["occurs(m[i].in_0) -> x", occurs(one.in_0) -> x, one.out_1 -> y, one.own -> own]
"""


def _shown(system: System, count: int) -> tuple[set[tuple[Snapshot, ...]], set[str]]:
    """Return all that the first machines can be, together, and the marks of the properties."""
    closed = close(system)
    oracle = Oracle(closed)
    found = oracle.run(livelock=False, deadline=Deadline(60))
    named = {p.name for n, p in enumerate(system.properties) if found.mark(1 + n) is not None}
    return {oracle.snapshots(state)[:count] for state in oracle._states}, named


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize("seed", SEEDS)
def test_the_others_do_what_they_do_without_monitors(load: Load, seed: int) -> None:
    files = random_system(seed)
    alone = load(**files)
    files["system"] += LISTENS
    watched = load(**files, w=LISTENER)
    assert len(watched.monitors) == 1
    count = len(alone.machines)
    assert _shown(alone, count) == _shown(watched, count)
    if compiler() is not None:
        sleepless = ExplorationOptions(
            "c", time="discrete", memory=1 << 30, timeout=60, reductions=frozenset({"dead"})
        )
        for untimed in (False, True):
            options = replace(sleepless, time="untimed" if untimed else "discrete")
            in_c = explore(watched, Findings(), options)
            in_python = explore(watched, Findings(), replace(options, engine="python"))
            assert (in_c.states, in_c.transitions) == (in_python.states, in_python.transitions)
            ours, theirs = ({m.number: m.count for m in e.marks} for e in (in_c, in_python))
            assert ours == theirs


@pytest.mark.cc
def test_a_monitor_adds_one_state_for_each_event_it_is_told_of(load: Load) -> None:
    """One that stays as it is: the product with it is the system, and what it has yet to see."""
    deaf = "chart: Deaf\nevents: {in: [lit]}\ninitial: a\nstates: {a: {}, error: {}}\n"
    system = load(room=room("lamp.lit -> lit"), lamp=LAMP, watch=deaf)
    alone = replace(system, monitors=(), properties=())
    options = ExplorationOptions("c")
    without, with_it = (explore(s, Findings(), options) for s in (alone, system))
    told = 3  # numbers of presses with which `lit` can come
    assert with_it.states - without.states == told
    assert with_it.transitions - without.transitions == told


# --- bad input ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("watch", "monitor", "rule"),
    [
        ("occurs(lamp.pres) -> press", ANSWERED, "unknown-name"),
        ("occurs(lump.press) -> press", ANSWERED, "unknown-name"),
        ("lamp.press -> press", ANSWERED, "wrong-direction"),
        ("lamp.lit -> light", ANSWERED, "unknown-name"),
        ("lamp.colour -> lit", ANSWERED, "unknown-name"),
        ("lamp.level -> height", ANSWERED, "unknown-name"),
        ("lamp.lit", ANSWERED, "broken-connection"),
        ("lamp.lit -> press", ANSWERED, "connection-mismatch"),
        ("lamp.lit -> lit, lamp.lit -> lit", ANSWERED, "duplicate-connection"),
        ("lamp.level -> level", ANSWERED.replace("0..2", "0..1").replace("== 2", "== 1"),
         "connection-mismatch"),
        (ALL, ANSWERED.replace("error", "wrong"), "monitor-without-error"),
        (ALL, ANSWERED.replace("events:", 'operations: ["odd() -> bool"]\nevents:'),
         "monitor-that-chooses"),
        (ALL, ANSWERED.replace("TIME: error", "10ms..TIME: error"), "monitor-that-chooses"),
    ],
)  # fmt: skip
def test_a_wrong_monitor_is_told_with_its_place(
    load: Load, watch: str, monitor: str, rule: str
) -> None:
    with pytest.raises(FsmkitError) as error:
        load(room=room(watch), lamp=LAMP, watch=monitor)
    assert rule in [d.rule.name for d in error.value.diagnostics]
    assert all(d.primary is not None for d in error.value.diagnostics)


def test_a_monitor_has_a_name_of_its_own_and_knows_its_keys(load: Load) -> None:
    for text, rule in (
        (room(ALL).replace("  seen:", "  lamp:"), "duplicate-name"),
        (room(ALL).replace("watch: [", "watches: ["), "unknown-key"),
        (room(ALL).replace("monitor: watch.yaml", "monitor: nowhere.yaml"), "unreadable-file"),
        (room(ALL).replace("  seen:\n    monitor: watch.yaml", "  seen: monitor\n  x:"), "missing"),
    ):
        with pytest.raises(FsmkitError) as error:
            load(room=text, lamp=LAMP, watch=ANSWERED)
        assert any(rule in d.rule.name for d in error.value.diagnostics), rule


def test_what_a_monitor_does_not_hear_is_told(load: Load) -> None:
    findings = Findings()
    load(findings, room=room("lamp.lit -> lit"), lamp=LAMP, watch=ANSWERED)
    assert "unconnected-event: nothing sends `press`, `blow` to `seen`: it never comes" in messages(
        findings
    )
