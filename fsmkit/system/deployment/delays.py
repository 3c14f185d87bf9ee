"""Maximum latencies of connections over a carrier, and the system with these delays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from fsmkit.diagnostics import Span
from fsmkit.system.channels import CAPACITY, ChannelOptions, channel
from fsmkit.system.machine import EventLink, Machine
from fsmkit.system.system import System

Connection = tuple[str, int, str, int]
"""The machine that sends, its port, the machine that receives, and its event."""


@dataclass(frozen=True, slots=True)
class Latency:
    """How late events may come, in microseconds, by connection. ``span``: what carries them."""

    late: Mapping[Connection, int]
    span: Span


def connection_of(system: System, link: EventLink) -> Connection:
    """Return a connection by the names of its machines: the same in each form of a system."""
    source, target = system.machines[link.source].name, system.machines[link.target].name
    return source, link.port, target, link.event


def with_delays(system: System, latency: Latency) -> System:
    """Return a system in which events may take as long as the carrier's latencies.

    Connections that buffer, delay or lose messages already are not changed.
    """
    links: list[EventLink] = []
    added: list[Machine] = []
    for link in system.event_links:
        late = latency.late.get(connection_of(system, link))
        ends = system.machines[link.source], system.machines[link.target]
        if late is None or any(end.is_channel for end in ends):
            links.append(link)
            continue
        tick = ends[1].chart.capacities.tick
        options = ChannelOptions(CAPACITY, 0, -(-late // tick))
        number = len(system.machines) + len(added)
        machines = (*system.machines, *added)
        made, enter, leave = channel(link, options, machines, number, latency.span)
        added.append(made)
        links += [enter, leave]
    return replace(system, machines=(*system.machines, *added), event_links=tuple(links))
