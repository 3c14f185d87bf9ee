"""Parse typed words into fields of commands, for the shell and the console of an editor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fsmkit.chart.chart import Chart, result_types
from fsmkit.diagnostics import Text
from fsmkit.emit import plain
from fsmkit.runtime.live.values import to_json
from fsmkit.runtime.script import read_event, read_input, read_results, wrong_line


def event_given(chart: Chart, words: Sequence[str], line: Text) -> tuple[str, dict[str, Any]]:
    """Return the name of an event and its payload, ``EVENT a=1 b=2``.

    `FsmkitError` at the line for an event or a payload that there is not.
    """
    found = read_event(chart, iter(words), line)
    event = chart.events[found.event]
    values = zip(event.fields, found.payload, strict=True)
    return plain(event.name), {plain(f.name): to_json(value, f.type) for f, value in values}


def input_given(chart: Chart, words: Sequence[str], line: Text) -> tuple[str, Any]:
    """Return the name and value of an input, ``INPUT VALUE``.

    Raises `FsmkitError` at the line for an unknown input, an invalid value and extra words.
    """
    rest = iter(words)
    place, value = read_input(chart, rest, line)
    if (more := next(rest, None)) is not None:
        raise wrong_line(line, f"`{more}` is one word too many", "write `set INPUT VALUE`")
    declared = chart.inputs[place]
    return plain(declared.name), to_json(value, declared.type)


def results_given(chart: Chart, words: Sequence[str], line: Text) -> tuple[str, list[Any]]:
    """Return the name of an operation and its results, ``OPERATION returns V1, V2``.

    `FsmkitError` at the line for an operation or a value that there is not.
    """
    name, values = read_results(chart, iter((*words[:1], *words[2:])), line)
    type_ = result_types(chart)[name]
    return plain(name), [to_json(value, type_) for value in values]


def format_value(value: Any) -> str:
    """Return a value of the protocol as people read it."""
    match value:
        case bool():
            return "true" if value else "false"
        case {"int": text} | {"float": text} if len(value) == 1:
            return str(text)
        case list():
            return f"[{' '.join(map(format_value, value))}]"
        case dict():
            return f"[{' '.join(f'{k}={format_value(v)}' for k, v in value.items())}]"
        case _:
            return str(value)
