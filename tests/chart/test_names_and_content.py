"""Declarations, events and statements: what they mean in a Chart, and what is refused."""

from __future__ import annotations

from typing import Any

import pytest

from fsmkit.chart.statements import Assign, Cancel, Destination, ForEach, If, Raise, Reply, Send
from fsmkit.document.document import Direction
from fsmkit.language import DURATION, EnumType, IntType, Literal, Overflow

CHART = """
    chart: M
    types: {{Fault: [none, jam], Pair: {{x: 0..9, y: bool}}}}
    constants: {{A: 2, B: A * 3, T: 20ms}}
    data:
      n: 0..B = A
      m: uint8 = 0
      f: Fault = jam
      list: uint8[4] = 7
      some: 0..9[3] = [1, 2, 3]
    inputs: {{level: 0..100}}
    outputs: {{lamp: bool = true}}
    operations: [act(speed 0..100), query() -> bool]
    events:
      in:
        - go
        - both
        - ask() -> 0..3
        - fault(code Fault, n 0..3)
        - other(code Fault)
      out: [both, done(n 0..9)]
      internal: [tick]
    states:
      a:
        entry: {content}
        on:
          fault other: {{if: event.code == Fault.jam, target: a}}
          ask: {{do: reply n}}
          go both: a
          tick: a
        exit: |
          send done(n = level)
          lamp = n > 1 and query()
          for each in some {{ m += each }}
          act(list[0])
          send both to self
"""


def with_content(content: str) -> str:
    return CHART.format(content=content)


def test_declarations(yaml: Any) -> None:
    chart = yaml(with_content("n = 1")).chart
    assert dict(chart.constants)["B"].value == 6
    assert dict(chart.constants)["T"] == Literal(20, DURATION, chart.states[0].span)
    n, m, f, some_list, some = chart.data[:5]
    assert (n.type, n.init.value) == (IntType(0, 6), 2)
    assert m.type.overflow is Overflow.WRAP
    assert (f.type, f.init.value) == (EnumType("Fault", ("none", "jam")), 1)
    assert some_list.init.value == (7, 7, 7, 7)
    assert some.init.value == (1, 2, 3)
    assert chart.outputs[0].init.value is True
    assert chart.operations[1].result is not None


def test_events_declared_both_ways_are_one(yaml: Any) -> None:
    chart = yaml(with_content("n = 1")).chart
    both = chart.events[chart.event_index["both"]]
    assert both.directions == {Direction.IN, Direction.OUT}
    assert chart.events[chart.event_index["ask"]].reply == IntType(0, 3)


@pytest.mark.parametrize(
    ("content", "kind"),
    [
        ("n += 1", Assign),
        ("raise tick", Raise),
        ("raise fault(n = 1, code = Fault.jam)", Raise),
        ("cancel later", Cancel),
        ("if n > 1 { n = 0 } else { raise tick }", If),
        ("for x in list { n = 1 }", ForEach),
        ("reply 2", Reply),
    ],
)
def test_statements(yaml: Any, content: str, kind: type) -> None:
    chart = yaml(with_content(f"'{content}'")).chart
    ((statement,),) = chart.states[1].on_entry
    assert isinstance(statement, kind)


def test_arguments_stand_in_the_order_of_the_declaration(yaml: Any) -> None:
    chart = yaml(with_content("'raise fault(n = 1, code = Fault.jam)'")).chart
    ((statement,),) = chart.states[1].on_entry
    assert [a.value for a in statement.arguments] == [1, 1]
    assert statement.arguments[0].type == EnumType("Fault", ("none", "jam"))


@pytest.mark.parametrize(
    ("content", "destination", "peer", "delay"),
    [
        ("send done(n = 1)", Destination.PORT, None, None),
        ("send done(n = 1) to peer", Destination.PORT, "peer", None),
        ("send go", Destination.SELF, None, None),
        ("send tick", Destination.SELF, None, None),
        ("send both to self after 500ms as later", Destination.SELF, None, 500),
        ("send both to molder after T", Destination.PORT, "molder", 20),
    ],
)
def test_where_events_go(
    yaml: Any, content: str, destination: Destination, peer: str | None, delay: int | None
) -> None:
    ((statement,),) = yaml(with_content(f"'{content}'")).chart.states[1].on_entry
    assert isinstance(statement, Send)
    assert (statement.destination, statement.peer) == (destination, peer)
    assert (statement.delay.value if isinstance(statement.delay, Literal) else None) == delay


@pytest.mark.parametrize(
    ("content", "rule"),
    [
        ("send both", "ambiguous-destination"),
        ("send go to peer", "wrong-direction"),
        ("raise done(n = 1)", "wrong-direction"),
        ("raise gone", "unknown-name"),
        ("raise fault(n = 1)", "missing-argument"),
        ("raise fault(n = 1, code = Fault.jam, x = 2)", "unknown-name"),
        ("raise fault(n = 1, code = Fault.jam, n = 2)", "duplicate-argument"),
        ("level = 2", "assigned-input"),
        ("super", "super-without-base"),
        ("for x in n { m = 1 }", "loop-variable-type"),
        ("for m, lamp in list { n = 1 }", "loop-variable-type"),
    ],
)
def test_wrong_statements(yaml: Any, content: str, rule: str) -> None:
    result = yaml(with_content(f"'{content}'"))
    assert rule in result.errors
    assert result.maybe is None


def test_the_event_has_the_fields_all_matched_events_have(yaml: Any) -> None:
    text = with_content("n = 1").replace("if: event.code == Fault.jam", "if: event.n == 1")
    assert yaml(text).errors


def test_entry_content_has_no_event(yaml: Any) -> None:
    assert yaml(with_content("f = event.code")).errors


@pytest.mark.parametrize(
    ("declarations", "rule"),
    [
        ("data: {n: 0..3 = 4}", "value-out-of-range"),
        ("data: {n: 0..3 = 2 + 2}", "value-out-of-range"),
        ("data: {n: uint8 = 300}", "value-out-of-range"),
        ("data: {n: 0..3 wrap = 4}", "value-out-of-range"),
        ("data: {n: uint8 = 300.5}", "value-out-of-range"),
        ("data: {n: 'uint8[2] = [1, -1]'}", "value-out-of-range"),
        ("data: {n: float32 = 1e39}", "value-out-of-range"),
        ("constants: {C: 256}\noutputs: {n: uint8 = C}", "value-out-of-range"),
        ("data: {n: 'uint8[2] = [1, 2, 3]'}", "wrong-array-length"),
        ("data: {n: 0..3 = 1}\ninputs: {n: bool}", "duplicate-name"),
        ("events: {in: [go, go]}", "duplicate-name"),
        ("events: {in: [error.execution]}", "reserved-event"),
        ("capacity: {queue: many}", "bad-capacity"),
        ("capacity: {queue: 0}", "bad-capacity"),
        ("inputs: {i: bool}\nconstants: {A: i}", None),
    ],
)
def test_wrong_declarations(yaml: Any, declarations: str, rule: str | None) -> None:
    result = yaml(f"chart: M\n{declarations}\nstates: {{a: {{}}}}\n")
    assert result.maybe is None
    if rule is not None:
        assert result.errors == [rule]


def test_capacities(yaml: Any) -> None:
    chart = yaml(
        "chart: M\ncapacity: {queue: 3, internal: 4, delayed: 0, microsteps: 7, tick: 100us}\n"
        "events: {in: [go]}\nstates: {a: {after: {1ms: a}}}\n"
    ).chart
    c = chart.capacities
    assert (c.queue, c.internal, c.delayed, c.microsteps, c.tick) == (3, 4, 0, 7, 100)
    assert chart.transitions[1].delay == 10
