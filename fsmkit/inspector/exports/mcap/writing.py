"""A log of channels (mcap.dev): JSON, a schema for each kind of message.

``/MACHINE/state``, ``/MACHINE/events``, ``/MACHINE/values``, and ``/log`` in the form of
``foxglove.Log``.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any, BinaryIO

from fsmkit.inspector.exports import Scene, active_of, missing, values_of
from fsmkit.runtime.live.messages import AnyMessage, Lost, Post, Set, Step

TEXT = {"type": "string"}
SCHEMAS: dict[str, dict[str, Any]] = {
    "fsmkit.State": {"state": TEXT, "active": {"type": "array", "items": TEXT}},
    "fsmkit.Event": {"event": TEXT, "cause": TEXT, "do": {"type": "array"}},
    "fsmkit.Values": {},
    "foxglove.Log": {
        "timestamp": {
            "type": "object",
            "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}},
        },
        "level": {"type": "integer"},
        "message": TEXT,
        "name": TEXT,
        "file": TEXT,
        "line": {"type": "integer"},
    },
}
WARNING, INFO = 3, 2
"""Levels of ``foxglove.Log``."""


def write(messages: Iterable[AnyMessage], out: BinaryIO) -> None:
    """Write messages as they arrive."""
    try:
        from mcap.writer import Writer
    except ImportError as error:
        raise missing("mcap", "MCAP", error) from error
    scene, writer = Scene(), Writer(out)
    writer.start(library="fsmkit")
    channels = _Channels(writer)
    for message in messages:
        scene.take(message)
        _put(channels, scene, message)
    writer.finish()


class _Channels:
    """Channels, created at their first use."""

    def __init__(self, writer: Any) -> None:
        self._writer = writer
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}

    def add(self, topic: str, schema: str, at: int, content: Mapping[str, object]) -> None:
        """Write a message; ``at``: microseconds."""
        if schema not in self._schemas:
            text = {"type": "object", "title": schema, "properties": SCHEMAS[schema]}
            self._schemas[schema] = self._writer.register_schema(
                schema, "jsonschema", json.dumps(text).encode()
            )
        if topic not in self._channels:
            self._channels[topic] = self._writer.register_channel(
                topic, "json", self._schemas[schema]
            )
        data = json.dumps(content).encode()
        self._writer.add_message(self._channels[topic], at * 1_000, data, at * 1_000)

    def log(self, at: int, level: int, name: str, text: str) -> None:
        """Write a line of the log."""
        stamp = {"sec": at // 1_000_000, "nsec": at % 1_000_000 * 1_000}
        line = {"timestamp": stamp, "level": level, "message": text, "name": name}
        self.add("/log", "foxglove.Log", at, {**line, "file": "", "line": 0})


def _put(channels: _Channels, scene: Scene, one: AnyMessage) -> None:
    if isinstance(one, Lost):
        at = scene.microseconds(one.at)
        channels.log(at, WARNING, one.m, f"lost: {one.count} ({one.where})")
        for machine in scene.hashes if not one.m else [one.m]:
            channels.add(f"/{machine}/state", "fsmkit.State", at, {"state": "?", "active": []})
        return
    machine = getattr(one, "m", "")
    if not machine or machine not in scene.hashes:
        return
    at = scene.microseconds(getattr(one, "at", 0))
    on = active_of(one)
    if on is not None:
        leaves = scene.leaves(machine, on)
        state = {"state": " ".join(leaves), "active": leaves}
        channels.add(f"/{machine}/state", "fsmkit.State", at, state)
    if isinstance(one, Step):
        event = str(one.cause[1]) if one.cause[0] in ("event", "delayed") else ""
        cause = " ".join(map(str, one.cause))
        told = {"event": event, "cause": cause, "do": _plain(one.do)}
        channels.add(f"/{machine}/events", "fsmkit.Event", at, told)
        for row in one.do:
            if row[0] in ("log", "fault", "full", "error"):
                text = " ".join(map(str, row))
                channels.log(at, INFO if row[0] == "log" else WARNING, machine, text)
    if isinstance(one, Post) and one.how == "refused":
        channels.log(at, WARNING, machine, f"refused: {one.event[0]}")
    values = dict(one.inputs) if isinstance(one, Set) else dict(values_of(one))
    if values:
        channels.add(f"/{machine}/values", "fsmkit.Values", at, values)


def _plain(rows: Iterable[list[Any]]) -> list[list[Any]]:
    """Return rows as JSON; steps of invoked machines are reduced to their names."""
    return [[part if _is_json(part) else "..." for part in row] for row in rows]


def _is_json(part: object) -> bool:
    return isinstance(part, str | int | float | bool | list | dict) or part is None
