"""The protocol between the orchestrator and what it steps: ZeroMQ REQ to REP, version 1.

The first byte of a request is its kind, that of a reply the same, or ``E`` before a text.

| kind | request | reply |
|---|---|---|
| ``C`` connect | JSON: protocol | JSON: protocol, name, inputs, outputs, peers, states |
| ``I`` initial values | inputs | outputs |
| ``K`` check | | JSON: ok, why |
| ``S`` step | number, frames to have come from each peer, inputs | number, frames sent, outputs |
| ``P`` parameter | JSON: name, value | JSON: ok |
| ``R`` report | | JSON |
| ``Q`` quit | | |

Numbers of steps and frames are unsigned, signals signed; all have 32 bits, the lowest byte first.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, cast

import numpy as np
import numpy.typing as npt
import zmq

from .signals import PROTOCOL, Ports

Values = npt.NDArray[np.int32]
Json = dict[str, Any]


PATIENCE = 200
"""After so many ms without a reply, the other side's process is checked."""


class ProtocolError(Exception):
    """The other side violates the protocol, rejects the request, or does not reply."""


@dataclass(frozen=True)
class Node:
    """The description of a connected process."""

    name: str
    ports: Ports
    peers: tuple[str, ...] | None
    """The senders whose frames are counted; None if unknown."""
    states: Mapping[str, tuple[str, ...]]
    """The names of the states of its machines."""


def hello(name: str, ports: Ports, **more: object) -> Json:
    """Return the description of a process."""
    described = {
        what: [{"name": signal, "type": "i32"} for signal in signals]
        for what, signals in (("inputs", ports.inputs), ("outputs", ports.outputs))
    }
    return {"protocol": PROTOCOL, "name": name, **described, "period_us": 1000, **more}


def read_hello(told: Json) -> Node:
    """Parse the description of a process. Raises `ProtocolError` if it is invalid."""
    if told.get("protocol") != PROTOCOL:
        raise ProtocolError(f"speaks protocol {told.get('protocol')}, not {PROTOCOL}")
    try:
        inputs, outputs = (tuple(s["name"] for s in told[what]) for what in ("inputs", "outputs"))
        peers = told.get("peers")
        states = {name: tuple(states) for name, states in told.get("states", {}).items()}
        return Node(
            str(told["name"]),
            Ports(inputs, outputs),
            None if peers is None else tuple(peers),
            states,
        )
    except (KeyError, TypeError, AttributeError) as error:
        raise ProtocolError(f"its answer to connect lacks something: {error!r}") from error


class Client:
    """The client end of a connection. ``timeout`` in s; ``is_dead``: the other side is gone."""

    def __init__(
        self,
        context: zmq.Context[zmq.Socket[bytes]],
        endpoint: str,
        timeout: float,
        is_dead: Callable[[], bool] = lambda: False,
    ) -> None:
        self.socket = context.socket(zmq.REQ)
        self.socket.linger = 0
        self.socket.sndtimeo = self.socket.rcvtimeo = PATIENCE
        self.socket.connect(endpoint)
        self._is_dead = is_dead
        self.timeout = timeout
        self.endpoint = endpoint

    def request(self, kind: bytes, body: bytes = b"") -> bytes:
        """Send a request, and return the body of the reply."""
        self.send(kind, body)
        return self.receive(kind)

    def send(self, kind: bytes, body: bytes = b"") -> None:
        """Send a request; `receive` returns the reply."""
        try:
            self.socket.send(kind + body)
        except zmq.ZMQError as error:
            raise ProtocolError(f"cannot be reached: {error}") from error

    def receive(self, kind: bytes) -> bytes:
        """Return the body of the answer to a question of this kind."""
        answer = self._heard()
        if answer[:1] == kind:
            return answer[1:]
        if answer[:1] == b"E":
            raise ProtocolError(f"rejects the request: {answer[1:].decode(errors='replace')}")
        raise ProtocolError(f"answers {answer[:1]!r} to {kind!r}")

    def _heard(self) -> bytes:
        for _ in range(max(1, round(1000 * self.timeout / PATIENCE))):
            try:
                return self.socket.recv()
            except zmq.Again:
                if self._is_dead():
                    raise ProtocolError("is gone") from None
            except zmq.ZMQError as error:
                raise ProtocolError(f"cannot be received: {error}") from error
        raise ProtocolError(f"did not answer for {self.timeout:g} s")

    def request_json(self, kind: bytes, question: Json | None = None) -> Json:
        """Send a request, and return the reply, both in JSON."""
        body = b"" if question is None else json.dumps(question).encode()
        answer = self.request(kind, body)
        try:
            return cast(Json, json.loads(answer or b"{}"))
        except ValueError as error:
            raise ProtocolError(f"its answer to {kind!r} is no JSON") from error

    def close(self) -> None:
        """Hang up."""
        self.socket.close()


def step_request(number: int, frames: Sequence[int], inputs: Values) -> bytes:
    """Return the body of a step."""
    return struct.pack(f"<{1 + len(frames)}I", number, *frames) + inputs.tobytes()


def read_step_reply(body: bytes, number: int, outputs: int) -> tuple[int, Values]:
    """Return the frames sent so far, and the outputs."""
    if len(body) != 8 + 4 * outputs:
        raise ProtocolError(f"answers a step with {len(body)} bytes, not {8 + 4 * outputs}")
    told, frames = struct.unpack_from("<II", body)
    if told != number:
        raise ProtocolError(f"answers step {told}, not {number}")
    return frames, np.frombuffer(body, "<i4", offset=8)


class Served(Protocol):
    """A process that can be stepped: the plant, or a board."""

    name: str
    ports: Ports

    def about(self) -> Json:
        """Return the description at connect, besides name and signals."""

    def initial(self, inputs: Values) -> Sequence[int]:
        """Take the first inputs, return the first outputs."""

    def step(self, number: int, inputs: Values) -> Sequence[int]:
        """Advance by a step."""

    def set_parameter(self, name: str, value: float) -> None:
        """Set a parameter, or raise KeyError."""

    def report(self) -> Json:
        """Return the report."""


def answer(served: Served, request: bytes) -> bytes:
    """Return the answer to a request; what cannot be answered gets an ``E``."""
    kind, body = request[:1], request[1:]
    inputs = len(served.ports.inputs)
    try:
        match kind:
            case b"S":
                if len(body) != 4 + 4 * inputs:
                    return b"E" + f"a step has {4 + 4 * inputs} bytes, not {len(body)}".encode()
                number = int.from_bytes(body[:4], "little")
                values = served.step(number, np.frombuffer(body, "<i4", offset=4))
                return b"S" + struct.pack(f"<II{len(values)}i", number, 0, *values)
            case b"C":
                if json.loads(body).get("protocol") != PROTOCOL:
                    return b"E" + f"this speaks protocol {PROTOCOL}".encode()
                told = hello(served.name, served.ports, **served.about())
                return b"C" + json.dumps(told).encode()
            case b"I":
                if len(body) != 4 * inputs:
                    return b"E" + f"there are {inputs} inputs, not {len(body) / 4:g}".encode()
                values = served.initial(np.frombuffer(body, "<i4"))
                return b"I" + struct.pack(f"<{len(values)}i", *values)
            case b"K":
                return b'K{"ok": true}'
            case b"P":
                told = json.loads(body)
                served.set_parameter(str(told["name"]), float(told["value"]))
                return b'P{"ok": true}'
            case b"R":
                return b"R" + json.dumps(served.report()).encode()
            case b"Q":
                return b"Q"
            case _:
                return b"E" + f"no such request: {kind!r}".encode()
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        return b"E" + f"{type(error).__name__}: {error}".encode()


def serve(served: Served, endpoint: str, heard: Callable[[], bool] = lambda: True) -> None:
    """Handle requests until one is quit, or ``heard``, called once a second, returns false."""
    with zmq.Context() as context, context.socket(zmq.REP) as socket:
        socket.linger = 200
        socket.rcvtimeo = 1000
        socket.bind(endpoint)
        while True:
            try:
                request = socket.recv()
            except zmq.Again:
                if not heard():
                    return
                continue
            socket.send(answer(served, request))
            if request[:1] == b"Q":
                return
