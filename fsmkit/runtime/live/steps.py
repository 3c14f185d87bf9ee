"""Macrosteps and snapshots as messages."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, TypeVar, assert_never

from msgspec import UNSET, UnsetType

from fsmkit.chart.chart import Chart, Data
from fsmkit.language import Value
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.runtime.interpreter import snapshot as effects
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter.trace import active_leaves
from fsmkit.runtime.live.messages import Json, Part, Row, State, Step
from fsmkit.runtime.live.values import to_json

T = TypeVar("T")
HASH = 16
"""Digits of the hash of a chart: 8 bytes, as in the head of saved machines."""


def hash_of(chart: Chart) -> str:
    """Return the hash by which a chart is known: places and comments do not count."""
    return fingerprint(chart)[:HASH]


def step_of(chart: Chart, machine: str, n: int, macrostep: snap.Macrostep) -> Step:
    """Return a macrostep as a message; ``n``: its number in the session."""
    before, after = macrostep.before, macrostep.after
    variables = (*chart.data, *chart.outputs)
    changed = zip(variables, before.data, after.data, strict=True)
    values = {v.name: to_json(new, v.type) for v, old, new in changed if not _is_same(old, new)}
    status, fault = status_of(after), after.fault
    timers = (timers_of(chart, before.timers), timers_of(chart, after.timers))
    return Step(
        m=machine,
        n=n,
        at=macrostep.at,
        cause=cause_of(chart, macrostep.event),
        do=[row for effect in macrostep.effects for row in rows_of(chart, effect)],
        on=_new(active_leaves(chart, before), active_leaves(chart, after)),
        set=values or UNSET,
        timers=_new(*timers),
        queue=_new(*(rows_of_queue(chart, each.queue) for each in (before, after))),
        deferred=_new(*(rows_of_queue(chart, each.deferred) for each in (before, after))),
        status=_new(status_of(before), status),
        fault=UNSET if fault is None else fault,
    )


def _is_same(old: Value, new: Value) -> bool:
    """Whether nothing changed; unlike ``==``, of a float that is no number, and of zeros."""
    return old is new or (old == new and repr(old) == repr(new))


def _new(old: T, new: T) -> T | UnsetType:
    return UNSET if old == new else new


def state_of(chart: Chart, machine: str, n: int, snapshot: snap.Snapshot, at: int) -> State:
    """Return all of a machine as a message."""
    count = len(chart.data)
    return State(
        m=machine,
        n=n,
        at=at,
        on=[chart.states[state].id for state in sorted(snapshot.configuration - {0})],
        data=_by_name(chart.data, snapshot.data[:count]),
        inputs=_by_name(chart.inputs, snapshot.inputs),
        outputs=_by_name(chart.outputs, snapshot.data[count:]),
        queue=rows_of_queue(chart, snapshot.queue),
        deferred=rows_of_queue(chart, snapshot.deferred),
        timers=timers_of(chart, snapshot.timers),
        status=status_of(snapshot),
        fault=snapshot.fault or "",
        invoked={
            invocation.id: active_leaves(invocation.chart, child)
            for invocation, child in zip(chart.invocations, snapshot.invoked, strict=True)
            if child is not None
        },
    )


def _by_name(variables: Sequence[Data], values: Sequence[Value]) -> dict[str, Json]:
    return {v.name: to_json(value, v.type) for v, value in zip(variables, values, strict=True)}


def status_of(snapshot: snap.Snapshot) -> str:
    """Return ``before`` the start, ``running``, ``finished`` or ``fault``."""
    if snapshot.running:
        return "running"
    if snapshot.fault is not None:
        return "fault"
    return "finished" if snapshot.finished else "before"


def timers_of(chart: Chart, timers: Iterable[snap.Timer]) -> list[tuple[int | str, int]]:
    """Return each timer (a transition's number or a delayed event's name) with its deadline."""
    return [(_due(chart, timer), timer.deadline) for timer in timers]


def _due(chart: Chart, timer: snap.Timer) -> int | str:
    if isinstance(timer.what, snap.Timeout):
        return timer.what.transition
    return chart.events[timer.what.occurrence.event].name


def rows_of_queue(chart: Chart, queue: Iterable[snap.Occurrence]) -> list[Row]:
    """Return events with their payload."""
    return [row_of_event(chart, occurrence) for occurrence in queue]


def row_of_event(chart: Chart, occurrence: snap.Occurrence) -> Row:
    """Return the name of an event and the values of its fields."""
    event = chart.events[occurrence.event]
    fields = zip(event.fields, occurrence.payload, strict=True)
    return [event.name, *(to_json(value, field.type) for field, value in fields)]


def cause_of(chart: Chart, cause: snap.Cause) -> Row:
    """Return the words of a trace's first line; for a cause without one, the word ``within``."""
    match cause:
        case snap.Start():
            return ["start"]
        case snap.Occurrence() as occurrence:
            return ["event", *row_of_event(chart, occurrence)]
        case snap.Delayed(occurrence):
            return ["delayed", *row_of_event(chart, occurrence)]
        case snap.Timeout(transition):
            return ["timeout", transition]
        case None:
            return ["eventless"]
        case snap.InvokedRun():
            return ["within"]
        case snap.Cancellation():
            return ["cancelled"]
        case _:
            assert_never(cause)


def rows_of(chart: Chart, effect: snap.Effect) -> list[Row]:
    """Return the words of an effect's line, values as JSON; empty if a trace omits the effect."""
    match effect:
        case effects.Exited(state):
            return [["-", chart.states[state].id]]
        case effects.Taken(transition):
            return [["t", transition]]
        case effects.Entered(state):
            return [["+", chart.states[state].id]]
        case effects.Called(operation, arguments, result):
            return [_call(chart, operation, arguments, result)]
        case effects.Emitted(occurrence, None):
            return [["out", *row_of_event(chart, occurrence)]]
        case effects.Emitted(occurrence, peer):
            return [["out to", peer, *row_of_event(chart, occurrence)]]
        case effects.Raised(occurrence):
            return [["raise", *row_of_event(chart, occurrence)]]
        case effects.Sent(occurrence):
            return [["send", *row_of_event(chart, occurrence)]]
        case effects.Postponed(what, delay):
            return [["delay", delay, *row_of_event(chart, what.occurrence)]]
        case effects.Cancelled(name):
            return [["cancel", name]]
        case effects.Logged(label, values):
            return [["log", label, *map(to_json, values)]]
        case effects.Replied(value):
            return [["reply", to_json(value)]]
        case effects.RaisedError(name):
            return [["error", name]]
        case effects.Unhandled(event):
            return [["unhandled", chart.events[event].name]]
        case effects.Overflowed(queue):
            return [["full", queue]]
        case effects.Faulted(reason):
            return [["fault", reason]]
        case effects.InvokedMacrostep(slot, within):
            invocation = chart.invocations[slot]
            return [["in", invocation.id, part_of(invocation.chart, within)]]
        case effects.Posted(occurrence, fits):
            return [["post" if fits else "reject", *row_of_event(chart, occurrence)]]
        case effects.Deferred(event):
            return [["deferred", chart.events[event].name]]
        case effects.SpentTimeout(transition):
            return [["spent", transition]]
        case _:
            assert_never(effect)


def part_of(chart: Chart, macrostep: snap.Macrostep) -> Part:
    """Return the part of a step that an invoked machine took."""
    finished = ["finished"] if macrostep.after.finished else []
    return Part(
        at=macrostep.at,
        cause=cause_of(chart, macrostep.event),
        do=[row for effect in macrostep.effects for row in rows_of(chart, effect)],
        on=active_leaves(chart, macrostep.after) + finished,
    )


def _call(
    chart: Chart, operation: str, arguments: tuple[Value, ...], result: Value | None
) -> list[Any]:
    """Return a call; with a result: the result, the word ``=`` before it."""
    declared = next(each for each in chart.operations if each.name == operation)
    typed = zip(declared.parameters, arguments, strict=True)
    row = ["op", operation, *(to_json(value, parameter.type) for parameter, value in typed)]
    return row if result is None else [*row, "=", to_json(result, declared.result)]
