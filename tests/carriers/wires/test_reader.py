"""What is wrong with wires is found, with its place; and what is meant is read."""

from __future__ import annotations

from pathlib import Path

import pytest

import fsmkit
from fsmkit.carriers.wires.board import (
    BoundEvent,
    Cases,
    Edge,
    Hysteresis,
    Invalid,
    Kind,
    Query,
)
from fsmkit.carriers.wires.signals import scaled
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.diagnostics.rules import Severity
from tests.carriers.wires.conftest import load, write

CHART = """\
chart: Mould
types: {Fault: [none, sensor], Place: [between, home, far]}
constants: {FAR: 1500, SLOW: 20}
inputs: {hot: bool, temperature: -400..1000, at: Place}
outputs: {lamp: bool = false}
operations: [heat(on bool), goto(position 0..4000), count() -> 0..9]
events:
  in: [start, arrived, fault(code Fault)]
  out: [done]
states:
  idle:
    on:
      start: {do: heat(true); goto(FAR); lamp = hot and temperature > 3 and at == Place.home}
      arrived: {if: count() > 3, do: send done}
      fault: {if: event.code == Fault.sensor, do: lamp = true}
"""
WIRES = """\
board: a
deployment: deployment.yaml
period: 1ms
signals:
  mould.temperature: {analog_in: 0, scale: {0: -400, 4095: 1000}, lowpass: 20ms, valid: 40..4055}
  encoder: {counter: 1, bits: 16}
  button: {digital_in: 3, active: low, debounce: 2500us}
  verdict: {number_in: 0, range: 0..3}
  heater: {digital_out: 0}
  lamp: {digital_out: 1, active: low, safe: on}
  motor: {pwm: 0, full: 4096, signed: true}
  beacon: {number_out: 0, range: 0..2, safe: 2}
  is_done: {flag: off}
use:
  axis: {header: axis.h, type: axis, reads: [encoder], writes: [motor], notices: [arrived]}
bind:
  mould:
    hot: {of: mould.temperature, above: 600, below: 580}
    temperature: mould.temperature
    at:
      when: {home: {call: axis.is_at, with: 0}, far: {call: axis.is_at, with: [FAR, SLOW]}}
      else: between
    start: [{rising: button}, {is: 2, of: verdict, while: not is_done}]
    arrived: axis.arrived
    fault(code = Fault.sensor): {invalid: mould.temperature, for: 50ms}
    heat: heater
    goto: axis.goto
    count: "is_done ? 1 : 0"
    done: {set: {is_done: true}}
    lamp: lamp
set: {beacon: "mould.In(idle) ? 1 : 0"}
off: {when: button, keep: [heater]}
"""


def changed(folder: Path, old: str, new: str, text: str = WIRES) -> Path:
    assert old in text
    return write(folder, CHART, text.replace(old, new))


def test_what_is_written_is_read(tmp_path: Path) -> None:
    findings = Findings()
    board = load(write(tmp_path, CHART, WIRES), findings)
    assert [found.rule.name for found in findings if found.rule.code > "FK0560"] == []
    temperature, encoder, button, *_ = board.signals
    assert (temperature.kind, temperature.lowpass) == (Kind.ANALOG_IN, 20)
    assert str(temperature.type) == "-386..986"  # what valid readings mean
    assert (encoder.bits, button.is_low, button.debounce) == (16, True, 3)
    lamp = next(signal for signal in board.signals if signal.name == "lamp")
    assert (lamp.safe, lamp.is_low) == (1, True)
    assert [signal.name for signal in board.signals if signal.is_kept] == ["heater"]
    hot, number, at = board.inputs
    assert hot.origin == Hysteresis(0, 600, 580)
    assert isinstance(at.origin, Cases)
    assert [value for value, _ in at.origin.cases] == [1, 2]
    assert all(isinstance(bit, Query) for _, bit in at.origin.cases)
    assert number.input == 1
    edges = [event.edge for event in board.events]
    assert edges == [Edge.RISING, Edge.ALWAYS, Edge.ALWAYS, Edge.RISING]
    assert board.events[-1].watched == Invalid(0, 50)
    assert len(board.ports) == 4


WRONG = [
    ("board: a", "board: b", "unknown-name", "no node `b`"),
    ("period: 1ms", "period: 0ms", "broken-board", "must be positive"),
    ("period: 1ms\n", "", "broken-board", "needs `board`, `deployment` and `period`"),
    ("{digital_out: 0}", "{digital_out: 0, pwm: 2}", "broken-board", "several kinds"),
    ("{digital_out: 0}", "{active: low}", "broken-board", "has no kind"),
    ("{digital_out: 0}", "{digital_out: 1}", "wire-used-twice", "is `heater` already"),
    ("{digital_out: 0}", "{digital_out: 0, debounce: 1ms}", "unknown-key", "debounce"),
    ("{digital_out: 0}", "{digital_out: 70000}", "broken-board", "within 0..65535"),
    ("  heater:", "  a.b.c:", "broken-board", "not a valid signal name"),
    ("  heater:", "  nothing:", "broken-board", "has a meaning"),
    ("bits: 16", "bits: 33", "broken-board", "within 1..32"),
    ("active: low, deb", "active: down, deb", "unexpected-value", "not `down`"),
    ("debounce: 2500us", "debounce: 70s", "broken-board", "longer than 65535 cycles"),
    ("{0: -400, 4095: 1000}", "{0: -400}", "broken-board", "two points"),
    ("{0: -400, 4095: 1000}", "{4095: 0, 0: 9}", "broken-board", "ascend"),
    ("{0: -400, 4095: 1000}", "{0: -400, 4096: 9}", "broken-board", "not within 0..4095"),
    ("40..4055", "4055..40", "broken-board", "a range within 0..4095"),
    ("40..4055", "many", "broken-board", "not a range"),
    ("full: 4096, ", "", "broken-board", "needs `full`"),
    ("safe: 2", "safe: 3", "broken-board", "within 0..2"),
    ("4095: 1000}", "4095: 1100}", "unfit-wire",
     "`-385..1085`, and `temperature` is `-400..1000`"),
    ("above: 600, ", "", "bare-comparison", "two thresholds"),
    ("above: 600, below: 580", "above: 500, below: 580", "unfit-wire", "no thresholds"),
    ("above: 600, below: 580", "above: 2000, below: 580", "unfit-wire", "no thresholds"),
    ("{of: mould.temperature, above: 600, below: 580}", "mould.temperature > 600",
     "bare-comparison", "noise on `mould.temperature`"),
    ("{of: mould.temperature, above: 600, below: 580}", "mould.temperature", "unfit-wire",
     "`hot` is `bool`"),
    ("{of: mould.temperature, above", "{of: button, above", "unfit-wire",
     "of the kind `digital_in`"),
    ("{of: mould.temperature, above", "{of: mould.temprature, above", "unknown-name",
     "no signal `mould.temprature`"),
    ("hot: {of", "hott: {of", "unknown-name", "nothing to bind named `hott`"),
    ("temperature: mould.temperature", "temperature: {of: mould.temperature, above: 3, below: 1}",
     "unfit-wire", "gives a bit"),
    ("else: between", "else: nowhere", "unknown-name", "nowhere"),
    ("      else: between\n", "", "missing-key", "where no condition holds"),
    ("call: axis.is_at, with: 0", "call: axle.is_at, with: 0", "unknown-name", "no device `axle`"),
    ("call: axis.is_at, with: 0", "call: is_at", "unexpected-value", "no function of a device"),
    ("arrived: axis.arrived", "arrived: button", "unexpected-shape", "when is `arrived` posted?"),
    ("[{rising: button}", "[{rising: button, falling: button}", "unexpected-shape", "two edges"),
    ("{rising: button}", "{rising: mould.temperature}", "unfit-wire", "`rising` is `bool`"),
    ("is: 2, of: verdict", "is: 4, of: verdict", "unfit-wire", "`verdict` is `0..3`"),
    ("is: 2, of: verdict", "is: 2", "unexpected-shape", "needs `of`"),
    ("fault(code = Fault.sensor)", "fault", "wrong-arguments", "`fault` has a field `code`"),
    ("fault(code = Fault.sensor)", "fault(kind = 1, code = Fault.none)", "wrong-arguments",
     "no field `kind`"),
    ("fault(code = Fault.sensor)", "fault(Fault.sensor)", "unexpected-shape", "no field a value"),
    ("heat: heater", "heat: button", "unfit-wire", "is an input"),
    ("heat: heater", "heat: lamp", "wire-used-twice", "two drivers"),
    ("heat: heater", "heat: motor", "unfit-wire", "`bool`"),
    ("    heat: heater\n", "", "unbound-wire", "nothing binds `heat` of `mould`"),
    ("goto: axis.goto", "goto: heater", "unfit-wire",
     "`position` is `0..4000`, and `heater` is `bool`"),
    ('count: "is_done ? 1 : 0"', "count: encoder", "unfit-wire", "`count` returns `0..9`"),
    ('count: "is_done ? 1 : 0"', "count: nothing", "unfit-wire", "returns a value"),
    ('count: "is_done ? 1 : 0"', "count: {set: {is_done: true}}", "unfit-wire", "nothing gives it"),
    ("done: {set", "done: {let", "unknown-key", "let"),
    ("beacon: \"mould", "button: \"mould", "unfit-wire", ""),
    ("? 1 : 0\"}", "? 3 : 0\"}", "unfit-wire", "`0..3`, and `beacon` is `0..2`"),
    ("? 1 : 0\"}", "? verdict * encoder : 0\"}", "unfit-wire", "32 bits"),
    ("? 1 : 0\"}", "? verdict / 2 : 0\"}", "unfit-wire", "bits and whole numbers"),
    ("when: button", "keep: [lamp]", "duplicate-key", ""),
    ("off: {when: button, ", "off: {", "missing-key", "needs `when`"),
    ("keep: [heater]", "keep: [button]", "unfit-wire", "is an input"),
    ("reads: [encoder]", "reads: [motor]", "unfit-wire", "is an output"),
    ("header: axis.h", "header: 'a\"b.h'", "broken-board", "not an identifier of C"),
    ("type: axis, ", "", "broken-board", "needs `header` and `type`"),
    ("bind:\n  mould:", "bind:\n  mold:", "unknown-name", "did you mean `mould`?"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "rule", "text"), WRONG, ids=[w[1][:40] for w in WRONG])
def test_what_is_wrong_is_found(tmp_path: Path, old: str, new: str, rule: str, text: str) -> None:
    with pytest.raises(FsmkitError) as raised:
        load(changed(tmp_path, old, new))
    errors = [found for found in raised.value.diagnostics if found.severity is Severity.ERROR]
    fitting = [found for found in errors if found.rule.name == rule]
    assert fitting, [(found.rule.name, found.message) for found in errors]
    assert any(text in f"{found.message} {found.help}" for found in fitting), fitting
    assert all(found.primary is not None for found in errors)


@pytest.mark.parametrize(
    ("old", "new", "rule", "text"),
    [
        ("    temperature: mould.temperature\n", "", "unbound-wire", "keep their start value"),
        ("    arrived: axis.arrived\n", "", "unbound-wire", "never come"),
        ("[{rising: button}, {is: 2, of: verdict, while: not is_done}]", "{rising: button}",
         "unused-wire", "nothing reads `verdict`"),
        ("    lamp: lamp\n", "", "unused-wire", "nothing drives `lamp`"),
    ],
)  # fmt: skip
def test_what_may_be_meant_is_a_warning(
    tmp_path: Path, old: str, new: str, rule: str, text: str
) -> None:
    findings = Findings()
    load(changed(tmp_path, old, new), findings)
    assert [
        found.message for found in findings if found.rule.name == rule and text in found.message
    ]


def test_both_places_are_told_where_types_do_not_meet(tmp_path: Path) -> None:
    with pytest.raises(FsmkitError) as raised:
        load(changed(tmp_path, "4095: 1000}", "4095: 1100}"))
    (found,) = [found for found in raised.value.diagnostics if found.rule.name == "unfit-wire"]
    assert found.primary is not None
    assert found.primary.span.source.name.endswith("board_a.io.yaml")
    assert [label.span.source.name.rsplit("/")[-1] for label in found.secondary] == ["mould.yaml"]


@pytest.mark.parametrize("word", ["nothing", "host"])
def test_what_is_not_bound_can_be_said(tmp_path: Path, word: str) -> None:
    text = WIRES.replace("arrived: axis.arrived", f"arrived: {word}")
    text = text.replace("    temperature: mould.temperature", f"    temperature: {word}")
    findings = Findings()
    board = load(changed(tmp_path, "heat: heater", f"heat: {word}", text), findings)
    assert not [found for found in findings if found.rule.name == "unbound-wire"]
    assert len(board.ports) == (4 if word == "nothing" else 3)


def test_connections_serve_what_is_not_bound(tmp_path: Path) -> None:
    path = write(tmp_path, CHART, WIRES)
    (tmp_path / "lamp.yaml").write_text(
        "chart: Lamp\ninputs: {on: bool}\nevents: {in: [go], out: [begin]}\n"
        "states: {s: {on: {go: {if: on, do: send begin}}}}\n"
    )
    (tmp_path / "plant.yaml").write_text(
        "system: Plant\nmachines: {mould: mould.yaml, light: lamp.yaml}\n"
        "connect: [mould.lamp -> light.on, mould.done -> light.go, light.begin -> mould.start]\n"
    )
    (tmp_path / "deployment.yaml").write_text("system: plant.yaml\nnodes: {a: [mould, light]}\n")
    with pytest.raises(FsmkitError) as raised:
        load(path)
    messages = [found.message for found in raised.value.diagnostics]
    assert "`done` is connected to another machine already" in messages
    text = WIRES.replace("    done: {set: {is_done: true}}\n", "").replace("is_done: {flag: off}",
                         "is_done: {flag: off, host: true}")  # fmt: skip
    path.write_text(text)
    findings = Findings()
    board = load(path, findings)
    assert len(board.ports) == 3
    assert not [found for found in findings if found.rule.name == "unbound-wire"]
    path.write_text(text.replace("bind:\n", "bind:\n  light: {on: button}\n"))
    with pytest.raises(FsmkitError) as raised:
        load(path)
    messages = [found.message for found in raised.value.diagnostics]
    assert "`on` is connected to another machine already" in messages


def test_machines_of_one_chart_are_told_apart_or_refused(tmp_path: Path) -> None:
    path = write(tmp_path, CHART, WIRES)
    system = "system: Plant\nmachines: {mould: mould.yaml, other: mould.yaml}\n"
    (tmp_path / "plant.yaml").write_text(system)
    (tmp_path / "deployment.yaml").write_text("system: plant.yaml\nnodes: {a: [mould, other]}\n")
    rest = "  other: {hot: nothing, temperature: nothing, at: nothing, start: nothing, arrived: "
    rest += "nothing, fault: nothing, heat: nothing, goto: nothing, count: '1', done: nothing}\n"
    path.write_text(WIRES.replace("set: {beacon", f"{rest}set: {{beacon"))
    with pytest.raises(FsmkitError) as raised:
        load(path)
    assert any("run the same C" in found.message for found in raised.value.diagnostics)


def test_machines_of_other_nodes_are_not_seen(tmp_path: Path) -> None:
    path = changed(tmp_path, 'mould.In(idle) ? 1 : 0"', 'other.In(idle) ? 1 : 0"')
    system = "system: Plant\nmachines: {mould: mould.yaml, other: mould.yaml}\n"
    (tmp_path / "plant.yaml").write_text(system)
    (tmp_path / "deployment.yaml").write_text(
        "system: plant.yaml\nnodes: {a: [mould], b: [other]}\n"
    )
    with pytest.raises(FsmkitError) as raised:
        load(path)
    assert any("does not run on this board" in found.message for found in raised.value.diagnostics)


def test_readers_of_models_refuse_wires(tmp_path: Path) -> None:
    with pytest.raises(FsmkitError) as raised:
        fsmkit.read(write(tmp_path, CHART, WIRES))
    assert [found.rule.name for found in raised.value.diagnostics] == ["not-a-chart"]


def test_scales_are_straight_between_points_and_level_beyond() -> None:
    points = ((0, -400), (100, 0), (200, -50))
    assert [scaled(points, raw) for raw in (-9, 0, 1, 50, 100, 101, 102, 200, 999)] == [
        -400, -400, -396, -200, 0, -1, -1, -50, -50,
    ]  # fmt: skip


def test_posted_fields_are_read(tmp_path: Path) -> None:
    board = load(write(tmp_path, CHART, WIRES))
    fault = board.events[-1]
    assert isinstance(fault, BoundEvent)
    assert [value.expression.value for value in fault.values] == [1]  # type: ignore[union-attr]
