"""Runs in dense time against runs in discrete time: `recoverable` and `leads_to` by zones."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import closing
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from fsmkit.diagnostics import Findings
from fsmkit.system.properties.property import temporal_properties
from fsmkit.system.system import System
from fsmkit.verify.engines.c.engine import CEngine, Progress
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.properties.dense import temporal_answers
from fsmkit.verify.report.verdict import Result
from fsmkit.verify.resources.deadline import Deadline
from fsmkit.verify.statespace.closed_system import close
from fsmkit.verify.statespace.exploration import End
from tests.verify.random_systems import load_files
from tests.verify.timed_systems import drawn, drawn_system, systems

EXAMPLES = int(os.environ.get("FSMKIT_TIMED_EXAMPLES", "4"))
"""Random systems tried; each takes seconds to compile."""
PARTS = 8
"""The unit of time divided by that: so fine that clocks of four timers can be told apart."""
MOST = 400_000
"""States in discrete time beyond which a system is passed over."""


pytestmark = [pytest.mark.cc, pytest.mark.usefixtures("own_cache", "quickly_compiled")]


ASKED = """
  r0: {recoverable: a.In(s0)}
  r1: {recoverable: a.In(s1) and a.n == 1}
  l0: {leads_to: [a.In(s0), a.In(s1)]}
  l1: {leads_to: [a.In(s1), a.In(s0)]}
  l2: {leads_to: [a.n == 0, a.n == 1]}
  l3: {leads_to: [a.n == 1, a.n == 0 or a.n == 2]}
"""
ASKED_OF_TWO = """
  r2: {recoverable: a.In(s1) and b.In(s1)}
  r3: {recoverable: a.In(s0) and b.In(s0) and a.n == 0}
  l4: {leads_to: [a.In(s1), b.In(s1)]}
  l5: {leads_to: [a.In(s0) and b.In(s0), a.In(s1) and b.In(s0)]}
"""


@st.composite
def asking(draw: st.DrawFn) -> dict[str, str]:
    """Draw a system that is asked for runs; some of its events are fair."""
    files = draw(systems())
    lines = files["system"].splitlines()
    number = next(n for n, line in enumerate(lines) if line.startswith("environment:"))
    may, will = (part.split("]")[0].split(", ") for part in lines[number].split("[")[1:])
    fair = [event for event in may if draw(st.booleans())]
    free = [event for event in may if event not in fair]
    fair += [name for name in will if name]
    lines[number] = f"environment: {{may: [{', '.join(free)}], will: [{', '.join(fair)}]}}"
    asked = ASKED + (ASKED_OF_TWO if "b" in files else "")
    return files | {"system": "\n".join(lines) + asked}


def by_units(system: System) -> dict[str, str]:
    """Return the verdicts in discrete time, with a unit that is fine enough; none of too much."""
    closed = close(system)
    with closing(CEngine(replace(closed, unit=closed.unit // PARTS), Findings())) as engine:
        found = engine.explore(1 << 30, 20, None)
    if found.end is not End.COMPLETE or found.states > MOST:
        return {}
    names = [p.name for p in system.properties]
    numbers = temporal_properties(system.properties)
    assert all(found.answer(n).known for n in numbers)
    return {names[n]: "violated" if found.answer(n).violated else "holds" for n in numbers}


def by_zones(system: System) -> dict[str, Result]:
    """Return what is found in dense time."""
    options = ExplorationOptions("c", memory=1 << 30, timeout=60)
    report = check(system, Findings(), options=options)
    assert report.exploration.end is End.COMPLETE
    return {result.name: result for result in report.results}


def performed(result: Result) -> None:
    """A violation is shown, and runs in the interpreter and in generated C."""
    assert result.trace is not None
    assert result.trace.differs == ""
    assert result.trace.replayed == ("interpreter", "generated C")
    times = [step.at for step in result.trace.steps if step.at is not None]
    assert times == sorted(times)


@pytest.mark.slow
@drawn(EXAMPLES)
@given(files=asking())
def test_verdicts_are_those_of_discrete_time(files: dict[str, str]) -> None:
    system = load_files(files)
    assume(close(system).unit > 0)
    expected = by_units(system)
    assume(expected)
    agree(system, {name: verdict == "violated" for name, verdict in expected.items()})
    found = by_zones(system)
    for name, verdict in expected.items():
        result = found[name]
        if result.verdict.value == "undecided":
            assert "depends on" in result.reason
            continue
        assert result.verdict.value == verdict, name
        if verdict == "violated":
            performed(result)


COVERS = ("simulated", "hull", "points", "subset", "simulated,1", "points,1", "equal,1")
"""Graphs of zones (core/zones/timed_model.h); those with a number explore in part."""
DRAWN = int(os.environ.get("FSMKIT_TIMED_DRAWN", "2"))
"""Larger systems tried: seeds from 1 to 12, and two with delayed events, the fastest first."""
LARGER = [(12, False), (6, True), (5, False), (2, True)]
LARGER += [(seed, False) for seed in (3, 6, 10, 2, 11, 8, 4, 9, 7, 1)]


def by_cover(system: System, cover: str) -> dict[str, bool]:
    """Return the properties that one cover decides, with whether they are violated."""
    names = [p.name for p in system.properties]
    numbers = temporal_properties(system.properties)
    with closing(CEngine(close(system, zones=True), Findings())) as engine:
        command = [str(engine.program), "--memory", str(1 << 30), "--timeout", "60"]
        command += [*engine.temporal_options(numbers), "--cover", cover]
        answers = engine.result(command, None)["temporal"]
    return {
        names[n]: answer["violated"]
        for n, answer in zip(numbers, answers, strict=True)
        if answer["known"]
    }


@pytest.mark.slow
@drawn(EXAMPLES)
@given(files=asking())
def test_no_cover_contradicts_another_one(files: dict[str, str]) -> None:
    system = load_files(files)
    assume(close(system).unit > 0)
    agree(system, by_cover(system, "equal"))


def agree(system: System, expected: dict[str, bool]) -> None:
    """Compare all that each cover decides with verdicts."""
    for cover in COVERS:
        found = by_cover(system, cover)
        assert found == {name: expected.get(name, found[name]) for name in found}, cover


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "delays_events"), LARGER[:DRAWN])
def test_larger_systems_are_decided(seed: int, delays_events: bool) -> None:
    system = load_files(drawn_system(seed, delays_events=delays_events))
    found = by_zones(system)
    verdicts = {n: r.verdict.value for n, r in found.items() if n in ("r0", "r1", "l0", "l1")}
    assert set(verdicts.values()) <= {"holds", "violated"}
    for name, verdict in verdicts.items():
        if verdict == "violated":
            performed(found[name])
    agree(system, {name: verdict == "violated" for name, verdict in verdicts.items()})


# --- by hand ------------------------------------------------------------------------------------

WAITING = """
chart: Waiting
events: {in: [tick, kick]}
initial: all
states:
  all:
    regions:
      watch:
        initial: waiting
        states:
          waiting: {after: {100ms: done}, on: {kick: waiting}}
          done: {rest: true}
      other:
        initial: even
        states:
          even: {rest: true, on: {tick: odd}}
          odd: {rest: true, on: {tick: even}}
"""


def alone(chart: str, environment: str, properties: str, name: str = "m") -> dict[str, str]:
    """Return a system of one machine."""
    return {
        "system": f"system: S\nmachines: {{{name}: {name}.yaml}}\n"
        f"environment: {{{environment}}}\nproperties:\n{properties}",
        name: chart,
    }


DONE = "  l: {leads_to: [m.In(waiting), m.In(done)]}\n"


def test_a_run_that_stops_time_is_none() -> None:
    zeno = by_zones(load_files(alone(WAITING, "may: [m.tick]", DONE)))
    assert zeno["l"].verdict.value == "holds"


def test_a_timer_that_is_armed_again_for_ever_never_fires() -> None:
    kicked = by_zones(load_files(alone(WAITING, "may: [m.tick, m.kick]", DONE)))["l"]
    assert kicked.verdict.value == "violated"
    performed(kicked)
    assert kicked.trace is not None
    assert kicked.trace.loop is not None
    assert "kick" in {step.cause for step in kicked.trace.steps[kicked.trace.loop :]}


@pytest.mark.parametrize(
    ("delay", "verdict"), [("100ms", "holds"), ("50ms..80ms", "holds"), ("50ms..", "violated")]
)
def test_what_has_an_end_must_end(delay: str, verdict: str) -> None:
    chart = WAITING.replace("100ms", delay)
    found = by_zones(load_files(alone(chart, "may: [m.tick], will: [m]", DONE)))["l"]
    assert found.verdict.value == verdict
    if verdict == "violated":
        performed(found)
        assert found.trace is not None
        assert found.trace.loop is None  # it may stay there


RACE = {
    "system": """
system: Race
machines: {fast: fast.yaml, slow: slow.yaml}
connect: [fast.out -> slow.come]
environment: {may: [fast.go]}
properties:
  served: {leads_to: [slow.In(waiting), slow.In(served)]}
  lost: {leads_to: [fast.In(sent), slow.In(lost)]}
  again: {recoverable: slow.In(waiting)}
""",
    "fast": """
chart: Fast
events: {in: [go], out: [out]}
initial: idle
states:
  idle: {after: {90ms: {target: sent, do: send out}}}
  sent: {rest: true, on: {go: idle}}
""",
    "slow": """
chart: Slow
events: {in: [come]}
initial: waiting
states:
  waiting: {on: {come: served}, after: {100ms: lost}}
  served: {on: {come: waiting}}
  lost: {rest: true}
""",
}


def test_what_only_time_makes_sure() -> None:
    """The answer comes before the time limit, unless time does not count."""
    system = load_files(RACE)
    dense = by_zones(system)
    assert dense["served"].verdict.value == "violated"  # the second time it may come late
    performed(dense["served"])
    assert dense["again"].verdict.value == "violated"
    performed(dense["again"])
    once = load_files(RACE | {"system": RACE["system"].replace("may: [fast.go]", "may: []")})
    assert by_zones(once)["served"].verdict.value == "holds"
    report = check(once, Findings(), options=ExplorationOptions("c", time="untimed"))
    assert {r.name: r.verdict.value for r in report.results}["served"] == "violated"


BLINKING = """
chart: Blinking
events: {in: [stop]}
initial: lit
states:
  lit: {after: {100ms: dark}}
  dark: {after: {50ms: lit}, on: {stop: stopped}}
  stopped: {rest: true}
"""


@pytest.mark.parametrize("how", ["may", "will"])
def test_timers_that_fire_for_ever(how: str) -> None:
    """Where it is lit nothing can stop it, so that even what will come may always come too late."""
    asked = "  l: {leads_to: [m.In(lit), m.In(stopped)]}\n  r: {recoverable: m.In(stopped)}\n"
    found = by_zones(load_files(alone(BLINKING, f"{how}: [m.stop]", asked)))
    assert found["r"].verdict.value == "holds"
    assert found["l"].verdict.value == "violated"
    performed(found["l"])
    trace = found["l"].trace
    assert trace is not None
    assert trace.loop is not None
    loop = trace.steps[trace.loop :]
    assert {step.cause for step in loop} == {"timeout in lit", "timeout in dark", "time passes"}
    assert trace.steps[-1].at == 150_000


RACING = """
chart: Racing
events: {in: [a, b], internal: [x, y]}
initial: start
states:
  start: {rest: true, on: {a: {target: one, do: send x after 100ms}}}
  one: {on: {b: {target: two, do: send y after 60ms}, x: start}}
  two: {on: {x: first, y: last}}
  first: {rest: true, on: {y: start}}
  last: {rest: true, on: {x: start}}
"""


def test_what_can_be_reached_from_some_points_only() -> None:
    """Which timer is first is settled when the second one is armed; each order has a way back."""
    found = by_zones(
        load_files(alone(RACING, "may: [m.a, m.b]", "  r: {recoverable: m.In(first)}\n"))
    )
    assert found["r"].verdict.value == "holds"
    stuck = RACING.replace("last: {rest: true, on: {x: start}}", "last: {rest: true}")
    found = by_zones(
        load_files(alone(stuck, "may: [m.a, m.b]", "  r: {recoverable: m.In(first)}\n"))
    )
    assert found["r"].verdict.value == "violated"
    performed(found["r"])
    trace = found["r"].trace
    assert trace is not None
    assert [step.at for step in trace.steps[-1:]] == [60_000]  # `y` is due
    fast = stuck.replace("last: {rest: true}", "last: {on: {x: start}}").replace("{y: start}", "{}")
    found = by_zones(load_files(alone(fast, "may: [m.a, m.b]", "  r: {recoverable: m.In(last)}\n")))
    trace = found["r"].trace
    assert trace is not None
    performed(found["r"])
    assert trace.steps[-1].at == 100_000  # `x` is due, before `y`
    assert next(step.at or 0 for step in trace.steps if step.cause == "b") >= 40_000


ENDLESS = """
chart: Endless
events: {in: [off]}
initial: s
states:
  s: {sometimes: t}
  t: {after: {LEASTms..: u}}
  u: {sometimes: s}
"""


def test_many_timers_without_an_end() -> None:
    """How long they are beyond what they must is forgotten: there are finitely many zones."""
    names = "abc"
    text = (
        f"system: S\nmachines: {{{', '.join(f'{n}: {n}.yaml' for n in names)}}}\n"
        f"environment: {{will: [{', '.join(names)}]}}\nproperties:\n"
        "  r: {recoverable: a.In(u) and b.In(u) and c.In(s)}\n"
        "  l: {leads_to: [a.In(s), a.In(t)]}\n  e: {leads_to: [a.In(t), a.In(u)]}\n"
    )
    charts = {n: ENDLESS.replace("LEAST", str(20 * k)) for k, n in enumerate(names, 1)}
    found = by_zones(load_files({"system": text} | charts))
    assert [found[n].verdict.value for n in "rle"] == ["holds", "holds", "violated"]
    performed(found["e"])


INTERVAL = """
chart: Interval
events: {in: [off]}
initial: tried
states:
  tried: {after: {LEASTms..80ms: caught, 60ms: tried}}
  caught: {after: {10ms: tried}}
"""


def test_a_way_that_waits_for_an_interval() -> None:
    asked = "  r: {recoverable: m.In(caught)}\n"
    early, late = (INTERVAL.replace("LEAST", least) for least in ("50", "70"))
    assert by_zones(load_files(alone(early, "will: [m]", asked)))["r"].verdict.value == "holds"
    assert by_zones(load_files(alone(late, "will: [m]", asked)))["r"].verdict.value == "violated"


IN_STEP = {
    "system": """
system: InStep
machines: {beats: beats.yaml, watches: watches.yaml}
connect: [beats.out -> watches.come]
environment: {will: [beats.kick]}
properties: {l: {leads_to: [watches.In(waiting), watches.In(missed)]}}
""",
    "beats": """
chart: Beats
events: {in: [kick], out: [out]}
initial: s
states:
  s: {after: {100ms: {target: s, do: send out}}, on: {kick: s}}
""",
    "watches": """
chart: Watches
events: {in: [come]}
initial: waiting
states:
  waiting: {on: {come: waiting}, after: {100ms: missed}}
  missed: {rest: true}
""",
}


def test_an_event_that_only_arms_a_timer_again() -> None:
    """At the instant at which it was armed it changes nothing: so both stay in step."""
    system = load_files(IN_STEP)
    assert by_units(system) == {"l": "violated"}
    found = by_zones(system)["l"]
    assert found.verdict.value == "violated"
    performed(found)


def test_what_was_not_explored_is_undecided() -> None:
    system = load_files(alone(WAITING, "may: [m.tick, m.kick]", DONE))
    closed = close(system, zones=True)
    with closing(CEngine(closed, Findings())) as engine:
        whole = engine.explore(1 << 30, 60, None)
        (answer,) = temporal_answers(engine, closed, whole, 1 << 16, None, frozenset())
    assert not answer.known
    assert "memory" in answer.why


def test_the_time_limit_is_for_all_explorations_together(monkeypatch: pytest.MonkeyPatch) -> None:
    system = load_files(alone(WAITING, "may: [m.tick, m.kick]", DONE))
    given: list[float] = []
    ask = CEngine.result

    def asked(self: CEngine, command: list[str], progress: Progress | None) -> Mapping[str, Any]:
        at = command.index("--timeout") if "--timeout" in command else None
        given.append(float(command[at + 1]) if at else 0)
        return ask(self, command, progress)

    monkeypatch.setattr(CEngine, "result", asked)
    closed = close(system, zones=True)
    for seconds in (0, 60):
        deadline = Deadline(seconds)
        with closing(CEngine(closed, Findings(), deadline)) as engine:
            whole = engine.explore(1 << 30, 0, None)
            temporal_answers(engine, closed, whole, 1 << 30, None, frozenset())
    assert given[:2] == [0, 0]
    assert 60 > given[2] > given[3] > 0


def test_no_time_left_for_the_second_exploration_is_undecided() -> None:
    system = load_files(alone(WAITING, "may: [m.tick, m.kick]", DONE))
    closed = close(system, zones=True)
    with closing(CEngine(closed, Findings(), deadline := Deadline(3600))) as engine:
        whole = engine.explore(1 << 30, 0, None)
        deadline.seconds = 1e-9
        (answer,) = temporal_answers(engine, closed, whole, 1 << 30, None, frozenset())
    assert not answer.known
    assert "time limit" in answer.why
