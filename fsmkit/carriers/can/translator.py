"""A foreign node on a CAN bus, by python-can; the counterpart of ``fsm_link_can.c``."""

from __future__ import annotations

import socket
import struct
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import can

from fsmkit.carriers.can.chart_of_dbc import SILENT_AFTER
from fsmkit.carriers.can.dbc import Signal, decode, encode
from fsmkit.carriers.can.exchanged import CanWires
from fsmkit.carriers.can.message import CanWire
from fsmkit.language import FloatType, Value
from fsmkit.runtime.links.codec import Frame
from fsmkit.runtime.links.link import Link
from fsmkit.runtime.links.watch import Watch
from fsmkit.system.deployment.event_map import LEVELS

EXTENDED, REMOTE, ERROR = 1 << 31, 1 << 30, 1 << 29
"""Flags of an identifier in `struct can_frame`."""
BUS_OFF = 0x40
CLASSICAL, FD = struct.Struct("<IB3x8s"), struct.Struct("<IB3x64s")


class MulticastBus(can.BusABC):  # type: ignore[misc]
    """A bus of UDP multicast within this computer, with the bytes of ``fsm_can_bus.c``.

    python-can knows it as the interface ``fsmkit_udp``; ``channel`` is ``group:port``.
    """

    def __init__(self, channel: str, can_filters: Any = None, **options: object) -> None:
        del options  # those of other interfaces
        group, _, port = channel.rpartition(":")
        self._at = group, int(port)
        own = socket.inet_aton("127.0.0.1")
        self._in = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._in.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._in.bind(self._at)
            join = socket.inet_aton(group) + own
            self._in.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, join)
            self._out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, own)
            self._out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
            super().__init__(channel, can_filters)
        except BaseException:
            self._in.close()
            self._out.close()
            raise

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002
        """Send a frame."""
        flags = (EXTENDED if msg.is_extended_id else 0) | (ERROR if msg.is_error_frame else 0)
        form = FD if msg.is_fd else CLASSICAL
        content = form.pack(msg.arbitration_id | flags, len(msg.data), bytes(msg.data))
        self._out.sendto(content, self._at)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        self._in.settimeout(timeout)
        try:
            content = self._in.recv(FD.size + 1)
        except (TimeoutError, BlockingIOError):
            return None, False
        form = CLASSICAL if len(content) == CLASSICAL.size else FD
        if len(content) != form.size:
            return None, False
        number, length, data = form.unpack(content)
        message = can.Message(
            arbitration_id=number & (EXTENDED - 1 & ~REMOTE & ~ERROR),
            is_extended_id=bool(number & EXTENDED),
            is_remote_frame=bool(number & REMOTE),
            is_error_frame=bool(number & ERROR),
            is_fd=form is FD,
            data=b"" if number & REMOTE else data[:length],
        )
        return message, False

    def shutdown(self) -> None:
        """Leave the group."""
        super().shutdown()
        self._in.close()
        self._out.close()


def open_bus(
    name: str, interface: str, received: Iterable[CanWire], *, is_fd: bool = False
) -> can.BusABC:
    """Return a bus: an interface of python-can, or ``udp:group:port``.

    SocketCAN has a filter for each message, and lets error frames through; filters of other
    interfaces would stop these.
    """
    if name.startswith("udp:"):
        return MulticastBus(name.removeprefix("udp:"))
    bus = can.Bus(interface=interface, channel=name, **({"fd": True} if is_fd else {}))
    if interface == "socketcan":
        bus.set_filters(
            [
                {
                    "can_id": wire.message.frame,
                    "can_mask": (1 << 29) - 1 if wire.message.is_extended else (1 << 11) - 1,
                    "extended": wire.message.is_extended,
                }
                for wire in received
            ]
        )
    return bus


@dataclass(slots=True)
class CanCounters:
    """Counters of a bus."""

    received: int = 0
    """Frames with an identifier of the file."""
    sent: int = 0
    """Frames that the bus took: events, and cyclic messages with levels."""
    unsent: int = 0
    """Frames that it did not take: they are lost."""
    refused: int = 0
    """Values out of range, or cut off."""
    bus_errors: int = 0
    bus_off: int = 0


class CanTranslator:
    """Connects a link with a foreign node. Frames are read when a cycle of the link starts."""

    def __init__(
        self,
        link: Link,
        node: int,
        wires: CanWires,
        bus: can.BusABC,
        clock: Callable[[], float],
        watchdog: float,
    ) -> None:
        self.node = node
        self.counters = CanCounters()
        self.cyclic = CyclicMessages(link, self._send, clock, watchdog)
        """The messages with levels; they stop while the loop of the node hangs."""
        self._link = link
        self._wires = wires
        self._bus = bus
        self._clock = clock
        self._levels = list(wires.start)
        self._session, self._sequence, self._events = 1, 0, 0
        self._turn = threading.Lock()
        self._limits = {
            wire.message.name: SILENT_AFTER * wire.message.cycle / 1000
            for wire in wires.received
            if wire.message.is_levels
        }
        self._heard = dict.fromkeys(self._limits, clock())
        self._silent: set[str] = set()

    # --- to the bus --------------------------------------------------------------------------

    def take(self, frame: Frame) -> None:
        """Send an event of a frame; pass levels to their cyclic messages."""
        for place, wire in enumerate(self._wires.sent):
            if wire.number != frame.message:
                continue
            content = content_of(wire, frame.values)
            if content is None:
                self.counters.refused += 1
            elif frame.message == LEVELS:
                self.cyclic.put(place, content, wire.message.cycle / 1000)
            else:
                self._send(content)

    def _send(self, content: can.Message) -> None:
        """Send a frame, from the thread of the loop or of the cyclic messages."""
        with self._turn:
            try:
                self._bus.send(content, timeout=0)
                self.counters.sent += 1
            except (can.CanError, OSError):
                self.counters.unsent += 1

    # --- from the bus ------------------------------------------------------------------------

    def poll(self) -> None:
        """Deliver received messages, and timeouts of missing ones."""
        while (content := self._bus.recv(0)) is not None:
            if content.is_error_frame:
                is_off = bool(content.arbitration_id & BUS_OFF)
                self.counters.bus_errors += 1
                self.counters.bus_off += is_off
                self._link.bus_errors += 1
                self._link.bus_off += is_off
            elif not content.is_remote_frame:
                self._take_in(content)
        now = self._clock()
        for name, limit in self._limits.items():
            if name not in self._silent and now - self._heard[name] >= limit:
                self._silent.add(name)
                for place, number in self._wires.silences:
                    if self._wires.received[place].message.name == name:
                        self._arrive(number, ())

    def _take_in(self, content: can.Message) -> None:
        key = content.arbitration_id, content.is_extended_id
        wires = [w for w in self._wires.received if (w.message.frame, w.message.is_extended) == key]
        if not wires:
            return
        self.counters.received += 1
        found = decode(tuple(wire.message for wire in wires), bytes(content.data))
        if found is None:
            self.counters.refused += 1
            self._link.receiver.arrive(self.node, b"")  # counts as malformed
            return
        message, values = found
        if message.is_levels:
            self._receive_message(message.name)
        by_name = dict(zip((signal.name for signal in message.signals), values, strict=True))
        for wire in wires:
            if wire.message.name != message.name or wire.number is None:
                continue
            placed = {at: by_name[part.name] for part, at in wire.parts if at is not None}
            if wire.number == LEVELS:
                for at, value in placed.items():
                    self._levels[at] = value
                self._arrive(LEVELS, tuple(self._levels))
            else:
                self._arrive(wire.number, tuple(placed[at] for at in sorted(placed)))

    def _receive_message(self, name: str) -> None:
        if self._silent == self._limits.keys():  # another run of the foreign node
            self._session += 1
            self._sequence = self._events = 0
        self._heard[name] = self._clock()
        self._silent.discard(name)

    def _arrive(self, number: int, values: tuple[Value, ...]) -> None:
        frame = Frame(self.node, self._session, self._sequence, self._events, number, values)
        if self._link.receiver.arrive(self.node, self._link.codec.encode(frame)):
            self._sequence += 1
            self._events += number != LEVELS

    def close(self) -> None:
        """Leave the bus."""
        self.cyclic.stop()
        self._bus.shutdown()


class CyclicMessages:
    """Sends messages in their cycles, while the loop of the node completes its own.

    python-can, or the broadcast manager of the kernel, would continue with the last content of a
    hanging loop. A thread sends them here (`start`), or the owner of simulated time calls
    `send_due`.

    Args:
        link: The link of the loop.
        send: Sends a frame without blocking.
        clock: Returns seconds.
        watchdog: Seconds without a completed cycle after which nothing is sent.

    """

    def __init__(
        self,
        link: Link,
        send: Callable[[can.Message], None],
        clock: Callable[[], float],
        watchdog: float,
    ) -> None:
        self._link = link
        self._send = send
        self._clock = clock
        self._messages: dict[int, _Cyclic] = {}
        self._watch = Watch(watchdog, clock())
        self._turn = threading.Lock()
        self._news = threading.Event()
        self._is_over = False
        self._thread: threading.Thread | None = None

    def put(self, place: int, content: can.Message, period: float) -> None:
        """Set the content of a message; a new one is sent at once, and then each ``period``."""
        with self._turn:
            now = self._clock()
            message = self._messages.setdefault(place, _Cyclic(content, period, now))
            message.content = content
            is_due = message.due <= now
        if is_due:
            self._news.set()

    def send_due(self) -> float:
        """Send the messages whose time has come; return the seconds until the next call.

        Nothing is sent while the loop hangs; messages resume with its next cycle.
        """
        with self._turn:
            now = self._clock()
            is_live = self._watch.look(self._link.completed, now)
            wait = self._watch.every
            for message in self._messages.values():
                if is_live and message.due <= now:
                    self._send(message.content)
                    message.due += message.period
                    if message.due <= now:  # the thread was late: there is no burst
                        message.due = now + message.period
                if is_live:
                    wait = min(wait, message.due - now)
            return wait

    def start(self) -> None:
        """Send from a thread until `stop`."""
        self._thread = threading.Thread(target=self._run, name="fsmkit cyclic", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._is_over:
            self._news.wait(self.send_due())
            self._news.clear()

    def stop(self) -> None:
        """End the thread."""
        self._is_over = True
        self._news.set()
        if self._thread is not None:
            self._thread.join()


@dataclass(slots=True)
class _Cyclic:
    """A message that is sent every ``period``; ``due``: when it is sent next. In seconds."""

    content: can.Message
    period: float
    due: float


def content_of(wire: CanWire, values: tuple[Value, ...]) -> can.Message | None:
    """Return the frame with values of a payload; None if one is out of its range."""
    found: dict[str, Any] = {}
    for signal, place in wire.parts:
        value = signal.idle if place is None else values[place]
        if not _is_within(signal, value):
            return None
        found[signal.name] = value
    message = wire.message
    return can.Message(
        arbitration_id=message.frame,
        is_extended_id=message.is_extended,
        is_fd=message.is_fd,
        data=encode(message, tuple(found[signal.name] for signal in message.signals)),
    )


def _is_within(signal: Signal, value: Any) -> bool:
    if isinstance(signal.type, FloatType):
        return True
    lo, hi = signal.bounds
    return lo <= int(value) <= hi
