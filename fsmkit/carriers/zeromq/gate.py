"""Limit the connections to the endpoint of a node: their number, their duration, their traffic.

ZeroMQ limits neither connections nor the parts of one message, which it keeps until the last has
arrived. So the gate keeps a second handle of each connection and ends those that exceed a limit:
strangers beyond the seats, strangers without a valid hello in time, and senders of more than hellos
need. The same as ``fsm_link_gate.c``.
"""

from __future__ import annotations

import os
import socket
import struct
from contextlib import suppress
from dataclasses import dataclass

import zmq

SEATS = 32
"""Connections at a time; one more, and the oldest stranger is put out."""
STRANGER = 2.0
"""Seconds until a connection must have said a valid hello."""
BYTES = 1 << 14
"""Bytes that a connection may send at once, and again each second; hellos need at most half."""
EVENT = struct.Struct("=HI")
"""A monitor's message: the event and its value, here a file descriptor."""
BYTES_RECEIVED = 128
"""Where ``tcpi_bytes_received`` is in ``struct tcp_info`` (Linux 4.1 and later)."""
APART = 0.01
"""Seconds from look to look."""
LOOKS = 4096
"""Events that are looked at in one go."""


@dataclass(slots=True)
class _Seat:
    handle: socket.socket
    since: float
    node: int | None = None


class Gate:
    """Watches the connections that a socket accepts. One thread; `close` when it has ended."""

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]], door: zmq.Socket[bytes]) -> None:
        """Watch a socket that is not bound yet."""
        self.dropped = 0
        self._door = door
        self._looked = 0.0
        self._place: object = None
        self._seats: dict[int, _Seat] = {}
        self._monitor = context.socket(zmq.PAIR)
        self._monitor.setsockopt(zmq.RCVHWM, 0)  # the reporter must never wait for us
        self._monitor.setsockopt(zmq.LINGER, 0)
        where = f"inproc://fsm-link-gate-{id(self)}"
        door.monitor(where, zmq.EVENT_LISTENING | zmq.EVENT_ACCEPTED | zmq.EVENT_DISCONNECTED)
        self._monitor.connect(where)

    def look(self, now: float) -> None:
        """Process arrivals and departures, and end connections that exceed a limit."""
        if now - self._looked < APART:
            return
        self._looked = now
        for _ in range(LOOKS):
            try:
                event, number = EVENT.unpack(self._monitor.recv_multipart(zmq.NOBLOCK)[0])
            except (zmq.Again, struct.error):
                break
            self._leave(number)
            if event == zmq.EVENT_ACCEPTED:
                self._enter(number, now)
            elif event == zmq.EVENT_LISTENING and (handle := _handle(number)) is not None:
                self._place = _place(handle)
                handle.close()
        for number, seat in list(self._seats.items()):
            age = now - seat.since
            is_late = seat.node is None and age > STRANGER
            if is_late or _received(seat.handle) > BYTES * (1 + age):
                self._put_out(number)

    def assign(self, number: int, node: int) -> None:
        """Assign the connection with descriptor `number` to a node, in place of its earlier one."""
        for seat in self._seats.values():
            if seat.node == node:
                seat.node = None
        if number in self._seats:
            self._seats[number].node = node

    def close(self) -> None:
        """Stop watching."""
        with suppress(zmq.ZMQError):
            self._door.disable_monitor()
        self._monitor.close()
        for number in list(self._seats):
            self._leave(number)

    def _enter(self, number: int, now: float) -> None:
        handle = _handle(number)
        if handle is None:
            return
        if _place(handle) != self._place:  # it is gone, and its number may belong to another
            handle.close()
            return
        self._seats[number] = _Seat(handle, now)
        strangers = [n for n, seat in self._seats.items() if seat.node is None]
        if len(self._seats) > SEATS:
            self._put_out(strangers[0])

    def _leave(self, number: int) -> None:
        if (seat := self._seats.pop(number, None)) is not None:
            seat.handle.close()

    def _put_out(self, number: int) -> None:
        with suppress(OSError):
            self._seats[number].handle.shutdown(socket.SHUT_RDWR)
        self._leave(number)
        self.dropped += 1


def _handle(number: int) -> socket.socket | None:
    """Return a handle of our own of a socket; None if the descriptor is no socket any more."""
    try:
        own = os.dup(number)
    except OSError:
        return None
    try:
        return socket.socket(fileno=own)
    except OSError:
        os.close(own)
        return None


def _place(handle: socket.socket) -> object:
    """Return the common identity of a listening socket and of those that it accepted."""
    with suppress(OSError):
        name = handle.getsockname()
        return name[1] if handle.family in (socket.AF_INET, socket.AF_INET6) else name
    return None


def _received(handle: socket.socket) -> int:
    """Return the bytes received on a connection; 0 if the system does not count them."""
    if handle.family in (socket.AF_INET, socket.AF_INET6) and hasattr(socket, "TCP_INFO"):
        with suppress(OSError):
            found = handle.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, BYTES_RECEIVED + 8)
            if len(found) == BYTES_RECEIVED + 8:
                return int(struct.unpack_from("=Q", found, BYTES_RECEIVED)[0])
    return 0
