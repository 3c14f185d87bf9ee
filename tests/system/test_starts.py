"""Start values that a system gives its machines."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.runtime.system_session import SystemSession
from fsmkit.system.system import System
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Report, Verdict
from tests.verify.conftest import Load

AGV = """
chart: Agv
types: {Mode: [auto, manual]}
constants: {MOST: 3}
inputs: {aligned: bool, load: 0..9}
data: {tries: 0..3 = 0, mode: Mode = auto, spots: "0..9[2]", name: symbol = "x"}
outputs: {left: 0..3 = 0}
events: {in: [go]}
initial: stands
states:
  stands: {rest: true, on: {go: {if: "aligned and tries > 1 and load == 4", target: drives}}}
  drives: {rest: true, entry: left = tries}
"""
SYSTEM = """
system: Hall
machines:
  agv: {chart: agv.yaml, start: {START}}
MORE
environment: {may: [agv.goMAY]}
properties:
  drives: {reachable: agv.In(drives)}
  once: {reachable: agv.left == 2}
  twice: {reachable: agv.left == 3}
  other: {reachable: not agv.aligned}
"""


def hall(load: Load, start: str, may: str = "", more: str = "") -> System:
    text = SYSTEM.replace("START", start).replace("MAY", may).replace("MORE", more)
    return load(hall=text, agv=AGV)


def explored(system: System, engine: str = "python") -> Report:
    return check(system, Findings(), options=ExplorationOptions(engine, time="untimed"))


def holding(report: Report) -> set[str]:
    return {r.name for r in report.results if r.verdict is Verdict.HOLDS}


@pytest.mark.parametrize(
    ("start", "may", "expected"),
    [
        ("aligned: true, tries: 2, load: 4", "", {"drives", "once"}),
        ("aligned: true, tries: MOST, load: 4", "", {"drives", "twice"}),
        ("aligned: true, tries: any, load: 4", "", {"drives", "once", "twice"}),
        ("aligned: true, tries: any, load: 5", "", set()),
        ("aligned: true, tries: 2, load: any", "", {"drives", "once"}),
        ("aligned: any, tries: any, load: any", "", {"drives", "once", "twice", "other"}),
        ("aligned: true, tries: 2, load: any", ', "agv.load in {0}"', {"drives", "once"}),
        ("tries: 2, load: 4", ", agv.aligned", {"drives", "once", "other"}),
    ],
)
def test_machines_start_so(load: Load, start: str, may: str, expected: set[str]) -> None:
    report = explored(hall(load, start, may))
    assert holding(report) - {"deadlock", "livelock"} == expected
    assert all(r.trace is None or r.trace.differs == "" for r in report.results)


@pytest.mark.cc
def test_both_engines_start_from_each_value(load: Load) -> None:
    system = hall(load, "aligned: any, tries: any, load: any, mode: any")
    one, other = explored(system), explored(system, "c")
    assert one.exploration.states == other.exploration.states
    assert holding(one) == holding(other)


def test_any_counts_every_value(load: Load) -> None:
    """As many initial states as there are values that make a difference."""
    states = [explored(hall(load, s)).exploration.states for s in ("mode: auto", "mode: any")]
    assert states == [1, 1]  # what nothing reads makes none
    properties = "properties:\n  odd: {never: agv.mode == manual}\n"
    text = SYSTEM.replace("START", "mode: any").replace("MORE", "").replace("MAY", "")
    report = explored(load(hall=text.replace("properties:\n", properties), agv=AGV))
    assert report.exploration.states == 2
    assert "odd" not in holding(report)


def test_what_runs_starts_so_too(load: Load) -> None:
    session = SystemSession(hall(load, "tries: 3, mode: manual, aligned: any"))
    session.start()
    assert session.value("agv", "tries") == 3
    assert session.snapshot("agv").data[1] == 1
    assert session.snapshot("agv").inputs[0] is False  # `any` is of explorations only


@pytest.mark.parametrize(
    ("start", "more", "rule"),
    [
        ("gone: 1", "", "unknown-name"),
        ("left: 1", "", "unknown-name"),
        ("tries: 9", "", "value-out-of-range"),
        ("tries: true", "", "type-mismatch"),
        ("tries: nothing", "", "unknown-name"),
        ("mode: 7", "", "type-mismatch"),
        ("spots: any", "", "connection-mismatch"),
        ("name: any", "", "connection-mismatch"),
        ("tries: []", "", "unexpected-shape"),
        ("tries: {a: b}", "", "unexpected-shape"),
        ('tries: ""', "", "expression-syntax"),
        ("load: 2", "  b: agv.yaml\nconnect: [b.left -> agv.load]", "duplicate-connection"),
        ("tries: 2", "shared: {tries: 0..3 = 0}", "duplicate-connection"),
    ],
)
def test_bad_input_is_a_finding(load: Load, start: str, more: str, rule: str) -> None:
    with pytest.raises(FsmkitError) as caught:
        hall(load, start, more=more)
    assert rule in {found.rule.name for found in caught.value.diagnostics}


def test_each_element_of_an_array_has_its_own(load: Load) -> None:
    text = """
system: Hall
machines: {"agv[i in 0..2]": {chart: agv.yaml, start: {tries: i + 1, spots: "[i, 7]"}}}
environment: {may: ["agv[i].go"]}
"""
    system = load(hall=text, agv=AGV)
    assert [m.chart.data[0].init.value for m in system.machines] == [1, 2, 3]
    assert [m.chart.data[2].init.value for m in system.machines] == [(0, 7), (1, 7), (2, 7)]


def test_an_input_whose_start_value_is_given_is_not_reported(load: Load) -> None:
    findings = Findings()
    text = SYSTEM.replace("START", "aligned: true").replace("MAY", "").replace("MORE", "")
    load(findings, hall=text, agv=AGV)
    (dry,) = (found for found in findings if found.rule.name == "unconnected-input")
    assert "`load`" in dry.message
    assert "`aligned`" not in dry.message


@pytest.mark.cc
def test_no_program_in_c_is_written_of_it(load: Load, tmp_path: Path) -> None:
    hall(load, "aligned: true, tries: any, load: 4")
    path = f"{tmp_path}/hall.yaml"
    assert execute(["check", path, "--save-test", f"{tmp_path}/t.c"]) == 2
    assert execute(["check", path, "--save-test", f"{tmp_path}/t.py"]) == 1
