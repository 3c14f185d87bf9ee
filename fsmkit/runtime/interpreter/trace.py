"""Format macrosteps as trace lines, equal on the interpreter and all targets.

Differential tests compare these lines, so a line holds only facts that every runtime knows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import assert_never

from fsmkit.chart.chart import Chart
from fsmkit.language import Value
from fsmkit.runtime.interpreter import snapshot as effects
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter.index import index_of

CLOCK = 2**32
"""Times in traces are modulo this, as in the 32 bits of a generated machine."""


def trace_lines(chart: Chart, macrosteps: Iterable[snap.Macrostep]) -> Iterator[str]:
    """Yield the lines of macrosteps, in order of execution.

    A delayed event that only moves into the queue has no first and last line. The lines of an
    invoked machine are prefixed with the id of its invocation.
    """
    for macrostep in macrosteps:
        is_whole = not isinstance(
            macrostep.event, snap.Delayed | snap.InvokedRun | snap.Cancellation
        )
        if is_whole:
            yield f"@{macrostep.at % CLOCK} > {_cause(chart, macrostep.event)}"
        for effect in macrostep.effects:
            if isinstance(effect, effects.InvokedMacrostep):
                invocation = chart.invocations[effect.invocation]
                for line_of_child in trace_lines(invocation.chart, (effect.macrostep,)):
                    yield f"{invocation.id}: {line_of_child}"
                continue
            line = effect_line(chart, effect)
            if line is not None:
                yield line
        if is_whole:
            yield configuration_line(chart, macrostep.after)


def dump_lines(chart: Chart, snapshot: snap.Snapshot) -> Iterator[str]:
    """Yield ``d NAME VALUE`` for each data and output, in order; then of invoked machines."""
    for variable, value in zip((*chart.data, *chart.outputs), snapshot.data, strict=True):
        yield f"d {variable.name} {value_text(value)}"
    for invocation, child in zip(chart.invocations, snapshot.invoked, strict=True):
        if child is not None:
            for line in dump_lines(invocation.chart, child):
                yield f"{invocation.id}: {line}"


def active_leaves(chart: Chart, snapshot: snap.Snapshot) -> list[str]:
    """Return the ids of the active atomic states, in document order."""
    leaves = sorted(index_of(chart).leaves & snapshot.configuration)
    return [chart.states[state].id for state in leaves]


def configuration_line(chart: Chart, snapshot: snap.Snapshot) -> str:
    """Return the active atomic states in document order, and whether the machine is finished."""
    names = active_leaves(chart, snapshot)
    return " ".join(("=", *names, *(("finished",) if snapshot.finished else ())))


def effect_line(chart: Chart, effect: snap.Effect) -> str | None:
    """Return the line of an effect, or None for effects that a trace omits."""
    match effect:
        case effects.Exited(state):
            return f"- {chart.states[state].id}"
        case effects.Taken(transition):
            return f"t {transition}"
        case effects.Entered(state):
            return f"+ {chart.states[state].id}"
        case effects.Posted(occurrence, fits):
            return f"{'post' if fits else 'reject'} {event_text(chart, occurrence)}"
        case effects.Called(operation, arguments, result):
            tail = () if result is None else ("=", value_text(result))
            return " ".join(("op", operation, *map(value_text, arguments), *tail))
        case effects.Emitted(occurrence, peer):
            tail = () if peer is None else ("to", peer)
            return " ".join(("out", event_text(chart, occurrence), *tail))
        case effects.Raised(occurrence):
            return f"raise {event_text(chart, occurrence)}"
        case effects.Sent(occurrence):
            return f"send {event_text(chart, occurrence)}"
        case effects.Postponed(what, delay):
            return f"delay {event_text(chart, what.occurrence)} in {delay}"
        case effects.Cancelled(name):
            return f"cancel {name}"
        case effects.Logged(label, values):
            return " ".join(("log", label, *map(value_text, values)))
        case effects.Replied(value):
            return f"reply {value_text(value)}"
        case effects.RaisedError(name):
            return f"error {name}"
        case effects.Unhandled(event):
            return f"unhandled {chart.events[event].name}"
        case effects.Overflowed(queue):
            return f"full {queue}"
        case effects.Faulted(reason):
            return f"fault {reason}"
        case effects.Deferred() | effects.SpentTimeout() | effects.InvokedMacrostep():
            return None
        case _:
            assert_never(effect)


def texts_of(values: tuple[Value, ...], of_other: Callable[[Value], str]) -> list[str]:
    """Return the texts of the elements of an array; machines may share thousands of flags."""
    return ["1" if v is True else "0" if v is False else of_other(v) for v in values]


def value_text(value: Value) -> str:
    """Return a value as traces and scripts write it, the same in every runtime."""
    match value:
        case bool():
            return str(int(value))
        case int():
            return str(value)
        case float():
            return f"{value:.17g}"
        case str():
            return f'"{value}"'
        case tuple():
            return f"[{' '.join(texts_of(value, value_text))}]"
        case _:
            assert_never(value)


def _cause(chart: Chart, event: snap.Cause) -> str:
    match event:
        case snap.Start():
            return "start"
        case snap.Occurrence():
            return f"event {event_text(chart, event)}"
        case snap.Timeout(transition):
            return f"timeout {transition}"
        case snap.Delayed(occurrence):
            return f"event {event_text(chart, occurrence)}"
        case None:
            return "eventless"
        case snap.InvokedRun() | snap.Cancellation():
            return ""
        case _:
            assert_never(event)


def event_text(chart: Chart, occurrence: snap.Occurrence) -> str:
    """Return an event and its payload, as traces and scripts write them."""
    name = chart.events[occurrence.event].name
    return " ".join((name, *map(value_text, occurrence.payload)))
