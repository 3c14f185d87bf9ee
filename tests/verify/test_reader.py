"""System files: what is read, and what is told of those that are wrong."""

from __future__ import annotations

import pytest

from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.verify.system import EventLink, InputLink, Possible, PropertyKind
from tests.verify.conftest import Load
from tests.verify.systems import AXIS, DRIVE, DRIVER, SYSTEMS

MACHINES = "system: S\nmachines: {driver: driver.yaml, axis: axis.yaml}\n"


def test_reads_machines_wires_environment_and_properties(load: Load) -> None:
    system = load(**SYSTEMS["drive"])
    driver, axis = system.machines
    assert (driver.name, driver.environment, axis.name, axis.environment) == (
        "driver", False, "axis", True,
    )  # fmt: skip
    move = len(driver.chart.events)
    events = axis.chart.event_index
    assert EventLink(0, move, 1, events["move"], (0,)) in system.event_links
    assert system.input_links == (InputLink(1, 0, 0, 0),)
    assert system.possible == (
        Possible(0, driver.chart.event_index["begin"]),
        Possible(0, driver.chart.event_index["pause"]),
    )
    assert [p.kind for p in system.properties] == [
        PropertyKind.INVARIANT, PropertyKind.NEVER, PropertyKind.REACHABLE,
        PropertyKind.DEADLOCK_FREE,
    ]  # fmt: skip


def test_payloads_that_may_come_can_be_limited(load: Load) -> None:
    valve = """
chart: Valve
types: {Fault: [none, jam, leak]}
data: {last: Fault = none}
events: {in: ["fault(code Fault, at 0..3)"]}
initial: here
states: {here: {on: {fault: {if: event.at > 0, do: last = event.code}}}}
"""
    text = """
system: S
machines: {valve: valve.yaml}
environment:
  may: ["valve.fault(code in {jam, leak}, at in 1..2)"]
  will: ["valve.fault(code = Fault.jam, at = 3)"]
"""
    system = load(system=text, valve=valve)
    assert [p.payload for p in system.possible] == [(1, 1), (1, 2), (2, 1), (2, 2), (1, 3)]
    assert [p.owed for p in system.possible] == [False] * 4 + [True]


def test_what_is_not_explored_yet_is_undecided(load: Load) -> None:
    text = (
        DRIVE
        + """
  L1: {leads_to: [driver.In(moving), driver.In(done)]}
  T1: {within: [driver.In(moving), 1100ms, driver.In(done)]}
  O: {never: occurs(driver.pause) and axis.at_end}
"""
    )
    system = load(**{**SYSTEMS["drive"], "drive": text})
    assert [bool(p.unexplored) for p in system.properties] == [False] * 4 + [True] * 3


@pytest.mark.parametrize(
    ("text", "rule", "place"),
    [
        ("system: S\n", "empty-system", "S"),
        ("system: S\nmachines: {a: nowhere.yaml}", "unreadable-file", "nowhere.yaml"),
        ("system: S\nmachines: {'a[i in 0..2]': axis.yaml}", "not-explored-yet", "'a[i in 0..2]'"),
        ("system: S\nmachines: {a: {chart: axis.yaml, with: {x: 1}}}", "not-explored-yet", "with"),
        (MACHINES + "machine: {}", "unknown-key", "machine"),
        (MACHINES + "schedule: cyclic", "not-explored-yet", "cyclic"),
        (MACHINES + "shared: {turn: 0..3}", "not-explored-yet", "{turn: 0..3}"),
        (MACHINES + "connect: [axis.stop]", "broken-connection", "axis.stop"),
        (MACHINES + "connect: [drive.move -> axis.move]", "unknown-name", "drive"),
        (MACHINES + "connect: [driver.mov -> axis.move]", "unknown-name", "mov"),
        (MACHINES + "connect: [driver.move -> axis.more]", "unknown-name", "more"),
        (MACHINES + "connect: [driver.stop -> axis.move]", "connection-mismatch", "move"),
        (MACHINES + "connect: [axis.at_end -> driver.their]", "unknown-name", "their"),
        (MACHINES + "connect: [axis.arrived -> driver.move]", "unknown-name", "move"),
        (
            MACHINES + "connect: [axis.arrived -> driver.arrived, axis.arrived -> driver.arrived]",
            "duplicate-connection",
            "axis.arrived -> driver.arrived",
        ),
        (
            MACHINES + "connect:\n- driver.stop -> axis.stop: {kind: lossy}",
            "not-explored-yet",
            "lossy",
        ),
        (MACHINES + "environment: {may: [axis]}", "machine-that-may", "axis"),
        (MACHINES + "environment: {may: [driver.begun]}", "unknown-name", "begun"),
        (MACHINES + "environment: {might: []}", "unknown-key", "might"),
        (MACHINES + "environment: {may: ['axis.move(fast = true)']}", "unknown-name", "fast"),
        (MACHINES + "properties: {P: nevr}", "unknown-name", "nevr"),
        (MACHINES + "properties: {P: never}", "missing-condition", "never"),
        (MACHINES + "properties: {P: {never: driver.In(mooving)}}", "unknown-name", "mooving"),
        (MACHINES + "properties: {P: {never: drivr.In(moving)}}", "unknown-name", "drivr"),
        (MACHINES + "properties: {P: {never: driver.trie == 1}}", "unknown-name", "trie"),
        (MACHINES + "properties: {P: {never: driver.moving}}", "unknown-name", "moving"),
        (MACHINES + "properties: {P: {invariant: driver.tries + 1}}", "type-mismatch", None),
    ],
)  # fmt: skip
def test_errors_have_places(load: Load, text: str, rule: str, place: str | None) -> None:
    findings = Findings()
    with pytest.raises(FsmkitError):
        load(findings, system=text, driver=DRIVER, axis=AXIS)
    found = [f for f in findings if f.rule.name == rule]
    assert found, [(f.rule.name, f.message) for f in findings]
    label = found[0].primary
    assert label is not None
    if place is not None:
        assert label.span.source.text[label.span.start : label.span.end] == place


def test_a_misspelt_name_is_underlined_where_it_stands(load: Load) -> None:
    findings = Findings()
    text = MACHINES + "properties: {P: {never: driver.tries == 1 and axis.at_ned}}"
    with pytest.raises(FsmkitError):
        load(findings, system=text, driver=DRIVER, axis=AXIS)
    (found,) = [f for f in findings if f.rule.name == "unknown-name"]
    assert found.help == "did you mean `at_end`?"


def test_what_is_not_connected_is_told(load: Load) -> None:
    findings = Findings()
    load(findings, system=MACHINES, driver=DRIVER, axis=AXIS)
    told = {f.rule.name: f.message for f in findings if f.rule.name.startswith("unconnected")}
    assert told["unconnected-input"] == "nothing drives `there` of `driver`: the start value stays"
    assert "`move`" in told["unconnected-event"]
