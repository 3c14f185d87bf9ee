"""Name the events of a network, and list those in which each machine and queue takes part."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from fsmkit.emit import telling
from fsmkit.export.cspm.events import (
    NOBODY,
    Demand,
    Event,
    OnMachine,
    OnQueue,
    events_of,
    on_machine,
    on_queue,
)
from fsmkit.export.cspm.identifiers import TAKEN
from fsmkit.export.identifiers import Names, word
from fsmkit.export.network import Move, Network


@dataclass(frozen=True, slots=True)
class MachineNames:
    """The names of a machine: of its equations, its local states, its messages.

    ``channel``: that of its visible events.
    """

    channel: str
    process: str
    queue: str
    closed: str
    unseen: str
    steps: str
    locals: tuple[str, ...]
    messages: tuple[str, ...]


@dataclass
class Alphabet:
    """All events. ``moves``: for each machine its moves with their possible events.

    ``received`` and ``queued``: the events that are equivalent to a machine, or to a queue.
    """

    network: Network
    names: Names = field(default_factory=lambda: Names(TAKEN))
    machines: tuple[MachineNames, ...] = ()
    events: dict[Event, str] = field(default_factory=dict)
    labels: dict[str, str] = field(default_factory=dict)
    """By what happens, for all payloads that are alike: the name that people see."""
    visible: dict[tuple[int, str], str] = field(default_factory=dict)
    """By machine and label of an event: the same name."""
    moves: list[list[tuple[Move, str]]] = field(default_factory=list)
    received: list[dict[OnMachine, list[str]]] = field(default_factory=list)
    queued: list[dict[OnQueue, list[str]]] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Choose all names, the visible ones first."""
        network, names = self.network, self.names
        channels = [names.take(automaton.name) for automaton in network.automata]
        for automaton in network.automata:
            for move in automaton.moves:
                if move.shown not in self.labels:
                    self.labels[move.shown] = names.take(word(move.shown))
        for machine, automaton in enumerate(network.automata):
            found = []
            for move in automaton.moves:
                self.visible[machine, move.label] = self.labels[move.shown]
                for event in events_of(network, move, machine):
                    if event not in self.events:
                        text = f"{channels[machine]}_{word(event.label)}"
                        self.events[event] = names.take(text)
                    found.append((move, self.events[event]))
            self.moves.append(found)
        self.machines = tuple(self._names_of(n, channel) for n, channel in enumerate(channels))
        for machine in range(len(network.automata)):
            self._concerns(machine)

    def _names_of(self, machine: int, channel: str) -> MachineNames:
        automaton, new = self.network.automata[machine], self.names.take
        upper = channel.upper()
        return MachineNames(
            channel,
            new(upper),
            new(f"{upper}_QUEUE"),
            new(f"{upper}_QUEUE_CLOSED"),
            new(f"{upper}_UNSEEN"),
            new(f"{upper}_STEPS"),
            tuple(new(f"{upper}_{local.name}") for local in automaton.locals),
            tuple(new(f"{channel}_gets_{arrival.name}") for arrival in automaton.arrivals),
        )

    def _concerns(self, machine: int) -> None:
        received: dict[OnMachine, list[str]] = {}
        queued: dict[OnQueue, list[str]] = {}
        for event, name in self.events.items():
            if event.machine != machine:
                to_machine = on_machine(self.network, event, machine)
                if to_machine is not None:
                    received.setdefault(to_machine, []).append(name)
            if self.network.automata[machine].queue:
                to_queue = on_queue(self.network, event, machine)
                if to_queue is not None:
                    queued.setdefault(to_queue, []).append(name)
        self.received.append(received)
        self.queued.append(queued)

    def own(self, machine: int) -> list[str]:
        """Return the steps of a machine."""
        return [name for event, name in self.events.items() if event.machine == machine]

    @telling
    def about(self, event: Event) -> str:
        """Return a description of an event."""
        return f"{event.label}: {', '.join(self._about(event)) or 'no message'}"

    def _about(self, event: Event) -> Iterator[str]:
        automata = self.network.automata
        if event.taken is not None:
            yield f"takes {automata[event.machine].arrivals[event.taken].text}"
        if event.own is Demand.EMPTY:
            yield "nothing waits for it"
        if event.own is Demand.SOME:
            yield "while something waits for it"
        if event.waiting is not None:
            holder = event.waiting
            one = "nothing" if holder == NOBODY else f"one event for {automata[holder].name}"
            yield f"external, while {one} waits"
        for sent in event.sent:
            target = automata[sent.target]
            verb = "posts to" if target.queues(sent.message) else "sends to"
            yield f"{verb} {target.name}: {target.arrivals[sent.message].text}"
        if event.stops:
            yield "stops"
