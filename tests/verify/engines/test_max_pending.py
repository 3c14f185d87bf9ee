"""External events wait while more events are queued than `max_pending` allows."""

from __future__ import annotations

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.document import document
from fsmkit.verify.report.verdict import Report, Verdict
from fsmkit.verify.statespace.closed_system import UNLIMITED
from fsmkit.verify.statespace.symbolic_search import Search
from tests.verify.conftest import Load

pytestmark = [pytest.mark.usefixtures("own_cache", "quickly_compiled"), pytest.mark.cc]

SYSTEM = """
system: Presses
machines: {button: button.yaml, lamp: lamp.yaml}
connect: [button.on -> lamp.on, button.off -> lamp.off]
environment: {may: [button.press]}
properties: {P: {never: lamp.In(wrong)}}
"""
BUTTON = """
chart: Button
events: {in: [press], out: [on, off]}
initial: up
states:
  up: {rest: true, on: {press: {target: down, do: send on}}}
  down: {rest: true, on: {press: {target: up, do: send off}}}
"""
LAMP = """
chart: Lamp
capacity: {queue: 3}
events: {in: [on, off]}
initial: dark
states:
  dark: {rest: true, on: {on: lit, off: wrong}}
  lit: {rest: true, on: {off: dark, on: wrong}}
  wrong: {rest: true}
"""


def presses(load: Load, options: ExplorationOptions, button: str = BUTTON) -> Report:
    system = load(system=SYSTEM, button=button, lamp=LAMP)
    return check(system, Findings(), options=options)


def told(report: Report) -> list[str]:
    return [str(f.message) for f in report.findings if f.rule.name == "queue-overflow"]


@pytest.mark.parametrize(("max_pending", "states"), [(0, 4), (1, 6), (2, 8), (3, None)])
def test_engines_agree(load: Load, max_pending: int, states: int | None) -> None:
    found = [
        presses(
            load, ExplorationOptions(engine, time="untimed", search=search, max_pending=max_pending)
        )
        for engine, search in (
            ("python", Search.AUTO),
            ("c", Search.EXPLICIT),
            ("c", Search.SYMBOLIC),
        )
    ]
    figures = {(r.exploration.states, r.exploration.transitions) for r in found}
    assert len(figures) == 1
    assert states is None or next(iter(figures))[0] == states
    assert {document(r)["max_pending"] for r in found} == {max_pending}
    assert {r.verdict for r in found} == {Verdict.HOLDS if max_pending < 3 else Verdict.UNDECIDED}


@pytest.mark.parametrize("engine", ["python", "c"])
def test_loss_is_told_once_and_decides_nothing(load: Load, engine: str) -> None:
    report = presses(load, ExplorationOptions(engine, max_pending=UNLIMITED))
    (result,) = (r for r in report.results if r.name == "P")
    assert (result.verdict, result.trace is not None) == (Verdict.UNDECIDED, True)
    assert "loses" in result.reason
    assert told(report) == ["events to `lamp` are lost if more than 3 arrive at once"]
    assert not any(r.name == "lamp.overflow" for r in report.results)
    assert document(report)["max_pending"] is None
    assert not any("environment posts" in line for line in report.assumptions)


def test_symbolic_search_returns_to_the_limit_where_queues_overflow(load: Load) -> None:
    options = ExplorationOptions("c", time="untimed", search=Search.SYMBOLIC)
    report = presses(load, options)
    assert report.verdict is Verdict.HOLDS
    assert document(report)["max_pending"] == 1
    assert told(report) == ["events to `lamp` are lost if more than 3 arrive at once"]
    assert any("at most 1 event is queued" in line for line in report.assumptions)


def test_symbolic_search_needs_no_limit_where_none_overflows(load: Load) -> None:
    options = ExplorationOptions("c", time="untimed", search=Search.SYMBOLIC)
    twice = BUTTON.replace("on: {press: {target: up, do: send off}}", "").replace(
        "down: {rest: true, }", "down: {rest: true}"
    )
    report = presses(load, options, twice)
    assert report.verdict is Verdict.HOLDS
    assert (document(report)["max_pending"], told(report)) == (None, [])
    assert not any("environment posts" in line for line in report.assumptions)


def test_nothing_waits_where_nothing_comes(load: Load) -> None:
    system = load(
        system=SYSTEM.replace("environment: {may: [button.press]}\n", ""), button=BUTTON, lamp=LAMP
    )
    report = check(system, Findings(), options=ExplorationOptions("python"))
    assert document(report)["max_pending"] is None
    assert not any("environment posts" in line for line in report.assumptions)
