"""A foreign node of ROS 2, by topics of DDS with the names of ROS."""

from __future__ import annotations

import struct
import threading
from collections import OrderedDict, deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from cyclonedds.core import DDSException, Policy, Qos
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from fsmkit.carriers.ros.domain import Participant, matched_ends
from fsmkit.carriers.ros.messages import COUNTERS, DURATION, STRING, lower
from fsmkit.carriers.ros.structs import duration_of, message_of, struct_of, ticks_of, zeros_of
from fsmkit.carriers.ros.topics import RosNode, RosPart, RosTopic, RosWire
from fsmkit.language import Value
from fsmkit.runtime.links.codec import Frame
from fsmkit.runtime.links.link import SLOTS, Link
from fsmkit.runtime.links.receiving import WORD
from fsmkit.system.deployment.event_map import LEVELS

UNREADABLE = (DDSException, struct.error, ValueError, TypeError, IndexError, AttributeError)
"""Exceptions of Cyclone DDS for a sample that does not match its type."""
MOST_WRITERS = 32
"""Programs of which a topic is remembered, to distinguish a new one."""


@dataclass(slots=True)
class RosCounters:
    """Counters of the topics."""

    received: int = 0
    """Messages that came."""
    sent: int = 0
    """Messages that DDS took."""
    unsent: int = 0
    """Messages for which there was no room, as a subscriber has not read."""
    refused: int = 0
    """Messages that have another shape than their type, or a value out of its range."""
    late: int = 0
    """Messages whose own number had come already: dropped."""


@dataclass(slots=True)
class _Sent:
    """A published topic. ``waiting``: messages that DDS has not accepted yet."""

    topic: RosTopic
    writer: Any
    slots: int
    waiting: deque[Any] = field(default_factory=deque)
    sequence: int = 0
    last: Any = None


@dataclass(slots=True)
class _Read:
    """A subscribed topic. ``writers``: programs, with their session and next number."""

    topic: RosTopic
    wires: list[RosWire]
    reader: Any
    stamp: int = 0
    writers: OrderedDict[str, tuple[int, int]] = field(default_factory=OrderedDict)


class RosTranslator:
    """Connects a link with a foreign node. Messages are read when a cycle of the link starts.

    No more events are read than the ring of the link has space for. The others stay with DDS, which
    lets their publishers wait. Messages that DDS does not accept at once are sent with the next
    frames.
    """

    def __init__(self, link: Link, node: int, ros: RosNode) -> None:
        self.node = node
        self.counters = RosCounters()
        self._link = link
        self._ros = ros
        self._levels = list(ros.start)
        self._session, self._sequence, self._events = 1, 0, 0
        self._replaced: OrderedDict[str, None] = OrderedDict()
        self._programs: dict[int, str] = {}
        self._ready: deque[tuple[_Read, Any]] = deque()
        self._turn = threading.Lock()
        self._joined = Participant(ros.domain, is_insecure=ros.is_insecure)
        self._sent: dict[str, _Sent] = {}
        self._read: dict[str, _Read] = {}
        self._outgoing: dict[int, list[tuple[RosWire, _Sent]]] = {}
        self._states: dict[str, _Sent] = {}
        try:
            for wire in ros.wires:
                if wire.sender == link.node:
                    self._outgoing.setdefault(wire.number, []).append((wire, self._to(wire.topic)))
                elif wire.receiver == link.node:
                    self._from(wire)
        except BaseException:
            self.close()
            raise

    def _to(self, topic: RosTopic) -> _Sent:
        if topic.name not in self._sent:
            writer = DataWriter(
                self._joined.participant, self._topic(topic), qos=_qos(topic, SLOTS)
            )
            self._sent[topic.name] = _Sent(topic, writer, self._link.receiver.events.capacity)
        return self._sent[topic.name]

    def _from(self, wire: RosWire) -> None:
        if wire.topic.name not in self._read:
            slots = self._link.receiver.events.capacity
            qos = _qos(wire.topic, slots)
            reader = DataReader(self._joined.participant, self._topic(wire.topic), qos=qos)
            self._read[wire.topic.name] = _Read(wire.topic, [], reader)
        self._read[wire.topic.name].wires.append(wire)

    def _topic(self, topic: RosTopic) -> Any:
        return Topic(self._joined.participant, f"rt{topic.name}", struct_of(topic.type))

    # --- to the topics -------------------------------------------------------------------------

    @property
    def unheard(self) -> tuple[str, ...]:
        """The published topics without a subscriber now; events on them are lost."""
        found = list(self._sent.items())
        return tuple(
            n for n, sent in found if not matched_ends(sent.writer.get_matched_subscriptions)
        )

    @property
    def unserved(self) -> tuple[str, ...]:
        """The subscribed topics without a publisher now, as far as this node knows.

        A publisher may discover this node before this node discovers it; an event published in
        between is lost.
        """
        found = list(self._read.items())
        return tuple(
            n for n, read in found if not matched_ends(read.reader.get_matched_publications)
        )

    def take(self, frame: Frame) -> None:
        """Publish an event of a frame; of levels those that changed, or are for sensors."""
        with self._turn:
            for sent in self._sent.values():
                self._flush(sent)
            for wire, sent in self._outgoing.get(frame.message, ()):
                if frame.message == LEVELS:
                    self._take_level(wire, sent, frame.values[wire.place])
                else:
                    self._put(sent, self._message(wire, sent, frame))

    def _take_level(self, wire: RosWire, sent: _Sent, value: Value) -> None:
        if sent.topic.qos != "sensor" and value == sent.last:
            return
        sent.last = value
        sent.waiting.clear()  # of a level the last value counts
        self._put(sent, self._content(wire, (value,), {}))

    def _message(self, wire: RosWire, sent: _Sent, frame: Frame) -> Any:
        counted = {}
        if sent.topic.type.is_counted:
            numbers = frame.session, sent.sequence, frame.events
            counted = dict(zip(COUNTERS, numbers, strict=True))
            sent.sequence = (sent.sequence + 1) % WORD
        return self._content(wire, frame.values, counted)

    def _content(self, wire: RosWire, values: tuple[Value, ...], counted: dict[str, int]) -> Any:
        members = zeros_of(wire.topic.type) | counted
        for part, value in zip(wire.parts, values, strict=True):
            if part.field is None:
                assert isinstance(value, int)  # noqa: S101  (ticks)
                return duration_of(value, wire.tick)
            members[part.field] = self._given(wire, part, value)
        return message_of(wire.topic.type, members)

    def _given(self, wire: RosWire, part: RosPart, value: Value) -> Any:
        primitive = next(each.type for each in wire.topic.type.fields if each.name == part.field)
        if primitive == DURATION:
            assert isinstance(value, int)  # noqa: S101  (ticks)
            return duration_of(value, wire.tick)
        return value

    def _put(self, sent: _Sent, content: Any) -> None:
        if len(sent.waiting) >= sent.slots:
            self.counters.unsent += 1
            return
        sent.waiting.append(content)
        self._flush(sent)

    def _flush(self, sent: _Sent) -> None:
        while sent.waiting:
            try:
                sent.writer.write(sent.waiting[0])
            except DDSException:  # its subscribers have not taken what was sent before
                return
            sent.waiting.popleft()
            self.counters.sent += 1

    def show(self, states: Mapping[str, str]) -> None:
        """Publish the names of the active states of machines, if they changed.

        The topic is ``<namespace>/<machine>/state``; a late subscriber receives the last of each.
        """
        with self._turn:
            for machine, text in states.items():
                name = f"{self._ros.namespace}/{lower(machine)}/state"
                if name not in self._states:
                    topic = RosTopic(name, STRING, "state", is_event=False)
                    self._states[name] = self._to(topic)
                sent = self._states[name]
                if sent.last != text:
                    sent.last = text
                    sent.waiting.clear()
                    self._put(sent, message_of(STRING, {"data": text}))

    # --- from the topics -----------------------------------------------------------------------

    def poll(self) -> None:
        """Deliver received messages."""
        found = [
            each
            for read in self._read.values()
            if not read.topic.is_event or not self._ready
            for each in self._samples(read)
        ]
        # by the times of their publishers, as DDS keeps the order only within a topic
        found.sort(key=lambda each: each[0])
        for _, read, sample in found:
            if read.topic.is_event:
                self._ready.append((read, sample))
            else:
                self._take_in(read, sample)
        ring = self._link.receiver.events
        while self._ready and len(self._ready[0][0].wires) <= ring.capacity - len(ring):
            self._take_in(*self._ready.popleft())

    def _samples(self, read: _Read) -> Iterator[tuple[int, _Read, Any]]:
        for _ in range(self._link.receiver.events.capacity):
            try:
                samples = read.reader.take(1)
            except UNREADABLE:
                self._reject()
                continue
            if not samples:
                return
            (sample,) = samples
            if sample.sample_info.valid_data:
                self.counters.received += 1
                read.stamp = max(read.stamp, sample.sample_info.source_timestamp)
                yield read.stamp, read, sample

    def _take_in(self, read: _Read, sample: Any) -> None:
        if not self._is_next(read, sample):
            return
        for wire in read.wires:
            try:
                values = tuple(_value(sample, part, wire) for part in wire.parts)
                if wire.number == LEVELS:
                    levels = list(self._levels)
                    levels[wire.place] = values[0]
                    self._arrive(LEVELS, tuple(levels))
                    self._levels = levels
                else:
                    self._arrive(wire.number, values)
            except (struct.error, OverflowError):  # no value of any type of this size
                self._reject()

    def _is_next(self, read: _Read, sample: Any) -> bool:
        """Whether a message is in order; count gaps, start a session for a new program.

        A program that follows another on a topic is a restart, and so is one with another session.
        """
        program = self._program(read, sample)
        is_counted = read.topic.type.is_counted and sample.session != 0
        session, number = (sample.session, sample.sequence) if is_counted else (0, 0)
        known = read.writers.get(program)
        if known is None:
            if read.writers:
                self._start_session(program)
        elif known[0] != session:
            self._start_session(f"{program} {session}")
        elif is_counted:
            gap = (number - known[1]) % WORD
            if gap >= WORD // 2:
                self.counters.late += 1
                return False
            self._sequence = (self._sequence + gap * len(read.wires)) % WORD
            self._events = (self._events + gap * len(read.wires)) % WORD
        read.writers[program] = session, (number + 1) % WORD
        _limit(read.writers)
        return True

    def _program(self, read: _Read, sample: Any) -> str:
        """Return the publisher of a sample: a participant, or if it is gone already, a writer."""
        handle = sample.sample_info.publication_handle
        if handle not in self._programs:
            try:
                found = read.reader.get_matched_publication_data(handle)
            except DDSException:
                found = None
            if len(self._programs) >= MOST_WRITERS * (len(self._read) + 1):
                self._programs.clear()
            if found is None:
                return str(handle)
            self._programs[handle] = str(found.participant_key)
        return self._programs[handle]

    def _start_session(self, run: str) -> None:
        """Start a session for another run of the foreign node, once for all its topics."""
        if run in self._replaced:
            return
        self._replaced[run] = None
        _limit(self._replaced)
        self._session = self._session % (WORD - 1) + 1
        self._sequence = self._events = 0

    def _arrive(self, number: int, values: tuple[Value, ...]) -> None:
        frame = Frame(self.node, self._session, self._sequence, self._events, number, values)
        if self._link.receiver.arrive(self.node, self._link.codec.encode(frame)):
            self._sequence = (self._sequence + 1) % WORD
            self._events = (self._events + (number != LEVELS)) % WORD
        else:
            self.counters.refused += 1

    def _reject(self) -> None:
        self.counters.refused += 1
        self._link.receiver.arrive(self.node, b"")  # counts as malformed

    def close(self) -> None:
        """Leave the domain."""
        with self._turn:
            for table in (self._sent, self._states, self._outgoing, self._read, self._ready):
                table.clear()
            self._joined.leave()


def _limit(table: OrderedDict[str, Any]) -> None:
    while len(table) > MOST_WRITERS:
        table.popitem(last=False)


def _qos(topic: RosTopic, slots: int) -> Qos:
    """Return the QoS of a topic; ``slots``: the events that its reader or its writer keeps.

    A writer keeps all events until its subscribers have them, and accepts no more meanwhile.
    """
    reliable = Policy.Reliability.Reliable(max_blocking_time=0)
    parts = [
        Policy.Reliability.BestEffort if topic.qos == "sensor" else reliable,
        Policy.Durability.TransientLocal if topic.qos == "state" else Policy.Durability.Volatile,
        Policy.IgnoreLocal.Participant,
        Policy.DataRepresentation(use_cdrv0_representation=True),
    ]
    if topic.is_event and topic.qos == "default":
        parts += [Policy.History.KeepAll, Policy.ResourceLimits(slots, 1, slots)]
    else:
        parts.append(Policy.History.KeepLast(slots if topic.is_event else 1))
    return Qos(*parts)


def _value(sample: Any, part: RosPart, wire: RosWire) -> Any:
    if part.field is None:
        return ticks_of(sample, wire.tick)
    found = getattr(sample, part.field)
    return found if isinstance(found, int | float) else ticks_of(found, wire.tick)
