"""Compute the event map of a system and a placement of its machines."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TypeVar

from fsmkit.chart.chart import Event
from fsmkit.language import Field
from fsmkit.system.deployment.event_map import End, EventMap, LevelType, MessageType
from fsmkit.system.machine import EventLink, InputLink, port_fields, port_name
from fsmkit.system.system import System

Wire = TypeVar("Wire", EventLink, InputLink)


@dataclass(frozen=True)
class Wires:
    """The event map, with the connection of each message and each level."""

    map: EventMap
    events: tuple[EventLink, ...]
    """By number of the message, from 1."""
    levels: tuple[InputLink, ...]
    """In the order of the levels."""


def wires_of(
    system: System,
    nodes: tuple[str, ...],
    placed: tuple[int | None, ...],
    endpoints: tuple[str, ...] = (),
    *,
    is_insecure: bool = False,
    foreign: tuple[str, ...] = (),
) -> Wires:
    """Return the connections that cross nodes; ``placed[machine]`` is its node, or None."""
    events = tuple(_crossing(system.event_links, placed))
    inputs = tuple(_crossing(system.input_links, placed))
    messages = tuple(
        MessageType(
            number,
            placed[link.source] or 0,
            placed[link.target] or 0,
            _source(system, link),
            End(system.machines[link.target].name, _event(system, link).name),
            _fields(system, link),
        )
        for number, link in enumerate(events, 1)
    )
    levels = tuple(_level(system, link, placed) for link in inputs)
    map_ = EventMap(system.name, nodes, messages, levels, endpoints, is_insecure, foreign)
    return Wires(map_, events, inputs)


def _source(system: System, link: EventLink) -> End:
    machine = system.machines[link.source]
    return End(machine.name, port_name(machine.chart, link.port))


def _event(system: System, link: EventLink) -> Event:
    return system.machines[link.target].chart.events[link.event]


def _fields(system: System, link: EventLink) -> tuple[Field, ...]:
    """Return the receiver's names with the sender's types: the range of values that can arrive."""
    sent = port_fields(system.machines[link.source].chart, link.port)
    wanted = _event(system, link).fields
    return tuple(
        Field(part.name, sent[place].type)
        for part, place in zip(wanted, link.arguments, strict=True)
    )


def _level(system: System, link: InputLink, placed: tuple[int | None, ...]) -> LevelType:
    source, target = system.machines[link.source], system.machines[link.target]
    output, variable = source.chart.outputs[link.output], target.chart.inputs[link.input]
    return LevelType(
        placed[link.source] or 0,
        placed[link.target] or 0,
        End(source.name, output.name),
        End(target.name, variable.name),
        output.type,
    )


def _crossing(links: Iterable[Wire], placed: tuple[int | None, ...]) -> Iterator[Wire]:
    for link in links:
        source, target = placed[link.source], placed[link.target]
        if source is not None and target is not None and source != target:
            yield link
