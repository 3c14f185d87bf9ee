"""System files: what is read, and what is told of those that are wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.machine import EventLink, InputLink, Possible
from fsmkit.system.properties.kinds import deadlock_free, invariant, never, reachable
from fsmkit.system.system_file import load_system
from tests.verify.conftest import Load
from tests.verify.systems import AXIS, DRIVE, DRIVER, SYSTEMS

LINK = "system: S\nmachines: {driver: driver.yaml, axis: axis.yaml}\n"
LINK += "connect:\n- driver.stop -> axis.stop: "
ARRAY = "system: S\nmachines: {'a[i in 0..1]': axis.yaml}\n"
MACHINES = "system: S\nmachines: {driver: driver.yaml, axis: axis.yaml}\n"
LOOP = MACHINES + "schedule: {cyclic: "


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
        invariant.KIND, never.KIND, reachable.KIND,
        deadlock_free.KIND,
    ]  # fmt: skip


def test_payloads_that_may_come_can_be_limited(load: Load) -> None:
    valve = """
chart: Valve
types: {Fault: [none, jam, leak]}
data: {last: Fault = none}
events: {in: ["fault(code Fault, at 0..3)"]}
initial: here
states:
  here:
    invariant: last != Fault.none
    on: {fault: {if: event.at > 1, do: last = event.code}}
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
    assert [p.fair for p in system.possible] == [False] * 4 + [True]


def test_arrays_are_written_out(load: Load) -> None:
    system = load(**SYSTEMS["ring"])
    assert [m.name for m in system.machines] == ["node[0]", "node[1]", "node[2]"]
    given = [dict(m.chart.constants) for m in system.machines]
    assert [(c["FIRST"].value, c["AT"].value, c["T_HOLD"].value) for c in given] == [
        (False, 0, 10), (True, 1, 15), (False, 2, 20),
    ]  # fmt: skip
    assert [(link.source, link.target) for link in system.event_links] == [(0, 1), (1, 2), (2, 0)]
    assert [(link.source, link.target) for link in system.input_links] == [(0, 1), (1, 2), (2, 0)]
    assert [what.machine for what in system.possible] == [0, 1, 2]


def test_machines_hold_what_they_name_of_shared_arrays(load: Load) -> None:
    chart = """
chart: One
constants: {A: 0, B: 1}
data: {fork: "bool[3] = false", all: "0..2[2] = 0", n: 0..1 = 0}
initial: s
states: {s: {sometimes: {if: "not fork[A]", do: "fork[B] = true; all[n] = 1"}}}
"""
    text = """
system: S
machines: {"p[i in 0..2]": {chart: one.yaml, with: {A: i, B: (i + 1) % 3}}}
shared: {fork: "bool[3] = true", all: "0..2[2] = [1, 2]"}
properties: {P: {never: "all(i in 0..2: fork[i]) and all[0] == 2"}}
"""
    system = load(system=text, one=chart)
    held = [[str(slot) for slot in m.shared] for m in system.machines]
    both = ["all[0]", "all[1]"]
    assert held == [
        ["fork[0]", "fork[1]", *both], ["fork[1]", "fork[2]", *both], ["fork[0]", "fork[2]", *both],
    ]  # fmt: skip
    assert [m.chart.data[1].init.value for m in system.machines] == [(1, 2)] * 3
    with pytest.raises(FsmkitError):
        load(system=text.replace("all(i in 0..2: fork[i])", "fork == fork"), one=chart)


def test_a_constant_of_a_base_can_be_given(load: Load) -> None:
    base = "chart: B\nconstants: {N: 1, M: N + 1}\ninitial: s\nstates: {s: {rest: true}}"
    text = "system: S\nmachines: {a: {chart: derived.yaml, with: {N: 4}}, b: derived.yaml}"
    derived = "chart: D\nextends: base.yaml\nconstants: {M: N + 2}"
    system = load(system=text, derived=derived, base=base)
    values = [{n: c.value for n, c in m.chart.constants} for m in system.machines]
    assert values == [{"N": 4, "M": 6}, {"N": 1, "M": 3}]


def test_machines_of_an_array_run_other_charts_when_replaced(tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text(ARRAY)
    (tmp_path / "axis.yaml").write_text(AXIS)
    (tmp_path / "other.yaml").write_text(AXIS.replace("Axis", "Other"))
    other = tmp_path / "other.yaml"
    for name, charts in (("a", ["Other", "Other"]), ("a[1]", ["Axis", "Other"])):
        system = load_system(tmp_path / "s.yaml", Findings(), {name: other})
        assert [m.chart.name for m in system.machines] == charts


def test_all_kinds_of_properties_are_explored(load: Load) -> None:
    text = (
        DRIVE
        + """
  L1: {leads_to: [driver.In(moving), driver.In(done)]}
  T1: {within: [driver.In(moving), 1100ms, driver.In(done)]}
  O: {never: occurs(driver.pause) and axis.at_end}
"""
    )
    system = load(**{**SYSTEMS["drive"], "drive": text})
    assert len(system.properties) == 7


@pytest.mark.parametrize(
    ("text", "rule", "place"),
    [
        ("system: S\n", "empty-system", "S"),
        ("system: S\nmachines: {a: nowhere.yaml}", "unreadable-file", "nowhere.yaml"),
        ("system: S\nmachines: {'a[i in 2..0]': axis.yaml}", "bad-index", "2"),
        ("system: S\nmachines: {'a[i in 0..n]': axis.yaml}", "unknown-name", "n"),
        ("system: S\nmachines: {'a[i in 0..90000]': axis.yaml}", "bad-index", "0"),
        ("system: S\nmachines: {'a[i]': axis.yaml}", "unexpected-shape", "'a[i]'"),
        ("system: S\nmachines: {a: {chart: axis.yaml, with: {x: 1}}}", "unknown-name", "x"),
        (ARRAY + "connect: ['a[i].arrived -> a[i + 1].stop']", "unknown-name", "a[i + 1]"),
        (ARRAY + "connect: ['a[i].arrived -> a[k + 1].stop']", "unknown-name", "k"),
        (ARRAY + "connect: ['a[i].arrived -> a[1 / 2.0].stop']", "bad-index", "1 / 2.0"),
        (ARRAY + "environment: {may: ['a[i].begun']}", "unknown-name", "begun"),
        (ARRAY + "properties: {P: {never: 'a[2].In(still)'}}", "unknown-name", "a[2]"),
        (ARRAY + "properties: {P: {never: 'a[0].In(stil)'}}", "unknown-name", "stil"),
        (ARRAY + "properties: {P: {never: 'any(k in b: a[k].at_end)'}}", "unknown-name", "b"),
        (ARRAY + "properties: {P: {never: 'any(k in a: a[k].at_ned)'}}", "unknown-name", "at_ned"),
        (ARRAY + "properties: {P: {never: 'any(k in a: a[k].at_end'}}", "expression-syntax", "any"),
        (MACHINES + "machine: {}", "unknown-key", "machine"),
        (MACHINES + "schedule: cyclic", "unexpected-shape", "cyclic"),
        (MACHINES + "schedule: {cyclic: [axis]}", "missing-key", "{cyclic: [axis]}"),
        (MACHINES + "schedule: {period: 10ms}", "missing-key", "{period: 10ms}"),
        (LOOP + "[axis, drive], period: 10ms}", "unknown-name", "drive"),
        (LOOP + "[axis], period: 10ms}", "unscheduled-machine", "[axis]"),
        (LOOP + "[axis, driver, axis], period: 10ms}", "duplicate-name", "axis"),
        (LOOP + "[axis, driver], period: 0ms}", "bad-period", "0ms"),
        (LOOP + "[axis, driver], period: 10ms, jitter: 10ms}", "bad-period", "10ms"),
        (LOOP + "[axis, driver], period: 10}", "invalid-duration", "10"),
        (LOOP + "[axis, driver], period: 100us}", "invalid-duration", "100us"),
        (LOOP + "[axis, driver], period: 10ms, drift: 1ms}", "unknown-key", "drift"),
        (
            LOOP + "[axis, driver], period: 10ms}\nenvironment: {will: [axis]}",
            "unscheduled-machine",
            "axis",
        ),
        (MACHINES + "shared: {turn: 0..3}", "unshared-data", "turn"),
        (MACHINES + "shared: {tries: 0..3}", "connection-mismatch", "tries"),
        (MACHINES + "shared: {tries: 0..2 = 7}", "value-out-of-range", "7"),
        (MACHINES + "shared: {tries: 0..x}", "unknown-name", "x"),
        (MACHINES + "shared: {tries: [0]}", "unexpected-shape", "[0]"),
        (MACHINES + "shared: {tries: symbol}", "connection-mismatch", "symbol"),
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
        (LINK + "{kind: losy}", "unexpected-value", "losy"),
        (LINK + "{kind: queued, loss: 2}", "unexpected-value", "2"),
        (LINK + "{capacity: 2}", "unexpected-value", "2"),
        (LINK + "{kind: queued, capacity: 0}", "bad-capacity", "0"),
        (LINK + "{kind: queued, capacity: many}", "unknown-name", "many"),
        (LINK + "{kind: queued, delay: 5}", "invalid-duration", "5"),
        (LINK + "{kind: lossy, los: 5}", "unknown-key", "los"),
        (
            MACHINES + "connect:\n- axis.at_end -> driver.there: {kind: queued}",
            "connection-mismatch",
            "axis.at_end -> driver.there",
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


def test_machines_have_no_intervals(load: Load) -> None:
    findings = Findings()
    axis = AXIS.replace("300ms:", "300ms..400ms:")
    with pytest.raises(FsmkitError):
        load(findings, system=MACHINES, driver=DRIVER, axis=axis)
    assert "interval-of-machine" in {f.rule.name for f in findings}
    load(system=MACHINES + "environment: {will: [axis]}", driver=DRIVER, axis=axis)


def test_what_is_not_connected_is_told(load: Load) -> None:
    findings = Findings()
    load(findings, system=MACHINES, driver=DRIVER, axis=AXIS)
    told = {f.rule.name: f.message for f in findings if f.rule.name.startswith("unconnected")}
    assert told["unconnected-input"] == "nothing drives `there` of `driver`: the start value stays"
    assert "`move`" in told["unconnected-event"]
