"""Systems on which verdicts were wrong, with both engines."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import load_any
from fsmkit.system.system import System
from fsmkit.verify.engines.c.engine import compiler
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Verdict
from tests.verify.conftest import Load
from tests.verify.engines.test_engines import both

FOUND = Path(__file__).parent / "found"
ENGINES = ["python", *(["c"] if compiler() is not None else [])]
HOLDS, VIOLATED = Verdict.HOLDS, Verdict.VIOLATED

pytestmark = pytest.mark.usefixtures("own_cache", "quickly_compiled")


def verdicts(system: System, engine: str, *, untimed: bool) -> dict[str, Verdict]:
    report = check(
        system,
        Findings(),
        options=ExplorationOptions(engine, time="untimed" if untimed else "discrete"),
    )
    return {result.name: result.verdict for result in report.results}


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize("engine", ENGINES)
def test_a_connection_keeps_its_order_untimed(engine: str) -> None:
    system = load_any(FOUND / "queued_delay.yaml", Findings())
    found = verdicts(system, engine, untimed=True)
    assert found["T_ord"] is HOLDS
    assert found["T_3"] is found["T_late"] is HOLDS
    # a turn may end before all is sent, and the connection be slower than its sender
    assert found["T_some"] is found["t.m>r.m.overflow"] is VIOLATED
    timed = verdicts(system, engine, untimed=False)
    assert timed["T_ord"] is timed["T_some"] is HOLDS


@pytest.mark.cc
def test_a_lossy_connection_keeps_its_order(load: Load) -> None:
    files = {name: (FOUND / f"{name}.yaml").read_text() for name in ("queued_delay", "tx", "rx")}
    text = files["queued_delay"].replace("kind: queued", "kind: lossy, loss: 1")
    system = load(**(files | {"queued_delay": text}))
    both(system, untimed=True)
    assert verdicts(system, "python", untimed=True)["T_ord"] is HOLDS


LOSING = """
system: Losing
machines: {source: source.yaml, sink: sink.yaml}
connect: [{source.job -> sink.job: {kind: lossy, loss: LOSS}}]
properties:
  nothing_came: {reachable: source.In(done) and sink.seen == 0}
  all_came: {reachable: source.In(done) and sink.seen == 4}
"""
SOURCE = """
chart: Source
data: {n: 0..4 = 0}
events: {out: [job]}
initial: sending
states:
  sending: {every: {10ms: {if: n < 4, do: n += 1; send job}}, after: {60ms: done}}
  done: {rest: true}
"""
SINK = """
chart: Sink
data: {seen: 0..4 = 0}
events: {in: [job]}
initial: taking
states: {taking: {rest: true, on: {job: {do: seen += 1}}}}
"""


@pytest.mark.cc
@pytest.mark.parametrize(("loss", "verdict"), [("3", VIOLATED), ("4", HOLDS), ("any", HOLDS)])
def test_a_connection_loses_what_it_may(load: Load, loss: str, verdict: Verdict) -> None:
    system = load(losing=LOSING.replace("LOSS", loss), source=SOURCE, sink=SINK)
    both(system, untimed=False)
    found = verdicts(system, "python", untimed=False)
    assert (found["nothing_came"], found["all_came"]) == (verdict, HOLDS)


@pytest.mark.slow
def test_two_connections_overtake_each_other(load: Load) -> None:
    files = {name: (FOUND / f"{name}.yaml").read_text() for name in ("queued_delay", "tx", "rx")}
    text = files["queued_delay"].replace("t: tx.yaml", "t: tx.yaml, u: tx.yaml")
    line = "- t.m -> r.m: {kind: queued, capacity: 2, delay: 15ms}"
    two = f"{line}\n  {line.replace('t.m', 'u.m')}"
    system = load(**(files | {"queued_delay": text.replace(line, two)}))
    assert verdicts(system, "python", untimed=True)["T_ord"] is VIOLATED


@pytest.mark.cc
@pytest.mark.parametrize("engine", ENGINES)
def test_timers_are_owed_between_turns(load: Load, engine: str) -> None:
    files = {name: (FOUND / f"{name}.yaml").read_text() for name in ("cyclic", "loopa", "loopb")}
    files["cyclic"] += "  other: {leads_to: [a.In(s), b.In(u)]}\n"
    found = verdicts(load(**files), engine, untimed=True)
    assert found["T_lead"] is HOLDS
    assert found["any_t"] is found["any_u"] is HOLDS
    assert found["other"] is VIOLATED  # it can stay in `t`


@pytest.mark.cc
@pytest.mark.parametrize("name", ["queued_delay", "cyclic"])
@pytest.mark.parametrize("untimed", [False, True])
def test_engines_agree(name: str, untimed: bool) -> None:
    both(load_any(FOUND / f"{name}.yaml", Findings()), untimed=untimed)


DENSE = {
    "pack/pack.system.yaml": {"back": HOLDS, "key_off_opens": VIOLATED, "drives": HOLDS},
    "changer/changer.yaml": {"home": VIOLATED, "answered": VIOLATED},
}
"""Systems whose temporal properties were undecided in dense time: the zones have many covers."""


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize("name", DENSE)
def test_temporal_properties_are_decided_in_dense_time(name: str) -> None:
    system = load_any(FOUND / name, Findings())
    options, asked = ExplorationOptions("c", time="zones"), frozenset(DENSE[name])
    report = check(system, Findings(), options=options, properties=asked)
    found = {result.name: result for result in report.results}
    assert {p: found[p].verdict for p in DENSE[name]} == DENSE[name]
    for property_, verdict in DENSE[name].items():
        if verdict is VIOLATED:
            trace = found[property_].trace
            assert trace is not None
            assert trace.replayed == ("interpreter", "generated C")
