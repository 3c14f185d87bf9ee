"""A link over a CAN bus that nodes of fsmkit share; the counterpart of ``fsm_link_net.c``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import can

from fsmkit.carriers.can.bus import HELLO, CanNet
from fsmkit.carriers.can.dbc import decode
from fsmkit.carriers.can.message import CanWire
from fsmkit.carriers.can.translator import BUS_OFF, content_of
from fsmkit.language import Value
from fsmkit.runtime.links.codec import Frame
from fsmkit.runtime.links.faults import Faults
from fsmkit.runtime.links.link import Link, LinkTimeout
from fsmkit.runtime.links.receiving import WORD
from fsmkit.system.deployment.event_map import LEVELS, EventMap

SHORT = 1 << 16
"""The numbers of a session, and of events, in `hello`."""
PAUSE = 0.001
"""Seconds for which `CanLink.wait_listeners` waits at a time."""


@dataclass(slots=True)
class NetCounters:
    """Counters of the bus."""

    received: int = 0
    """Frames of other nodes."""
    sent: int = 0
    """Frames that the bus took."""
    unsent: int = 0
    """Frames that it did not take: the peers count them as lost."""


@dataclass(slots=True)
class _Peer:
    is_known: bool = False
    is_foreign: bool = False
    session: int = 0
    sequence: int = 0
    events: int = 0
    ahead: int = 0
    """Events that a hello has shown to be lost, and no counter yet."""


@dataclass(slots=True)
class _Row:
    """A message of another node. ``next``: its next counter, None: unknown."""

    wire: CanWire
    sender: int
    next: int | None = None
    last: int | None = None
    """The sequence of its last frame."""


class CanLink(Link):
    """A link of a node on a bus. Frames are read at the start of a cycle, and sent at its end."""

    def __init__(
        self,
        event_map: EventMap,
        node: str,
        net: CanNet,
        bus: can.BusABC,
        *,
        session: int,
        faults: Faults | None,
        slots: int,
        clock: Callable[[], float],
    ) -> None:
        super().__init__(event_map, node, session, faults, slots, is_proven=False)
        self.bus_counters = NetCounters()
        self._net = net
        self._bus = bus
        self._clock = clock
        self._peers = {place: _Peer() for place in event_map.own_nodes if place != self.node}
        self._rows: dict[int, _Row] = {}
        for part, wire in zip(event_map.messages, net.events, strict=True):
            if wire is not None and part.sender != self.node:
                self._rows[wire.message.frame] = _Row(wire, part.sender)
        for place in self._peers:
            self._rows[net.levels[place].message.frame] = _Row(net.levels[place], place)
        self._hellos = {net.hellos[place].message.frame: place for place in self._peers}
        self._counts = {wire.message.frame: 0 for wire in net.wires}
        self._sent_events = 0
        self._left_out = 0
        self._due = clock()
        self._hello()

    # --- to the bus --------------------------------------------------------------------------

    def _wake(self) -> None:
        while (frame := self.next_decoded()) is not None:
            is_event = frame.message != LEVELS
            self._sent_events = (frame.events + is_event) % WORD
            wire = self._net.events[frame.message - 1] if is_event else self._net.levels[self.node]
            if wire is None:
                self._left_out += 1  # for a foreign node
                continue
            content = content_of(wire, frame.values)
            if content is not None:
                number = wire.message.frame
                content.data[0] = self._counts[number]
                self._counts[number] = (self._counts[number] + 1) % 256
                self._send(content)
        self._hello()

    def _hello(self) -> None:
        """Send hello if it is time."""
        now = self._clock()
        if now < self._due:
            return
        self._due = now + HELLO / 1000
        events = (self._sent_events - self._left_out) % SHORT
        parts = (self._net.hash, 4), (self.session % SHORT, 2), (events, 2)
        message = self._net.hellos[self.node].message
        self._send(
            can.Message(
                arbitration_id=message.frame,
                is_extended_id=False,
                data=b"".join(value.to_bytes(size, "little") for value, size in parts),
            )
        )

    def _send(self, content: can.Message) -> None:
        try:
            self._bus.send(content, timeout=0)
            self.bus_counters.sent += 1
        except (can.CanError, OSError):
            self.bus_counters.unsent += 1

    # --- from the bus ------------------------------------------------------------------------

    def begin_cycle(self) -> None:
        """Receive the frames on the bus, then start the cycle of the link."""
        self._poll()
        super().begin_cycle()

    def _poll(self) -> None:
        while self._take_next(0):
            pass

    def _take_next(self, timeout: float) -> bool:
        """Receive a frame of the bus; return False if none arrives within `seconds`."""
        content = self._bus.recv(timeout)
        if content is None:
            return False
        if content.is_error_frame:
            self.bus_errors += 1
            self.bus_off += bool(content.arbitration_id & BUS_OFF)
        elif not content.is_remote_frame and not content.is_extended_id:
            self._receive(content.arbitration_id, bytes(content.data))
        return True

    def _receive(self, number: int, data: bytes) -> None:
        if (sender := self._hellos.get(number)) is not None:
            self.bus_counters.received += 1
            if len(data) >= 8:
                self._receive_hello(sender, data)
        elif (row := self._rows.get(number)) is not None:
            self.bus_counters.received += 1
            peer = self._peers[row.sender]
            if peer.is_foreign:
                self.receiver.reject_foreign()
            elif peer.is_known:
                self._receive_message(row, peer, data)

    def _receive_hello(self, sender: int, data: bytes) -> None:
        peer = self._peers[sender]
        hash_, session, events = (
            int.from_bytes(data[at:end], "little") for at, end in ((0, 4), (4, 6), (6, 8))
        )
        peer.is_foreign = hash_ != self._net.hash
        if peer.is_foreign:
            peer.is_known = False
            self.receiver.reject_foreign()
            return
        if not peer.is_known or peer.session % SHORT != session:
            peer.is_known = True
            self._start_session(sender, session, events)
        newer = (events - peer.events) % SHORT
        if newer < SHORT // 2:  # otherwise it was queued before an event that has arrived
            peer.events = (peer.events + newer) % WORD
            peer.ahead += newer

    def _start_session(self, sender: int, session: int, events: int) -> None:
        """Start a session of a peer; sessions increase, and 0 is not a session."""
        peer = self._peers[sender]
        if peer.session == 0:
            peer.session = session or SHORT
        else:
            peer.session = (peer.session + (session - peer.session) % SHORT) % WORD or SHORT
        peer.sequence, peer.events, peer.ahead = 0, events, 0
        for row in self._rows.values():
            if row.sender == sender:
                is_first = events == 0 and row.wire.number != LEVELS
                row.next, row.last = 0 if is_first else None, None

    def _receive_message(self, row: _Row, peer: _Peer, data: bytes) -> None:
        if len(data) < row.wire.message.length:
            self.receiver.arrive(row.sender, b"")  # counts as malformed
            return
        is_event = row.wire.number != LEVELS
        gap = 0 if row.next is None else (data[0] - row.next) % 256
        is_next = gap != 255 or row.last is None
        sequence = row.last
        if is_next:
            peer.sequence = (peer.sequence + gap) % WORD
            if is_event:
                known = min(gap, peer.ahead)
                peer.ahead -= known
                peer.events = (peer.events + gap - known) % WORD
            sequence = peer.sequence
            row.next = (data[0] + 1) % 256
        found = decode((row.wire.message,), data)
        if found is None:
            self.receiver.arrive(row.sender, b"")
        else:
            values = self._payload(row, found[1])
            number = row.wire.number
            frame = Frame(
                row.sender, peer.session, sequence or 0, peer.events, number or LEVELS, values
            )
            self.receiver.arrive(row.sender, self.codec.encode(frame))
        if is_next:  # otherwise it counts as repeated
            row.last = peer.sequence
            peer.sequence = (peer.sequence + 1) % WORD
            peer.events = (peer.events + is_event) % WORD

    @staticmethod
    def _payload(row: _Row, values: tuple[Value, ...]) -> tuple[Value, ...]:
        """Return the values of a message in the order of the payload."""
        names = (signal.name for signal in row.wire.message.signals)
        by_name = dict(zip(names, values, strict=True))
        placed = {at: by_name[part.name] for part, at in row.wire.parts if at is not None}
        return tuple(placed[at] for at in sorted(placed))

    # --- a link ------------------------------------------------------------------------------

    def wait_listeners(self, timeout: float) -> None:
        """Block until all other nodes have sent hello. Raises `LinkTimeout` after ``timeout``."""
        end = self._clock() + timeout
        while missing := [place for place, peer in self._peers.items() if not peer.is_known]:
            if self._clock() >= end:
                own, name = self.map.nodes[self.node], self.map.nodes[missing[0]]
                raise LinkTimeout(f"node `{own}` waited {timeout} s for `{name}` to listen")
            self._hello()
            self._take_next(PAUSE)

    def _take_in(self, node: int, timeout: float) -> bool:  # noqa: ARG002  (it is no lockstep)
        return False

    def close(self) -> None:
        """Leave the bus."""
        super().close()
        self._bus.shutdown()
