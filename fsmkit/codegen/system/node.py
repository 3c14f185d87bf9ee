"""A node of a deployment, as the generator of its C sees it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from fsmkit.chart.chart import Chart
from fsmkit.codegen.system.parts import named_charts
from fsmkit.emit import Namer, snake
from fsmkit.runtime.links import EventMap
from fsmkit.system.deployment.deployment import Deployment
from fsmkit.system.system import System


@dataclass(frozen=True)
class Node:
    """A node of a deployment: its machines as a system of their own, and their names.

    ``numbers``: the numbers of its machines in the whole system, by their position here.
    """

    deployment: Deployment
    place: int
    system: System
    numbers: tuple[int, ...]
    charts: tuple[Chart, ...]

    @property
    def map(self) -> EventMap:
        """The values and events that cross the nodes."""
        return self.deployment.map

    @property
    def name(self) -> str:
        """The name of the node."""
        return self.deployment.nodes[self.place]

    @property
    def prefix(self) -> str:
        """The prefix of its functions."""
        return snake(self.system.name)

    @property
    def words(self) -> tuple[str, ...]:
        """The endings of the nodes' identifiers, by position."""
        return node_words(self.deployment.nodes)

    def position_of(self, machine: int) -> int:
        """Return the position of a machine of the whole system."""
        return self.numbers.index(machine)


def node_words(nodes: Iterable[str]) -> tuple[str, ...]:
    """Return the endings of nodes' identifiers: in capitals, distinct without regard to case."""
    namer = Namer()
    return tuple(namer.name(name.upper()) for name in nodes)


def nodes_of(deployment: Deployment) -> tuple[Node, ...]:
    """Return the nodes with machines of fsmkit."""
    return tuple(_node(deployment, place) for place in deployment.own_nodes)


def _node(deployment: Deployment, place: int) -> Node:
    numbers, system = deployment.machines_of(place), deployment.part(place)
    begins = tuple(
        replace(link, source=numbers.index(link.source))
        for link in deployment.wires.events
        if link.source in numbers
    )
    named = replace(system, event_links=(*system.event_links, *begins))
    return Node(deployment, place, system, numbers, named_charts(named))
