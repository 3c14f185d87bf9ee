"""Convert the arguments of commands: events, payloads, inputs and data of a chart."""

from __future__ import annotations

from typing import Any

from fsmkit.chart.chart import Chart, result_types
from fsmkit.diagnostics import fail
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.language import Type, Value
from fsmkit.runtime.interpreter.snapshot import Occurrence
from fsmkit.runtime.live.values import from_json
from fsmkit.runtime.script import is_received


def occurrence_of(chart: Chart, name: str, payload: dict[str, Any]) -> Occurrence:
    """Return an event with the given payload; raises `FsmkitError` for a mismatch."""
    event = chart.events[index_of_received_event(chart, name)]
    names = [each.name for each in event.fields]
    if set(payload) != set(names):
        takes = ", ".join(f"`{each}`" for each in names) or "no values"
        raise fail("wrong-value", f"the event `{name}` takes {takes}", help="give each once")
    return Occurrence(
        event.index,
        tuple(
            _value(payload[each.name], each.type, f"`{each.name}` of `{name}`")
            for each in event.fields
        ),
    )


def index_of_received_event(chart: Chart, name: str) -> int:
    """Return the index of an event that a machine receives; `FsmkitError` for none."""
    known = [event.name for event in chart.events if is_received(event)]
    _place_of(name, known, "event")
    return chart.event_index[name]


def input_of(chart: Chart, name: str, value: Any) -> tuple[int, Value]:
    """Return the index and value of an input; raises `FsmkitError` for a mismatch."""
    place = _place_of(name, [each.name for each in chart.inputs], "input")
    return place, _value(value, chart.inputs[place].type, f"the input `{name}`")


def results_of(chart: Chart, name: str, values: list[Any]) -> tuple[Value, ...]:
    """Return results for an operation.

    `FsmkitError`: ``unknown-name`` for the operation, ``wrong-value`` for a result.
    """
    types = result_types(chart)
    _place_of(name, list(types), "operation with a result")
    if not values:
        raise fail("wrong-value", f"no result is given for `{name}`")
    return tuple(_value(value, types[name], f"the result of `{name}`") for value in values)


def datum_of(chart: Chart, name: str, value: Any) -> tuple[int, Value]:
    """Return the index and value of a variable; raises `FsmkitError` for a mismatch."""
    place = _place_of(name, [each.name for each in chart.data], "datum")
    return place, _value(value, chart.data[place].type, f"`{name}`")


def _place_of(name: str, known: list[str], kind: str) -> int:
    if name not in known:
        help_ = suggest(name, known, f"use one of {', '.join(known[:8])}" if known else "")
        raise fail("unknown-name", f"there is no {kind} `{name}`", help=help_ or None)
    return known.index(name)


def _value(given: Any, type_: Type, what: str) -> Value:
    try:
        return from_json(given, type_)
    except ValueError as error:
        raise fail("wrong-value", f"{what} {error}") from error
