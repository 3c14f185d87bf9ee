"""Convert messages to trace lines; tests compare them with the trace itself."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from msgspec import UnsetType

from fsmkit.chart.chart import Chart
from fsmkit.language import Field, Type, Value
from fsmkit.runtime.interpreter.trace import CLOCK, value_text
from fsmkit.runtime.live.messages import Json, Part, Row, Step
from fsmkit.runtime.live.values import from_json

OMITTED = ("deferred", "spent")
WITHIN = ("delayed", "within", "cancelled")
"""Causes of macrosteps without a first and a last line."""


def lines_of(chart: Chart, step: Step, before: Sequence[str]) -> Iterator[str]:
    """Yield the lines of a step, as `trace_lines` does; ``before``: the previous active states."""
    on = before if isinstance(step.on, UnsetType) else step.on
    finished = ("finished",) if step.status == "finished" else ()
    yield from _lines(chart, step.at, step.cause, step.do, (*on, *finished))


def _lines(
    chart: Chart, at: int, cause: Row, do: Sequence[Row], on: Sequence[str]
) -> Iterator[str]:
    is_whole = cause[0] not in WITHIN
    if is_whole:
        yield f"@{at % CLOCK} > {_cause(chart, cause)}"
    for row in do:
        yield from _row(chart, row)
    if is_whole:
        yield " ".join(("=", *on))


def _cause(chart: Chart, cause: Row) -> str:
    match cause:
        case ["event", *event]:
            return f"event {_event(chart, event)}"
        case _:
            return " ".join(map(str, cause))


def _row(chart: Chart, row: Row) -> Iterator[str]:
    match row:
        case [("out" | "raise" | "send" | "post" | "reject") as word, *event]:
            yield f"{word} {_event(chart, event)}"
        case ["out to", peer, *event]:
            yield f"out {_event(chart, event)} to {peer}"
        case ["delay", delay, *event]:
            yield f"delay {_event(chart, event)} in {delay}"
        case ["op", name, *values]:
            yield _call(chart, name, values)
        case ["in", name, part]:
            chart = next(each.chart for each in chart.invocations if each.id == name)
            part = part if isinstance(part, Part) else Part(**part)
            for line in _lines(chart, part.at, part.cause, part.do, part.on):
                yield f"{name}: {line}"
        case ["log", label, *values]:
            yield " ".join(("log", label, *map(_plain, values)))
        case ["reply", value]:
            yield f"reply {_plain(value)}"
        case [word, *_] if word in OMITTED:
            pass
        case _:
            yield " ".join(map(str, row))


def _event(chart: Chart, row: Row) -> str:
    name, *values = row
    event = chart.events[chart.event_index[name]]
    return " ".join((name, *_values(event.fields, values)))


def _call(chart: Chart, name: str, values: Sequence[Json]) -> str:
    declared = next(each for each in chart.operations if each.name == name)
    count = len(declared.parameters)
    words = ["op", name, *_values(declared.parameters, values[:count])]
    if declared.result is not None:
        words += ["=", value_text(from_json(values[count + 1], declared.result))]
    return " ".join(words)


def _values(fields: Sequence[Field], values: Sequence[Json]) -> Iterator[str]:
    types: Iterator[Type] = (field.type for field in fields)
    return (value_text(from_json(v, type_)) for v, type_ in zip(values, types, strict=True))


def _plain(value: Json) -> str:
    return value_text(_untyped(value))


def _untyped(value: Json) -> Value:
    match value:
        case {"int": digits}:
            return int(digits)
        case {"float": word}:
            return float(word)
        case list():
            return tuple(map(_untyped, value))
        case bool() | int() | float() | str():
            return value
        case _:
            raise ValueError(f"is not a value: {value!r}")
