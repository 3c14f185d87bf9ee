"""Temporal properties: known verdicts, both engines alike, and runs that are what they claim."""

from __future__ import annotations

from contextlib import closing

import pytest

from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.properties.kinds import leads_to
from fsmkit.system.properties.property import temporal_properties
from fsmkit.system.system import System
from fsmkit.verify.engines.c.engine import CEngine, compiler
from fsmkit.verify.engines.python.oracle import explore_in_python
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.statespace.closed_system import close
from fsmkit.verify.statespace.symbolic_search import OF_SETS, Search
from tests.verify.conftest import Load, messages
from tests.verify.random_systems import random_system
from tests.verify.results import result
from tests.verify.runs import FairRun
from tests.verify.systems import SYSTEMS

ENGINES = ["python"] + ["c"] * (compiler() is not None)
MANNERS = [
    *(
        ExplorationOptions(engine, time="untimed" if untimed else "discrete")
        for engine in ENGINES
        for untimed in (False, True)
    ),
    *[ExplorationOptions("c")] * ("c" in ENGINES),
    *[ExplorationOptions("c", time="untimed", search=Search.SYMBOLIC)] * ("c" in ENGINES),
    *[ExplorationOptions("c", time="discrete", search=Search.SYMBOLIC)] * ("c" in ENGINES),
]


def spelled(options: ExplorationOptions) -> str:
    diagram = "-diagram" if options.search is Search.SYMBOLIC else ""
    return f"{options.engine}-{options.time}{diagram}"


LAMP = """
chart: Lamp
data: {n: 0..3 = 0}
events: {in: [press, blow, mend]}
initial: "off"
states:
  "off": {rest: true, on: {press: warming, blow: broken}}
  warming: {after: {100ms: {target: "on", do: 'n = n < 3 ? n + 1 : 3'}}, on: {blow: broken}}
  "on": {after: {300ms: "off"}, on: {press: "off"}}
  broken: {rest: true, on: {mend: {if: n < 3, target: "off"}}}
"""


def lamp(may: str, will: str, properties: str) -> dict[str, str]:
    return {
        "room": f"""
system: Room
machines: {{lamp: lamp.yaml}}
environment: {{may: [{may}], will: [{will}]}}
properties:
{properties}
""",
        "lamp": LAMP,
    }


@pytest.mark.cc
@pytest.mark.parametrize("options", MANNERS, ids=spelled)
def test_what_can_be_reached_again_from_everywhere(load: Load, options: ExplorationOptions) -> None:
    properties = """
  off: {recoverable: lamp.In(off)}
  broken: {recoverable: lamp.In(broken)}
  fresh: {recoverable: lamp.n == 0}
"""
    mended = load(**lamp("lamp.press, lamp.blow, lamp.mend", "", properties))
    broken = result(mended, "off", options)
    assert broken.verdict.value == "violated"
    assert broken.trace is not None
    assert broken.trace.steps[-1].after == ("broken",)
    assert broken.trace.loop is None
    assert "never" in broken.reason
    assert result(mended, "broken", options).verdict.value == "holds"
    used = result(mended, "fresh", options)
    assert used.trace is not None
    assert used.trace.steps[-1].after == ("on",)
    whole = load(**lamp("lamp.press", "", properties))
    assert result(whole, "off", options).verdict.value == "holds"
    lost = result(whole, "broken", options)
    assert lost.trace is not None
    assert len(lost.trace.steps) == 1  # from the start on it never holds


LEADS = """
  lit: {leads_to: [lamp.In(warming), lamp.In(on)]}
  dark: {leads_to: [lamp.In(on), lamp.In(off)]}
  used: {leads_to: [lamp.In(off), lamp.In(on)]}
  worn: {leads_to: [lamp.In(on), lamp.n == 3]}
  at_once: {leads_to: [lamp.In(on), lamp.n > 0]}
"""


@pytest.mark.cc
@pytest.mark.parametrize("options", MANNERS, ids=spelled)
@pytest.mark.parametrize(
    ("may", "will", "expected"),
    [
        ("lamp.press", "", "holds holds violated violated holds"),
        ("", "lamp.press", "holds holds holds holds holds"),
        ("lamp.press, lamp.blow", "", "violated holds violated violated holds"),
        ("lamp.blow, lamp.mend", "lamp.press", "violated holds violated violated holds"),
    ],
)
def test_what_leads_to_what(
    load: Load, options: ExplorationOptions, may: str, will: str, expected: str
) -> None:
    report = check(load(**lamp(may, will, LEADS)), Findings(), options=options)
    names = ["lit", "dark", "used", "worn", "at_once"]
    found = {r.name: r.verdict.value for r in report.results}
    assert " ".join(found[name] for name in names) == expected
    assert not any(r.trace.differs for r in report.results if r.trace is not None)


@pytest.mark.cc
@pytest.mark.parametrize("engine", ENGINES)
def test_a_run_that_goes_round_for_ever(load: Load, engine: str) -> None:
    system = load(**lamp("lamp.press", "", "  worn: {leads_to: [lamp.n == 1, lamp.In(broken)]}"))
    found = result(system, "worn", ExplorationOptions(engine, time="discrete"))
    assert found.trace is not None
    assert found.trace.loop is None  # it may stay off
    fair = load(**lamp("", "lamp.press", "  worn: {leads_to: [lamp.n == 1, lamp.In(broken)]}"))
    found = result(fair, "worn", ExplorationOptions(engine, time="discrete"))
    assert found.trace is not None
    assert found.trace.loop is not None
    assert {"press", "timeout in warming"} <= {
        s.cause for s in found.trace.steps[found.trace.loop :]
    }


OCCURS = """
  pressed: {reachable: occurs(lamp.press) and lamp.In(warming)}
  off: {never: occurs(lamp.press) and lamp.In(off)}
  only_press: {invariant: "not lamp.In(warming) or lamp.n == 3 or occurs(lamp.press)"}
  mended: {reachable: occurs(lamp.mend) and lamp.In(broken)}
  not_on: {never: occurs(lamp.blow) and not lamp.In(broken)}
  start: {invariant: occurs(lamp.press) or lamp.n < 4}
"""


@pytest.mark.cc
@pytest.mark.parametrize("engine", ENGINES)
def test_events_that_occur(load: Load, engine: str) -> None:
    system = load(**lamp("lamp.press, lamp.mend, lamp.blow", "", OCCURS))
    report = check(system, Findings(), options=ExplorationOptions(engine, time="discrete"))
    found = {r.name: r for r in report.results}
    assert {name: found[name].verdict.value for name in found if name[0] != "d"} == {
        "livelock": "holds",
        "pressed": "holds",
        "off": "violated",  # from on
        "only_press": "violated",  # time passes in warming
        "mended": "holds",  # taken, and nothing answers
        "not_on": "violated",  # where nothing handles it
        "start": "holds",
    }
    lengths = {n: len(r.trace.steps) for n, r in found.items() if r.trace is not None}
    assert lengths["pressed"] == 2
    assert lengths["only_press"] == 3


@pytest.mark.cc
def test_zones_do_not_evaluate_what_occurs(load: Load) -> None:
    system = load(**lamp("lamp.press", "", "  off: {never: occurs(lamp.press) and lamp.In(off)}"))
    assert result(system, "off", ExplorationOptions("c")).verdict.value == "undecided"


WITHIN = """
  lit: {within: [lamp.In(warming), 100ms, not lamp.In(warming)]}
  soon: {within: [lamp.In(warming), 99ms, not lamp.In(warming)]}
  again: {within: [lamp.In(warming), 400ms, lamp.In(off)]}
  early: {within: [lamp.In(warming), 399ms, lamp.In(off)]}
  fixed: {within: [lamp.In(on), 1s, lamp.In(broken)]}
  never: {within: [lamp.In(broken), 1s, lamp.In(on)]}
"""


@pytest.mark.cc
@pytest.mark.parametrize(("engine", "zones"), [*((e, False) for e in ENGINES), ("c", True)])
def test_how_long_it_takes(load: Load, engine: str, zones: bool) -> None:
    system = load(**lamp("lamp.press", "", WITHIN))
    report = check(
        system,
        Findings(),
        options=ExplorationOptions(engine, time="zones" if zones else "discrete"),
    )
    found = {r.name: r for r in report.results}
    told = {n: (found[n].verdict.value, found[n].reason) for n in WITHIN_NAMES}
    assert told == {
        "lit": ("holds", "it takes at most 100ms"),
        "soon": ("violated", "it takes at most 100ms"),
        "again": ("holds", "it takes at most 400ms"),
        "early": ("violated", "it takes at most 400ms"),
        "fixed": ("violated", "there is no bound"),
        "never": ("holds", "it takes at most 0ms" if zones else ""),
    }
    if zones:
        return
    for name in ("soon", "early", "fixed"):
        trace = found[name].trace
        assert trace is not None
        assert not trace.differs
    assert found["early"].trace is not None
    assert found["early"].trace.steps[-1].at == 400_000


WITHIN_NAMES = ["lit", "soon", "again", "early", "fixed", "never"]


@pytest.mark.cc
@pytest.mark.parametrize("engine", ENGINES)
def test_a_livelock_answers_nothing_where_there_is_no_time(load: Load, engine: str) -> None:
    files = dict(SYSTEMS["livelock"])
    files["rally"] += "properties: {back: {leads_to: [ping.In(busy), ping.In(idle)]}}\n"
    found = result(load(**files), "back", ExplorationOptions(engine, time="discrete"))
    assert found.trace is not None
    assert [s.cause for s in found.trace.steps[found.trace.loop or 0 :]] in (
        ["ping", "pong"], ["pong", "ping"],
    )  # fmt: skip


def test_what_was_not_explored_is_undecided(load: Load) -> None:
    options = ExplorationOptions("python", time="discrete", timeout=1e-9)
    assert (
        result(load(**lamp("lamp.press", "", LEADS)), "dark", options).verdict.value == "undecided"
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{leads_to: lamp.In(on)}", "unexpected-shape: `x` needs two conditions"),
        ("{leads_to: [lamp.In(on), lamp.In(oof)]}", "unknown-name: `lamp` has no state `oof`"),
        ("{recoverable: lamp.m}", "unknown-name: `lamp` has no variable `m`"),
        (
            "{recoverable: occurs(lamp.press)}",
            "unexpected-value: `recoverable` is about states, `occurs` in `x` about a step",
        ),
        ("{never: occurs(lamp.pres)}", "unknown-name: `lamp` has no event `pres`"),
        ("recoverable", "missing-condition: `recoverable` needs a condition"),
    ],
)
def test_what_is_wrong_is_told(load: Load, text: str, message: str) -> None:
    findings = Findings()
    with pytest.raises(FsmkitError):
        load(findings, **lamp("lamp.press", "", f"  x: {text}"))
    assert message in messages(findings)


# --- both engines -----------------------------------------------------------------------------

ASKED = """
  r1: {recoverable: one.In(s0)}
  r2: {recoverable: a == 2 and one.In(s1)}
  l1: {leads_to: [one.In(s0), one.In(s1)]}
  l2: {leads_to: ["m[0].In(s1)", "m[0].In(s2) or a == 1"]}
  l3: {leads_to: [a == 1, a != 1]}
  l4: {leads_to: [one.In(s2), "b[0] or b[1]"]}
  w1: {within: [one.In(s0), 30ms, one.In(s1) or one.In(s2)]}
  w2: {within: ["m[0].In(s1)", 20ms, "not m[0].In(s1)"]}
  w3: {within: [a == 1, 50ms, a != 1]}
  o1: {never: occurs(one.in_1) and one.In(s1)}
  o2: {reachable: "occurs(m[0].in_0) and not occurs(one.in_1) and a == 2"}
  o3: {invariant: "occurs(m[0].in_0) or occurs(m[0].in_1) or m[0].own == 0"}
  l5: {leads_to: [a == 0, one.In(s2) or a == 2]}
"""


def asking(seed: int) -> dict[str, str]:
    files = random_system(seed)
    return files | {"system": files["system"] + ASKED}


@pytest.mark.cc
@pytest.mark.parametrize(("seed", "untimed"), [(1, False), (1, True), (4, True)])
def test_engines_agree_and_their_runs_are_fair(load: Load, seed: int, untimed: bool) -> None:
    compare(load(**asking(seed)), untimed=untimed)


@pytest.mark.cc
def test_engines_agree_on_livelocks(load: Load) -> None:
    files = dict(SYSTEMS["livelock"])
    files["rally"] += "properties: {back: {leads_to: [ping.In(busy), ping.In(idle)]}}\n"
    compare(load(**files), untimed=False)


def compare(system: System, *, untimed: bool) -> None:
    closed = close(system, untimed=untimed)
    in_python, trail_of = explore_in_python(closed)
    numbers = temporal_properties(system.properties, untimed=untimed)
    with closing(CEngine(closed, Findings())) as engine:
        in_c = engine.explore(1 << 30, 60, None)
        assert [(m.number, m.count, len(m.path)) for m in in_c.marks] == [
            (m.number, m.count, len(m.path)) for m in in_python.marks
        ]
        assert [a.property for a in in_c.temporal] == list(numbers)
        assert [(a.known, a.violated, a.greatest) for a in in_c.temporal] == [
            (a.known, a.violated, a.greatest) for a in in_python.temporal
        ]
        for number, ours, theirs in zip(numbers, in_c.temporal, in_python.temporal, strict=True):
            assert (len(ours.path) > 0) == ours.violated
            if system.properties[number].kind is not leads_to.KIND:
                assert len(ours.path) == len(theirs.path)
            elif ours.violated:
                FairRun(closed, ours, engine.trail(ours.path + ours.cycle)).check()
                FairRun(closed, theirs, trail_of(theirs.path + theirs.cycle)).check()
        diagram = engine.explore(1 << 30, 60, None, search=Search.SYMBOLIC)
        for number, ours, theirs in zip(numbers, in_c.temporal, diagram.temporal, strict=True):
            procedure = getattr(system.properties[number].kind.decided, "procedure", "")
            assert theirs.known == (procedure in OF_SETS)
            if theirs.known:
                assert theirs.violated == ours.violated
            if procedure == "leads-to" and ours.violated:
                FairRun(closed, theirs, engine.trail(theirs.path + theirs.cycle)).check()
