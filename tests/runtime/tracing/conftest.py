"""A chart that has records of all kinds, and how Hypothesis makes them."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import strategies as st

import fsmkit.language as lang
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, Source
from fsmkit.document.front_ends import FrontEnd
from fsmkit.plugins import plugin
from fsmkit.runtime.tracing.numbering import Numbering
from fsmkit.runtime.tracing.records import (
    MODULUS,
    End,
    EventRecord,
    InputRecord,
    Instance,
    Lost,
    Note,
    Record,
    RestoreRecord,
    ResultRecord,
    SnapshotRecord,
    StartRecord,
    Sync,
    TimeRecord,
    TransitionRecord,
)

TEXT = """
chart: Kinds
types:
  Hue: [red, green]
  Spot: {x: int16, at: float64, hue: Hue}
events:
  in:
    - all(a bool, b -5..5, c uint16, d int64, e float32, f Hue, g duration, h symbol, i Spot)
    - go
inputs: {dark: bool, level: int32, spots: "int16[2]"}
operations: [read() -> uint8, mark(), place() -> Spot]
data: {n: uint8 = 0, s: symbol = "known"}
initial: idle
states:
  idle: {on: {go: busy, all: {do: n = read()}}}
  busy:
    regions:
      one: {initial: a, states: {h: {history: shallow, default: a}, a: {on: {go: b}}, b: {}}}
      two: {initial: c, states: {c: {on: {go: d}}, d: {}}}
    on: {all: idle}
    after: {5ms: idle}
"""


def read_chart(text: str) -> Any:
    """Return the chart of a text."""
    findings = Findings()
    document = plugin(FrontEnd, "yaml").read(Source("kinds.yaml", text), findings)
    findings.stop_on_errors()
    assert document is not None
    chart = elaborate((document,), findings)
    findings.stop_on_errors()
    return chart


NUMBERING = Numbering(read_chart(TEXT))


@pytest.fixture(scope="session")
def numbering() -> Numbering:
    """Give the numbering of the chart."""
    return NUMBERING


def values(type_: lang.Type) -> st.SearchStrategy[Any]:
    """Make values of a type."""
    match type_:
        case lang.BoolType():
            return st.booleans()
        case lang.IntType(lo, hi):
            return st.integers(lo, hi)
        case lang.EnumType(_, members):
            return st.integers(0, len(members) - 1)
        case lang.FloatType(bits):
            return st.floats(width=32 if bits == 32 else 64, allow_nan=False)
        case lang.DurationType():
            return st.integers(0, lang.LONGEST_DURATION)
        case lang.SymbolType():
            return st.sampled_from(["", "known"])
        case lang.ArrayType(element, length):
            return st.tuples(*[values(element)] * length)
        case lang.RecordType(_, fields):
            return st.tuples(*(values(field.type) for field in fields))
        case _:
            raise AssertionError(type_)


U32 = st.integers(0, MODULUS - 1)


def records(numbering: Numbering) -> st.SearchStrategy[Record]:
    """Make records of all kinds."""
    chart, plan = numbering.chart, numbering.images[0].plan
    numbers = st.tuples(*(st.integers(0, last) for last in numbering.greatest))
    events = [
        st.builds(
            EventRecord,
            st.just(event.index),
            st.tuples(*(values(field.type) for field in event.fields)),
            st.booleans(),
        )
        for event in chart.events
    ]
    inputs = [
        st.builds(InputRecord, st.just(place), values(each.type))
        for place, each in enumerate(chart.inputs)
    ]
    results = [
        st.builds(ResultRecord, st.just(machine), st.just(o.name), values(o.result))
        for machine, o in numbering.results
        if o.result is not None
    ]
    assert plan is not None
    return st.one_of(
        st.builds(TimeRecord, st.integers(1, MODULUS - 1)),
        st.builds(Lost, U32),
        st.builds(Note, U32),
        st.builds(SnapshotRecord, st.binary(max_size=400)),
        st.just(End()),
        st.just(RestoreRecord()),
        syncs(numbering, numbers),
        st.sampled_from([TransitionRecord(*pair) for pair in numbering.transitions]),
        st.sampled_from([StartRecord(m) for m in range(len(numbering.machines))]),
        *events,
        *inputs,
        *results,
    )


def syncs(
    numbering: Numbering, numbers: st.SearchStrategy[tuple[int, ...]] | None = None
) -> st.SearchStrategy[Sync]:
    """Make syncs of instance 0."""
    if numbers is None:
        numbers = st.tuples(*(st.integers(0, last) for last in numbering.greatest))
    return st.builds(
        Sync,
        st.just(numbering.hash),
        U32,
        st.just(0),
        st.integers(0, 7),
        st.integers(0, 5),
        numbers,
    )


__all__ = ["NUMBERING", "TEXT", "Instance", "read_chart", "records", "syncs"]
