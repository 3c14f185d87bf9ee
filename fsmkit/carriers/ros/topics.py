"""Topics of ROS 2: of connections with a foreign node, and of frames between nodes of fsmkit."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from fsmkit.carriers.ros.messages import RosType, lower, unique
from fsmkit.carriers.ros.services import RosService
from fsmkit.diagnostics import Findings, Text
from fsmkit.emit import Identifier
from fsmkit.language import Type, Value
from fsmkit.system.deployment.event_map import EventMap

ROS = "ros"
"""The name of the carrier."""
QOS = ("default", "state", "sensor")
"""Reliable and volatile; reliable and kept for who comes late; best effort."""
TOPIC = re.compile(r"/?(?!.*__)[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)
MOST_TOPIC = 200
"""Characters of a topic, or of a prefix of topics; rmw takes 246 with its prefixes."""


@dataclass(frozen=True, slots=True)
class RosTopic:
    """A topic. ``qos``: one of `QOS`; ``is_event``: every message of it counts."""

    name: str
    type: RosType
    qos: str
    is_event: bool


@dataclass(frozen=True, slots=True)
class RosPart:
    """A value of a payload. ``field``: of the message; None: the message itself is the duration."""

    field: Identifier | None
    type: Type


@dataclass(frozen=True, slots=True)
class RosWire:
    """A connection between a node and the foreign one.

    ``number``: of the event map, or `LEVELS`; ``place``: of a level among those of its sender;
    ``parts``: by the indices of the values; ``tick``: of durations, in microseconds.
    """

    topic: RosTopic
    sender: int
    receiver: int
    number: int
    place: int
    parts: tuple[RosPart, ...]
    tick: int


@dataclass(frozen=True, slots=True)
class RosNode:
    """A foreign node of ROS. ``start``: its levels before their first message.

    ``is_insecure``: its programs may run on other computers; else the domain is confined to this
    one.
    """

    domain: int
    namespace: str
    wires: tuple[RosWire, ...]
    start: tuple[Value, ...]
    is_insecure: bool = False
    services: tuple[RosService, ...] = ()
    """Services of events with a result; by rclpy, as `lifecycle`."""
    lifecycle: Mapping[str, int] = field(default_factory=dict)
    """By transition of a node's life, the number of the event that it posts."""

    def peers(self, map_: EventMap) -> frozenset[int]:
        """Return the nodes that it is connected to, and itself."""
        numbers = [*(each.number for each in self.services), *self.lifecycle.values()]
        asked = (map_.messages[number - 1].receiver for number in numbers)
        ends = (end for wire in self.wires for end in (wire.sender, wire.receiver))
        return frozenset((*ends, *asked))

    @property
    def needs_rclpy(self) -> bool:
        """Whether it has more than topics."""
        return bool(self.services or self.lifecycle)

    @property
    def types(self) -> tuple[RosType, ...]:
        """The types of its topics, each once."""
        return tuple(dict.fromkeys(wire.topic.type for wire in self.wires))


@dataclass(frozen=True, slots=True)
class RosNet:
    """The topics of frames: ``<namespace>/<node>/frames``, "" for a foreign node, by index."""

    domain: int
    namespace: str
    frames: tuple[str, ...]

    @property
    def carrier(self) -> str:
        """The name of the carrier."""
        return ROS


def frame_topics(map_: EventMap, namespace: str | None) -> tuple[str, ...]:
    """Return the topics of frames by node; without a namespace it is the name of the system."""
    given = lower(map_.system) if namespace is None else namespace.strip("/")
    taken: set[str] = set()
    names = [unique(lower(name), taken) for name in map_.nodes]
    return tuple(
        f"/{given}/{name}/frames" if place in map_.own_nodes else ""
        for place, name in enumerate(names)
    )


def is_topic(text: Text, what: str, findings: Findings) -> bool:
    """Return whether a string is a valid topic or namespace; otherwise report it."""
    is_one = len(text.value) <= MOST_TOPIC and TOPIC.fullmatch(text.value) is not None
    if not is_one:
        findings.add(
            "unexpected-value",
            f"`{text}` is not a {what} of ROS",
            text,
            help="use names of letters, digits and single `_`, with `/` between them, of at most "
            f"{MOST_TOPIC} characters",
        )
    return is_one
