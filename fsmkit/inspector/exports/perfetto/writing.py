"""Tracks of slices (perfetto.dev): a track a region, a slice a state; events as instants.

Events from machine to machine are flows; the length of a queue is a counter.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, BinaryIO

from msgspec import UnsetType

from fsmkit.inspector.exports import Scene, missing
from fsmkit.runtime.live.messages import AnyMessage, Lost, Pass, State, Step

SEQUENCE = 1
"""The only writer of the packets."""
MONOTONIC = 3
"""``BUILTIN_CLOCK_MONOTONIC``."""


def write(messages: Iterable[AnyMessage], out: BinaryIO) -> None:
    """Write messages as they arrive; a trace is a sequence of packets."""
    try:
        from perfetto.protos.perfetto.trace import perfetto_trace_pb2 as protos
    except ImportError as error:
        raise missing("perfetto", "a trace of Perfetto", error) from error
    tracks = _Tracks(protos, out)
    for message in messages:
        tracks.scene.take(message)
        tracks.put(message)
    tracks.end()


class _Tracks:
    """Writes packets, and knows which slices are open."""

    def __init__(self, protos: Any, out: BinaryIO) -> None:
        self._protos, self._out = protos, out
        self.scene = Scene()
        self._uuids: dict[tuple[str, ...], int] = {}
        self._open: dict[tuple[str, ...], list[str]] = {}
        """By track: the states whose slices are open, outermost first."""
        self._flows = 0

    def put(self, one: AnyMessage) -> None:
        """Write a message."""
        match one:
            case Step():
                self._step(one)
            case State():
                at = self.scene.microseconds(one.at)
                self._close(one.m)
                for state in one.on:
                    self._begin(one.m, state, at)
                if one.known:
                    self._count(one.m, at, len(one.queue))
            case Lost():
                self.scene.microseconds(one.at)
                self._close(one.m)
                self._instant(("lost",), f"lost {one.count} ({one.where})", one.at)
            case Pass():
                self._flows += 1
                for machine, event in (one.source, one.target):
                    self._instant((machine, "events"), event, one.at, self._flows)
            case _:
                pass

    def end(self) -> None:
        """Close all open slices."""
        self._close("")

    def _step(self, one: Step) -> None:
        at = self.scene.microseconds(one.at)
        cause = " ".join(str(part) for part in one.cause[:2])
        self._instant((one.m, "events"), cause, one.at)
        for row in one.do:
            if row[0] == "-":
                self._end(one.m, str(row[1]), at)
            elif row[0] == "+":
                self._begin(one.m, str(row[1]), at)
        if not isinstance(one.queue, UnsetType):
            self._count(one.m, at, len(one.queue))

    # --- slices ---------------------------------------------------------------------------

    def _region(self, machine: str, state: str) -> tuple[str, ...]:
        """Return the track of a state: of the root, or of the nearest child of a parallel one."""
        chart = self.scene.chart(machine)
        states = {} if chart is None else {each["id"]: each for each in chart.states}
        place = states.get(state)
        while place is not None and place["parent"] is not None:
            above = states.get(place["parent"])
            if above is not None and above["kind"] == "parallel":
                return (machine, str(place["id"]))
            place = above
        return (machine, "states")

    def _begin(self, machine: str, state: str, at: int) -> None:
        track = self._region(machine, state)
        self._open.setdefault(track, []).append(state)
        self._event(track, "TYPE_SLICE_BEGIN", at, state)

    def _end(self, machine: str, state: str, at: int) -> None:
        track = self._region(machine, state)
        opened = self._open.get(track, [])
        while state in opened:
            opened.pop()
            self._event(track, "TYPE_SLICE_END", at)

    def _close(self, machine: str) -> None:
        """Close all slices of a machine, or of all."""
        for track, opened in self._open.items():
            while opened and machine in ("", track[0]):
                opened.pop()
                self._event(track, "TYPE_SLICE_END", self.scene.latest)

    # --- packets --------------------------------------------------------------------------

    def _instant(self, track: tuple[str, ...], name: str, at: int, flow: int = 0) -> None:
        self._event(track, "TYPE_INSTANT", self.scene.microseconds(at), name, flow=flow)

    def _count(self, machine: str, at: int, value: int) -> None:
        self._event((machine, "queue"), "TYPE_COUNTER", at, count=value)

    def _event(
        self, track: tuple[str, ...], kind: str, at: int, name: str = "", *, flow: int = 0,
        count: int | None = None,
    ) -> None:  # fmt: skip
        packet = self._packet()
        packet.timestamp = at * 1_000
        packet.timestamp_clock_id = MONOTONIC
        event = packet.track_event
        event.type = self._protos.TrackEvent.Type.Value(kind)
        event.track_uuid = self._uuid(track, is_counter=count is not None)
        if name:
            event.name = name
        if flow:
            event.flow_ids.append(flow)
        if count is not None:
            event.counter_value = count
        self._write(packet)

    def _uuid(self, track: tuple[str, ...], *, is_counter: bool = False) -> int:
        """Return the number of a track, which is described when it is used first."""
        if track not in self._uuids:
            parent = self._uuid(track[:-1]) if len(track) > 1 else None
            self._uuids[track] = len(self._uuids) + 1
            packet = self._packet()
            packet.track_descriptor.uuid = self._uuids[track]
            packet.track_descriptor.name = track[-1]
            if parent is not None:
                packet.track_descriptor.parent_uuid = parent
            if is_counter:
                packet.track_descriptor.counter.SetInParent()
            self._write(packet)
        return self._uuids[track]

    def _packet(self) -> Any:
        packet = self._protos.TracePacket()
        packet.trusted_packet_sequence_id = SEQUENCE
        return packet

    def _write(self, packet: Any) -> None:
        trace = self._protos.Trace()
        trace.packet.append(packet)
        self._out.write(trace.SerializeToString())
