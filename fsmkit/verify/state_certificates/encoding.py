"""The canonical JSON form of the state of one machine."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, assert_never

from fsmkit.chart.statements import Destination
from fsmkit.language import Value
from fsmkit.runtime.interpreter import snapshot as snap


def json_line(value: object) -> str:
    """Return a value as one line of JSON without blanks."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False)


def encode(snapshot: snap.Snapshot) -> dict[str, Any]:
    """Return a settled machine as data for JSON; keys with default values are absent.

    States, events and transitions are their numbers in the chart.
    """
    found: dict[str, Any] = {"active": sorted(snapshot.configuration), "data": snapshot.data}
    more: dict[str, Any] = {
        "inputs": tuple(snapshot.inputs),
        "history": [[state, sorted(kept)] for state, kept in snapshot.history],
        "queue": [_event(occurrence) for occurrence in snapshot.queue],
        "deferred": [_event(occurrence) for occurrence in snapshot.deferred],
        "timers": [_timer(timer) for timer in snapshot.timers],
        "fault": snapshot.fault,
        "invoked": [None if child is None else encode(child) for child in snapshot.invoked],
    }
    found |= {key: value for key, value in more.items() if value}
    found |= {} if snapshot.running else {"stopped": "finished" if snapshot.finished else "fault"}
    return found


def _event(occurrence: snap.Occurrence) -> list[Any]:
    return [occurrence.event, *occurrence.payload]


def _timer(timer: snap.Timer) -> list[Any]:
    match timer.what:
        case snap.Timeout(transition):
            return [timer.deadline, transition]
        case snap.Delayed() as sent:
            where = [sent.destination.value, sent.id, sent.peer, sent.invocations]
            return [timer.deadline, _event(sent.occurrence), *where]
        case _ as never:
            assert_never(never)


def decode(data: Any) -> snap.Snapshot:
    """Return the machine that `encode` wrote.

    Raises `KeyError`, `TypeError`, `ValueError` or `IndexError` for other data.
    """
    return snap.Snapshot(
        frozenset(data["active"]),
        _values(data["data"]),
        _values(data.get("inputs", ())),
        tuple((state, frozenset(kept)) for state, kept in data.get("history", ())),
        tuple(map(_occurrence, data.get("queue", ()))),
        tuple(map(_occurrence, data.get("deferred", ()))),
        tuple(map(_decoded_timer, data.get("timers", ()))),
        running="stopped" not in data,
        finished=data.get("stopped") == "finished",
        fault=data.get("fault"),
        invoked=tuple(None if each is None else decode(each) for each in data.get("invoked", ())),
    )


def _values(values: Sequence[Any]) -> tuple[Value, ...]:
    return tuple(_values(each) if isinstance(each, list) else each for each in values)


def _occurrence(data: Sequence[Any]) -> snap.Occurrence:
    event, *payload = data
    return snap.Occurrence(event, _values(payload))


def _decoded_timer(data: Sequence[Any]) -> snap.Timer:
    deadline, what, *sent = data
    if not sent:
        return snap.Timer(deadline, snap.Timeout(what))
    destination, name, peer, invocations = sent
    return snap.Timer(
        deadline,
        snap.Delayed(_occurrence(what), Destination(destination), name, peer, tuple(invocations)),
    )
