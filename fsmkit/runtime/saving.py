"""Snapshots as plain data for JSON: names instead of indices, and the hash of the chart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fsmkit.chart.chart import Chart, Data
from fsmkit.chart.statements import Destination
from fsmkit.language import Field, Value
from fsmkit.language.values import from_python, to_python
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.plan.image import image_of
from fsmkit.runtime.interpreter import Delayed, Occurrence, Snapshot, Timeout, Timer
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.runtime.snapshot_bytes import damaged, foreign, require_possible

__all__ = ["fingerprint", "restore", "save"]

FORMAT = 1


def save(chart: Chart, snapshot: Snapshot) -> dict[str, Any]:
    """Return a snapshot as data that `json` can write; timers with the time they have left."""
    head = {"fsmkit": FORMAT, "chart": chart.name, "hash": fingerprint(chart)}
    return {**head, **_save(chart, snapshot, snapshot.now)}


def _save(chart: Chart, snapshot: Snapshot, now: int) -> dict[str, Any]:
    """Save a machine; invoked machines have its time and follow in the order of their slots."""
    variables = (*chart.data, *chart.outputs)
    invoked = [
        None if child is None else _save(invocation.chart, child, now)
        for invocation, child in zip(chart.invocations, snapshot.invoked, strict=True)
    ]
    return {
        "configuration": _ids(chart, snapshot.configuration),
        "data": _values(variables, snapshot.data),
        "inputs": _values(chart.inputs, snapshot.inputs),
        "history": {
            chart.states[state].id: _ids(chart, recorded) for state, recorded in snapshot.history
        },
        "queue": [_save_event(chart, occurrence) for occurrence in snapshot.queue],
        "deferred": [_save_event(chart, occurrence) for occurrence in snapshot.deferred],
        "timers": [_save_timer(chart, timer, now) for timer in snapshot.timers],
        "running": snapshot.running,
        "finished": snapshot.finished,
        "fault": snapshot.fault,
        **({"invoked": invoked} if invoked else {}),
    }


def restore(chart: Chart, saved: Mapping[str, Any], now: int) -> Snapshot:
    """Return the snapshot that was saved; `FsmkitError` for another chart's or a broken one."""
    if saved.get("fsmkit") != FORMAT or saved.get("hash") != fingerprint(chart):
        raise foreign(chart)
    try:
        return _restore(chart, saved, now)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise damaged(chart, error) from error


def _restore(chart: Chart, saved: Mapping[str, Any], now: int) -> Snapshot:
    active = _indices(chart, saved["configuration"])
    unread = {h for state in active for h in index_of(chart).forgotten[state]}
    history = ((chart.state_index[name], ids) for name, ids in saved["history"].items())
    invoked = zip(chart.invocations, saved.get("invoked", ()), strict=True)
    found = Snapshot(
        configuration=active,
        data=_read(_declared((*chart.data, *chart.outputs)), saved["data"]),
        inputs=_read(_declared(chart.inputs), saved["inputs"]),
        history=tuple(
            sorted((state, _indices(chart, ids)) for state, ids in history if state not in unread)
        ),
        queue=tuple(_restore_event(chart, event) for event in saved["queue"]),
        deferred=tuple(_restore_event(chart, event) for event in saved["deferred"]),
        timers=tuple(_restore_timer(chart, timer, now) for timer in saved["timers"]),
        now=now,
        running=bool(saved["running"]),
        finished=bool(saved["finished"]),
        fault=None if saved["fault"] is None else str(saved["fault"]),
        invoked=tuple(
            None if child is None else _restore(invocation.chart, child, now)
            for invocation, child in invoked
        ),
    )
    require_possible(image_of(chart), found)
    return found


def _ids(chart: Chart, states: frozenset[int]) -> list[str]:
    return [chart.states[state].id for state in sorted(states)]


def _indices(chart: Chart, ids: Sequence[str]) -> frozenset[int]:
    return frozenset(chart.state_index[name] for name in ids)


def _declared(variables: Sequence[Data]) -> tuple[Field, ...]:
    return tuple(Field(variable.name, variable.type) for variable in variables)


def _values(variables: Sequence[Data], values: tuple[Value, ...]) -> dict[str, object]:
    return {
        variable.name: to_python(value, variable.type)
        for variable, value in zip(variables, values, strict=True)
    }


def _read(declared: Sequence[Field], saved: Mapping[str, object]) -> tuple[Value, ...]:
    return tuple(from_python(saved[field.name], field.type) for field in declared)


def _save_event(chart: Chart, occurrence: Occurrence) -> dict[str, object]:
    event = chart.events[occurrence.event]
    values = zip(event.fields, occurrence.payload, strict=True)
    slot = event.invocation  # events of several invocations may have one name
    return {
        "event": event.name,
        **({} if slot is None else {"invocation": slot}),
        "fields": {field.name: to_python(value, field.type) for field, value in values},
    }


def _restore_event(chart: Chart, saved: Mapping[str, Any]) -> Occurrence:
    name, slot = saved["event"], saved.get("invocation")
    event = next((e for e in chart.events if (e.name, e.invocation) == (name, slot)), None)
    if event is None:
        raise KeyError(name)
    return Occurrence(event.index, _read(event.fields, saved["fields"]))


def _save_timer(chart: Chart, timer: Timer, now: int) -> dict[str, object]:
    left = timer.deadline - now
    if isinstance(timer.what, Timeout):
        return {"left": left, "transition": timer.what.transition}
    slots = list(timer.what.invocations)
    return {
        "left": left,
        **_save_event(chart, timer.what.occurrence),
        "destination": timer.what.destination.value,
        "id": timer.what.id,
        "peer": timer.what.peer,
        **({"invocations": slots} if slots else {}),
    }


def _restore_timer(chart: Chart, saved: Mapping[str, Any], now: int) -> Timer:
    deadline = now + int(saved["left"])
    if "transition" in saved:
        return Timer(deadline, Timeout(chart.transitions[saved["transition"]].index))
    occurrence = _restore_event(chart, saved)
    destination = Destination(saved["destination"])
    slots = tuple(chart.invocations[slot].index for slot in saved.get("invocations", ()))
    return Timer(deadline, Delayed(occurrence, destination, saved["id"], saved["peer"], slots))
