"""Query the health of a deployment's nodes over ZeroMQ.

Each node has a REP socket. The request is the byte ``R``. The reply is ``R`` and a JSON object:
``ok`` (bool: the node works), ``status`` (one line for people), and any number of counters. See
docs/how-to/keep-running.md for the node's side.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from fsmkit.diagnostics import fail
from fsmkit.diagnostics.parsing import parse_json

LONGEST = 1 << 20
"""Bytes of an answer."""


@dataclass(frozen=True, slots=True)
class Health:
    """The health of a node. ``report`` holds the other members of its reply."""

    node: str
    endpoint: str
    is_ok: bool
    status: str
    report: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))


def health_of(endpoints: Iterable[tuple[str, str]], seconds: float) -> tuple[Health, ...]:
    """Query nodes, given by name and endpoint, in parallel.

    Args:
        endpoints: Names of nodes, and where they answer.
        seconds: After which a node that has not answered is not well.

    Raises:
        FsmkitError: ``link-not-opened`` where pyzmq is missing.

    """
    try:
        import zmq
    except ImportError as error:
        raise fail(
            "link-not-opened",
            "queries to nodes use ZeroMQ, which needs the package `pyzmq`",
            help="install it: pip install 'fsmkit[links]'",
        ) from error
    nodes = tuple(endpoints)
    found: dict[int, Health] = {}
    with zmq.Context() as context:
        poller = zmq.Poller()
        places: dict[zmq.Socket[bytes], int] = {}
        try:
            for place, (name, endpoint) in enumerate(nodes):
                socket = context.socket(zmq.REQ)
                socket.setsockopt(zmq.LINGER, 0)
                socket.setsockopt(zmq.MAXMSGSIZE, LONGEST)
                places[socket] = place
                try:
                    socket.connect(endpoint)
                except zmq.ZMQError as error:
                    found[place] = Health(name, endpoint, is_ok=False, status=str(error))
                    continue
                socket.send(b"R", zmq.DONTWAIT)
                poller.register(socket, zmq.POLLIN)
            end = time.monotonic() + seconds
            while len(found) < len(nodes) and (ready := poller.poll(_milliseconds(end))):
                for socket, _ in ready:
                    name, endpoint = nodes[places[socket]]
                    found[places[socket]] = read_answer(name, endpoint, socket.recv())
                    poller.unregister(socket)
        finally:
            for socket in places:
                socket.close()
    silent = f"no answer within {seconds:g} s"
    return tuple(
        found.get(place) or Health(name, endpoint, is_ok=False, status=silent)
        for place, (name, endpoint) in enumerate(nodes)
    )


def _milliseconds(end: float) -> int:
    return max(0, round(1000 * (end - time.monotonic())))


def read_answer(node: str, endpoint: str, answer: bytes) -> Health:
    """Return the health in an answer; an answer of another form is not ok."""
    if answer[:1] == b"E":
        refusal = answer[1:].decode(errors="replace")
        return Health(node, endpoint, is_ok=False, status=f"rejects the request: {refusal}")
    try:
        report: object = parse_json(answer[1:]) if answer[:1] == b"R" else None
    except ValueError:
        report = None
    match report:
        case {"ok": bool(is_ok), "status": str(status), **others}:
            rest = {str(key): value for key, value in others.items()}
            return Health(node, endpoint, is_ok, status, MappingProxyType(rest))
    return Health(node, endpoint, is_ok=False, status="the answer has no `ok` and `status`")
