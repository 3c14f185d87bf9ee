"""Protocols of carriers: plug-ins that connect the nodes of a deployment.

A carrier reads its part of a deployment: a `Network` for the links between nodes of fsmkit, and a
`ForeignNetwork` for each foreign node. Only the carrier interprets them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, runtime_checkable

from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.document.keys import Keys
from fsmkit.plugins import plugins
from fsmkit.system.deployment.crossing import Wires
from fsmkit.system.deployment.delays import Latency
from fsmkit.system.deployment.event_map import EventMap
from fsmkit.system.system import System
from fsmkit.yaml.nodes import Node

DEFAULT = "zeromq"
"""The kind of links in a deployment that names none."""


@dataclass(frozen=True)
class ForeignNode:
    """A node whose programs do not use fsmkit: its machines are models of these programs.

    ``options``: its entry in `links: {foreign: ...}`, by the keys of its kind.
    """

    kind: str
    span: Span
    options: Mapping[str, Text]
    tables: Mapping[str, Node] = field(default_factory=dict, compare=False)
    """Those that are no text."""


@dataclass(frozen=True)
class DeploymentRequest:
    """The input of a carrier that reads its part of a deployment."""

    system: System
    """Without the models of its connections."""
    nodes: tuple[str, ...]
    placed: tuple[int | None, ...]
    """By machine: its node; None for the environment's."""
    foreign: tuple[ForeignNode | None, ...]
    """By node: what it is, None where it runs machines of fsmkit."""
    wires: Wires
    folder: Path
    """The folder of the deployment: paths are relative to it."""
    options: Mapping[str, Text]
    """The options in `links`, by the carrier's keys."""
    tables: Mapping[str, Node]
    """Those that are no text."""
    every: int
    """Levels are published in every so-many-th cycle."""
    cycle: int | None
    """Microseconds from cycle to cycle of the nodes, if the schedule of the system says so."""

    @property
    def map(self) -> EventMap:
        """The event map of the deployment."""
        return self.wires.map

    def machines_of(self, place: int) -> tuple[int, ...]:
        """Return the numbers of the machines on a node."""
        return tuple(number for number, node in enumerate(self.placed) if node == place)


class Network(Protocol):
    """The network between nodes of fsmkit, as its carrier read it."""

    @property
    def carrier(self) -> str:
        """The name of the carrier."""
        ...


ForeignNetwork = object
"""The network of a foreign node, as its carrier read it."""


@runtime_checkable
class Carrier(Protocol):
    """Carries frames between nodes of fsmkit: a plug-in. A `LinkKind` of the same name opens it."""

    name: str
    """The kind, as `links: {kind: ...}` names it."""
    link_keys: Keys
    """The keys of `links` that it has, besides those of all carriers.

    A key ``period`` is the cycle of the nodes.
    """
    required_keys: Mapping[str, str]
    """Those that links need, each with an example of a value."""

    def read(self, request: DeploymentRequest, findings: Findings) -> Network | None:
        """Return the network between the nodes; None if links need none, or after an error."""
        ...


@runtime_checkable
class ForeignCarrier(Protocol):
    """Connects nodes with foreign ones: a plug-in. A `TranslatorKind` of the same name opens it."""

    name: str
    """The kind, as `{foreign: ...}` of a node names it."""
    foreign_keys: Keys
    """The keys of a foreign node in `links: {foreign: ...}`."""

    def read_foreign(
        self, place: int, request: DeploymentRequest, network: Network | None, findings: Findings
    ) -> ForeignNetwork | None:
        """Return the network of a foreign node, by index; None without one, or after an error.

        ``network``: the network between the nodes of fsmkit, of any carrier.
        """
        ...


@runtime_checkable
class Delaying(Protocol):
    """Computes the maximum latency of events: a plug-in that is a carrier, too."""

    name: str

    def latencies(
        self,
        request: DeploymentRequest,
        network: Network | None,
        foreign: Mapping[int, ForeignNetwork],
        findings: Findings,
    ) -> Iterable[Latency]:
        """Yield the latencies of connections, which `check` adds to the system.

        ``foreign``: the results of `ForeignCarrier.read_foreign` of the plug-in, by node.
        """
        ...


def link_carriers() -> dict[str, Carrier]:
    """Return the carriers of links between nodes of fsmkit, by name."""
    return {found.name: found for found in plugins(Carrier)}


def foreign_carriers() -> dict[str, ForeignCarrier]:
    """Return the carriers that connect foreign nodes, by name."""
    return {found.name: found for found in plugins(ForeignCarrier)}
