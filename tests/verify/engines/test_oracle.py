"""Known verdicts on small systems, by the oracle."""

from __future__ import annotations

import pytest

from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.schedule import time_unit
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Report, Verdict
from fsmkit.verify.statespace.actions import Action
from tests.verify.conftest import Load
from tests.verify.systems import AXIS, DRIVE, DRIVER, SYSTEMS

PYTHON = ExplorationOptions("python", time="discrete")
UNTIMED = ExplorationOptions("python", time="untimed")


def verdicts(report: Report) -> dict[str, str]:
    return {result.name: result.verdict.value for result in report.results}


def names(report: Report) -> set[str]:
    return {finding.rule.name for finding in report.findings}


def test_livelock(load: Load) -> None:
    report = check(load(**SYSTEMS["livelock"]), Findings(), options=PYTHON)
    assert verdicts(report) == {"deadlock": "holds", "livelock": "violated"}
    (livelock,) = (r for r in report.results if r.name == "livelock")
    assert livelock.trace is not None
    assert [s.cause for s in livelock.trace.steps] == ["start", "start", "go", "ping", "pong"]
    assert livelock.trace.loop == 3


def test_deadlock_and_what_cannot_be_reached(load: Load) -> None:
    report = check(load(**SYSTEMS["deadlock"]), Findings(), options=PYTHON)
    assert verdicts(report) == {"livelock": "holds", "D": "violated", "over": "violated"}


def test_rest_is_no_deadlock(load: Load) -> None:
    files = {n: t.replace("waiting: {on", "waiting: {rest: true, on") for n, t in
             SYSTEMS["deadlock"].items()}  # fmt: skip
    report = check(load(**files), Findings(), options=PYTHON)
    assert verdicts(report)["D"] == "holds"


def test_times_choices_and_properties(load: Load) -> None:
    report = check(load(**SYSTEMS["drive"]), Findings(), options=PYTHON)
    assert verdicts(report) == {
        "livelock": "holds", "tries": "holds", "never_twice": "violated", "done": "holds",
        "D": "holds",
    }  # fmt: skip
    (bad,) = (r for r in report.results if r.name == "never_twice")
    assert bad.trace is not None
    assert bad.trace.steps[-1].at == 800_000
    assert bad.trace.steps[2].chosen == ("careful() = true",)
    assert sum(step.action is Action.ELAPSE for step in bad.trace.steps) == 8


def test_a_quick_axis_is_never_late(load: Load) -> None:
    """The motion takes 300 ms, the watchdog 400 ms: only time tells that it does not fire."""
    files = {
        "drive": DRIVE.replace("careful", "move").replace("never_twice: {never: driver.tries == 2}",
                                                          "late: {never: driver.tries > 0}"),
        "driver": DRIVER.replace("if careful() { move(true) } else { move(false) }", "move(false)")
        .replace("careful() -> bool, ", ""),
        "axis": AXIS.replace("    sometimes: {target: jammed}\n", ""),
    }  # fmt: skip
    assert verdicts(check(load(**files), Findings(), options=PYTHON))["late"] == "holds"
    assert verdicts(check(load(**files), Findings(), options=UNTIMED))["late"] == "violated"
    silent = ExplorationOptions("python", time="untimed", assume_watchdogs_silent=True)
    report = check(load(**files), Findings(), options=silent)
    assert verdicts(report)["late"] == "holds"
    assert any("watchdog" in assumption for assumption in report.assumptions)


def test_names_limit_what_is_evaluated(load: Load) -> None:
    system = load(**SYSTEMS["drive"])
    report = check(system, Findings(), options=PYTHON, properties=frozenset({"tries"}))
    assert "never_twice" not in verdicts(report)
    assert report.verdict is Verdict.HOLDS
    with pytest.raises(FsmkitError, match="no-such-property"):
        check(system, Findings(), options=PYTHON, properties=frozenset({"tires"}))


def test_time_limit_is_undecided(load: Load) -> None:
    options = ExplorationOptions("python", time="discrete", timeout=1e-9)
    report = check(load(**SYSTEMS["drive"]), Findings(), options=options)
    assert report.verdict is Verdict.UNDECIDED
    assert {r.verdict for r in report.results} == {Verdict.UNDECIDED}


def test_an_open_chart_tells_traps_and_dead_parts(load: Load) -> None:
    chart = """
chart: Door
data: {n: 0..3 = 0}
events: {in: [push, pull, lock]}
initial: shut
states:
  shut:
    on:
      pull: open
      lock: locked
      push: {if: n == 3, target: broken}
  open: {on: {push: shut}, after: {2s: shut}}
  locked: {}
  broken: {rest: true}
"""
    report = check(load(door=chart), Findings(), options=PYTHON)
    assert verdicts(report) == {"trap": "violated", "livelock": "holds"}
    assert {"trap", "never-entered", "never-taken"} <= names(report)
    (trap,) = (r for r in report.results if r.name == "trap")
    assert trap.trace is not None
    assert trap.trace.steps[-1].after == ("locked",)
    assert [step.cause for step in trap.trace.steps] == ["start", "lock"]


def test_an_open_chart_takes_every_input_and_payload(load: Load) -> None:
    chart = """
chart: Meter
types: {Level: [low, middle, high]}
inputs: {level: Level, count: 0..4000, ready: bool}
outputs: {seen: Level = low}
events: {in: [measure(at 0..9000)]}
initial: idle
states:
  idle:
    on: {measure: {if: event.at > 700 and count == 17, target: far}}
    always: [{if: ready and level == high, target: high_up}]
  far: {always: [{if: not ready, target: idle}]}
  high_up: {invariant: seen == low, on: {measure: {target: idle, do: seen = level}}}
"""
    report = check(load(meter=chart), Findings(), options=PYTHON)
    assert verdicts(report) == {
        "trap": "holds", "livelock": "holds", "high_up.invariant": "violated",
    }  # fmt: skip
    assert names(report) == {"violated-property"}


def test_a_range_too_large_to_try_is_undecided(load: Load) -> None:
    chart = """
chart: Copy
inputs: {position: 0..40000}
outputs: {copied: 0..40000 = 0}
events: {in: [take]}
initial: here
states: {here: {invariant: copied % 3000 != 1234, on: {take: {do: copied = position}}}}
"""
    report = check(load(copy=chart), Findings(), options=PYTHON)
    assert verdicts(report)["here.invariant"] == "undecided"
    (sampled,) = (f for f in report.findings if f.rule.name == "sampled-values")
    assert sampled.message.endswith("it is computed with")
    assert sampled.primary is not None
    span = sampled.primary.span
    assert span.source.text[span.start : span.end] == "copied"
    assert report.verdict is Verdict.UNDECIDED


@pytest.mark.cc
@pytest.mark.parametrize("engine", ["c", "python"])
def test_every_value_of_a_range_is_tried_where_samples_decide_nothing(
    load: Load, engine: str
) -> None:
    """That of a payload that is computed with later, an input, and a result."""
    chart = """
chart: Level
outputs: {level: 0..60 = 0}
inputs: {position: 0..100}
events: {in: ["set(v 0..50)", tick, look, weigh]}
operations: [weighed() -> 0..80]
initial: a
states:
  a:
    on:
      set: {do: level = event.v}
      tick: {do: level += 1 if level < 60 else 0}
      look: {if: 7 * position == 7 * 83, target: exact}
      weigh: {if: weighed() * 3 == 3 * 77, target: exact}
  exact: {}
"""
    findings = Findings()
    options = ExplorationOptions(engine, time="discrete")
    report = check(load(level=chart), findings, options=options)
    assert verdicts(report) == {"trap": "violated", "livelock": "holds"}
    assert not {"sampled-values", "never-entered"} & {f.rule.name for f in findings}
    holding = chart.replace("target: exact", "target: a").replace("  exact: {}\n", "")
    report = check(load(level=holding), Findings(), options=options)
    assert set(verdicts(report).values()) == {"holds"}


@pytest.mark.parametrize(
    ("content", "rule"),
    [
        ("counted += 1", "reachable-fault"),
        ("raise again", "reachable-fault"),
        ("send again; send again", "queue-overflow"),
    ],
)
def test_faults_and_overflows(load: Load, content: str, rule: str) -> None:
    chart = f"""
chart: Wrong
capacity: {{queue: 2, internal: 2, microsteps: 5}}
data: {{counted: 0..2 fault = 0}}
events: {{in: [go], internal: [again]}}
initial: here
states: {{here: {{on: {{go: {{do: {content}}}, again: {{do: {content}}}}}}}}}
"""
    report = check(load(wrong=chart), Findings(), options=PYTHON)
    assert rule in names(report)
    assert report.verdict is Verdict.VIOLATED


def test_unanswered_events_of_a_system_are_told(load: Load) -> None:
    files = dict(SYSTEMS["drive"])
    report = check(load(**files), Findings(), options=PYTHON)
    told = [f.message for f in report.findings if f.rule.name == "unanswered-event"]
    assert told == [
        "`arrived` can reach `driver` where nothing handles it",
        "`move`, `stop` can reach `axis` where nothing handles it",
    ]


def test_messages_are_lost_delayed_and_wait(load: Load) -> None:
    found = verdicts(check(load(**SYSTEMS["post"]), Findings(), options=PYTHON))
    assert found == {
        "deadlock": "holds", "livelock": "holds", "all": "holds", "one_lost": "holds",
        "last_lost": "holds", "two_lost": "holds", "in_order": "holds",
    }  # fmt: skip
    found = verdicts(check(load(**SYSTEMS["losing"]), Findings(), options=PYTHON))
    assert found["two_lost"] == "violated"
    files = {n: t.replace("capacity: 2", "capacity: 1") for n, t in SYSTEMS["post"].items()}
    report = check(load(**files), Findings(), options=PYTHON)
    assert verdicts(report)["source.job>sink.job.overflow"] == "violated"
    assert "queue-overflow" in names(report)


INTERVAL = """
chart: Late
events: {out: [came]}
initial: waits
states:
  waits: {after: {20ms..50ms: {target: over, do: send came}}}
  over: {rest: true}
"""

WATCH = """
chart: Watch
events: {in: [came]}
initial: waits
states:
  waits: {on: {came: over}, after: {TIME: late}}
  over: {rest: true}
  late: {rest: true, on: {came: {}}}
"""


@pytest.mark.parametrize(
    ("time", "late", "over"),
    [("10ms", "holds", "violated"), ("20ms", "holds", "holds"), ("50ms", "holds", "holds"),
     ("60ms", "violated", "holds")],
)  # fmt: skip
def test_an_interval_ends_somewhere_within(load: Load, time: str, late: str, over: str) -> None:
    text = """
system: S
machines: {late: late.yaml, watch: watch.yaml}
connect: [late.came -> watch.came]
environment: {will: [late]}
properties: {late: {reachable: watch.In(late)}, over: {reachable: watch.In(over)}}
"""
    system = load(system=text, late=INTERVAL, watch=WATCH.replace("TIME", time))
    found = verdicts(check(system, Findings(), options=PYTHON))
    assert (found["late"], found["over"]) == (late, over)
    assert time_unit(system) == 10


PUSHER = """
chart: Pusher
operations: [push(n 0..3)]
states: {s: {sometimes: {do: push(2)}}}
"""
PUSHED = """
chart: Pushed
events: {in: [hit(n 0..3)]}
initial: calm
states:
  calm: {rest: true, on: {hit: {if: event.n == 2, target: moved}}}
  moved: {rest: true}
"""
PUSHES = """
system: Pushes
machines: {pusher: pusher.yaml, pushed: pushed.yaml}
connect: [pusher.push -> pushed.hit]
environment: {will: [pusher]}
properties:
  moves: {reachable: pushed.In(moved)}
"""


def test_operations_of_a_machine_that_moves_spontaneously_reach_others(load: Load) -> None:
    system = load(pushes=PUSHES, pusher=PUSHER, pushed=PUSHED)
    assert verdicts(check(system, Findings(), options=PYTHON))["moves"] == "holds"
