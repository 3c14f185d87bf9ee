"""Introductions: each node proves to every other that it is the one at its own endpoint.

A node sends each peer a *hello* over its connection to the endpoint of this peer. The hello
contains a token, a random number that it sends nowhere else. Only the program at that endpoint can
return the token, in a hello of its own; then the connection that carried it belongs to the peer. So
nobody can listen in the name of a node without being at its endpoint, or on the route to it. With
keys a hello counts only for the node whose key was shown.

The same bytes as in ``fsm_link_hello.c``; docs/reference/links.md describes them.
"""

from __future__ import annotations

import secrets
import struct
from dataclasses import dataclass

HELLO = struct.Struct("<BBIQQ")
"""A mark, the sender, its session, its token for the receiver, the receiver's as received."""
MARK = 0x3F
"""No frame starts with it."""
ROUTE = 5
"""Bytes of the route that ZeroMQ gives a connection that names none of its own."""
GONE = 2.0
"""Seconds without a hello after which a peer listens no more."""


@dataclass(frozen=True, slots=True)
class Listener:
    """A listening peer: its route, its session, and the time of its last hello."""

    route: bytes
    session: int
    heard: float


class Introductions:
    """The hellos of a node, and its knowledge from those of others. Bounded by nodes."""

    def __init__(self, node: int, nodes: int, session: int) -> None:
        self.node = node
        self.session = session
        self.listeners: dict[int, Listener] = {}
        self.tokens = [secrets.randbelow(2**64 - 1) + 1 for _ in range(nodes)]
        self.heard = [0] * nodes
        """The tokens of peers; 0: none yet."""

    def hello(self, peer: int) -> bytes:
        """Return the hello for a peer."""
        return HELLO.pack(MARK, self.node, self.session, self.tokens[peer], self.heard[peer])

    def receive(self, content: bytes, route: bytes, key_of: int | None, now: float) -> int | None:
        """Process a hello from a route; return the node that listens there, None for none.

        ``key_of``: the node whose key was shown; None without keys.
        """
        if len(content) != HELLO.size or len(route) != ROUTE or content[0] != MARK:
            return None
        node: int
        _, node, session, token, echo = HELLO.unpack(content)
        if node >= len(self.tokens) or node == self.node or session == 0 or token == 0:
            return None
        if key_of is not None and key_of != node:
            return None
        if echo != self.tokens[node]:
            if node not in self.listeners:  # not to be disturbed by an impostor once it is known
                self.heard[node] = token
            return None
        self.heard[node] = token
        self.listeners[node] = Listener(route, session, now)
        return node

    def forget(self, node: int) -> None:
        """Treat a peer as gone."""
        self.listeners.pop(node, None)

    def pass_time(self, now: float) -> None:
        """Treat peers as gone that have been silent for long."""
        for node, listener in list(self.listeners.items()):
            if now - listener.heard > GONE:
                self.forget(node)
