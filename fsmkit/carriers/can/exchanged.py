"""The messages that a node exchanges with a foreign one: those of its file, as values of a link."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from fsmkit.carriers.can.chart_of_dbc import names_of_silence
from fsmkit.carriers.can.dbc import Dbc, Message, Signal, word
from fsmkit.carriers.can.deployment import buses_of
from fsmkit.carriers.can.foreign import event_message, level_signals
from fsmkit.carriers.can.message import CanWire
from fsmkit.chart.chart import Chart
from fsmkit.language import Field, Type, Value
from fsmkit.system.deployment.deployment import Deployment
from fsmkit.system.deployment.event_map import LEVELS, End
from fsmkit.system.machine import port_fields


@dataclass(frozen=True, slots=True)
class CanWires:
    """The messages between a node and a foreign one. ``silences``: (index in `received`, event)."""

    peer: int
    received: tuple[CanWire, ...]
    sent: tuple[CanWire, ...]
    silences: tuple[tuple[int, int], ...]
    start: tuple[Value, ...]
    """The levels of the foreign node before messages with them have come."""


def can_wires(deployment: Deployment, node: int) -> Iterator[CanWires]:
    """Yield the messages between a node and each foreign one that has a DBC file."""
    for peer, bus in buses_of(deployment).items():
        found = _Wires(deployment, bus.dbc, node, peer).wires()
        if found.received or found.sent or found.silences:
            yield found


def types_of(deployment: Deployment, sender: int, number: int | None) -> tuple[Type, ...]:
    """Return the types of the values in a payload."""
    if number == LEVELS:
        return tuple(level.type for level in deployment.map.levels_of(sender))
    if number is None:
        return ()
    return tuple(field.type for field in deployment.map.messages[number - 1].fields)


class _Wires:
    def __init__(self, deployment: Deployment, dbc: Dbc, node: int, peer: int) -> None:
        self.deployment = deployment
        self.map = deployment.map
        self.dbc = dbc
        self.node = node
        self.peer = peer

    def wires(self) -> CanWires:
        received = self._with_others([*self._levels(self.peer), *self._events(self.peer)])
        watched = [wire.message.name for wire in received]
        silences = []
        for message, number in self._silences():
            if message.name not in watched:
                watched.append(message.name)
                received.append(CanWire(message, None, _parts(message, {})))
            silences.append((watched.index(message.name), number))
        sent = [*self._levels(self.node), *self._events(self.node)]
        start = [
            next(
                output.init.value
                for output in self._machine(level.source).outputs
                if output.name == level.source.name
            )
            for level in self.map.levels_of(self.peer)
        ]
        return CanWires(self.peer, tuple(received), tuple(sent), tuple(silences), tuple(start))

    def _machine(self, end: End) -> Chart:
        machines = self.deployment.system.machines
        return next(m.chart for m in machines if m.name == end.machine)

    def _node_of(self, end: End) -> str:
        name = self._machine(end).name
        return next(node for node in self.dbc.nodes if word(node) == word(name))

    def _levels(self, sender: int) -> Iterator[CanWire]:
        """Yield the cyclic messages with levels from one node to the other."""
        places: dict[str, tuple[Message, dict[str, list[int]]]] = {}
        ends = {self.node, self.peer}
        for place, level in enumerate(self.map.levels_of(sender)):
            if sender == self.node and level.receiver not in ends:
                continue
            end = level.source if sender == self.peer else level.target
            message, signal = level_signals(self.dbc, self._node_of(end))[end.name]
            _, own = places.setdefault(message.name, (message, {}))
            own.setdefault(signal.name, []).append(place)
        is_heard = any(level.receiver == self.node for level in self.map.levels_of(self.peer))
        if sender == self.node or is_heard:
            for message, own in places.values():
                yield CanWire(message, LEVELS, _parts(message, own))

    def _events(self, sender: int) -> Iterator[CanWire]:
        """Yield the event messages from one node to the other."""
        for part in self.map.messages:
            if {part.sender, part.receiver} != {self.node, self.peer} or part.sender != sender:
                continue
            end = part.source if sender == self.peer else part.target
            message = event_message(self.dbc, self._node_of(end), end.name)
            if message is not None:
                own = {field.name: [place] for place, field in enumerate(self._fields(part.number))}
                yield CanWire(message, part.number, _parts(message, own))

    def _fields(self, number: int) -> tuple[Field, ...]:
        """Return the fields of a message, in the order of the payload, named as in the file."""
        link = self.deployment.wires.events[number - 1]
        message = self.map.messages[number - 1]
        if message.sender != self.peer:
            return message.fields
        sent = port_fields(self.deployment.system.machines[link.source].chart, link.port)
        return tuple(sent[place] for place in link.arguments)

    def _silences(self) -> Iterator[tuple[Message, int]]:
        names = names_of_silence(self.dbc)
        for part in self.map.messages:
            if (part.sender, part.receiver) != (self.peer, self.node):
                continue
            for message in self.dbc.messages:
                if names.get(message.name) == part.source.name:
                    yield message, part.number

    def _with_others(self, wires: list[CanWire]) -> list[CanWire]:
        """Return messages with their variants for other values of their multiplexers."""
        known = {wire.message.name for wire in wires}
        frames = {(wire.message.frame, wire.message.is_extended) for wire in wires}
        for key in sorted(frames):
            others = (m for m in self.dbc.by_frame[key] if m.name not in known)
            wires += [CanWire(replace(message, signals=()), None, ()) for message in others]
        return wires


def _parts(message: Message, places: dict[str, list[int]]) -> tuple[tuple[Signal, int | None], ...]:
    found: list[tuple[Signal, int | None]] = []
    for signal in message.signals:
        own: list[int] = places.get(signal.name, [])
        found += [(signal, place) for place in own] if own else [(signal, None)]
    return tuple(found)
