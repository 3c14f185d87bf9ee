"""A node in Python over ZeroMQ that does as ``link_player.c`` does: c, l, k, p, q, s.

``python -m tests.runtime.links.link_player NODE SESSION ENDPOINT_A ENDPOINT_B``
"""

from __future__ import annotations

import sys
import time
from dataclasses import astuple

import fsmkit
from fsmkit.carriers.zeromq.link import ZeroMqLink
from fsmkit.plugins import plugin
from fsmkit.runtime.links import Link, LinkKind, LinkRequest, LinkTimeout
from fsmkit.system.deployment.deployment import Deployment
from tests.runtime.links.conftest import TALK

LEVELS: dict[str, dict[str, object]] = {
    "a": {"west.speed -> east.speed": 7, "west.lit -> judge.lit": False},
    "b": {"judge.mood -> west.mood": "cross"},
}
OTHER = {"a": "b", "b": "a"}
HITS = {"a": "west.hit -> east.ball", "b": "east.hit -> west.ball"}


def say(*words: object) -> None:
    """Print a line."""
    sys.stdout.write(" ".join(map(str, words)) + "\n")


class Node:
    """A link, and what it received."""

    def __init__(self, link: Link, name: str) -> None:
        self.link = link
        self.name = name
        self.got = 0

    def cycle(self) -> None:
        """Take what came, let out what was sent."""
        self.link.begin_cycle()
        while self.link.receive() is not None:
            self.got += 1
        self.link.end_cycle(LEVELS[self.name])

    def obey(self, line: str) -> None:
        """Do what is said."""
        link = self.link
        match line.split():
            case ["c"]:
                self.cycle()
            case ["s", n]:
                link.send(link.map.message(HITS[self.name], n=int(n), last=False))
            case ["l", milliseconds]:
                try:
                    link.wait_listeners(int(milliseconds) / 1000)
                    say("ready:")
                except LinkTimeout as error:
                    say(f"timeout: {error}")
            case ["k"]:
                assert isinstance(link, ZeroMqLink)
                listener = link._known.listeners.get(1 - link.node)
                say(0 if listener is None else listener.session, link.dropped)
            case ["p"]:
                counted = " ".join(map(str, astuple(link.counters(OTHER[self.name]))))
                say(f"{OTHER[self.name]} session {counted} silence 0")
                say("totals", link.sent, link.refused, link.malformed, link.foreign)
                say(f"got {self.got}\n.")
        sys.stdout.flush()


def main() -> None:
    """Obey until the input ends."""
    name, session, *endpoints = sys.argv[1:]
    options = {"endpoints": dict(zip("ab", endpoints, strict=True)), "slots": 64}
    deployment = fsmkit.read(TALK)
    assert isinstance(deployment, Deployment)
    event_map = deployment.map
    kind = plugin(LinkKind, "zeromq")
    node = Node(kind.open(LinkRequest(event_map, name, int(session), options=options)), name)
    for line in sys.stdin:
        if line == "q\n":
            break
        node.obey(line)
    began = time.monotonic()
    node.link.close()
    say(int((time.monotonic() - began) * 1000))
    sys.stdout.flush()


if __name__ == "__main__":
    main()
