"""A closed system as a network of finite automata with queues between them.

Each machine is an automaton over its *local states*: active states, data, histories, timers, and
connected inputs, without its queue, which is beside it. A move of one machine is a step of the
system. It takes the head of the queue or not, goes to another local state, and then, in order,
appends messages to queues and sends values, which change local states at once.

The network contains only behaviour of some global state. A tool that finds other behaviour possible
disagrees with the explorer, so the other tool checks that, too.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass

from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.verify.statespace.actions import Action, Mover, Step
from fsmkit.verify.statespace.closed_system import ClosedSystem


@dataclass(frozen=True, slots=True)
class Local:
    """A local state. ``name`` is an identifier, ``text`` its description.

    ``waiting``: events in a queue that is part of it. The others refer to the state with an empty
    queue. ``awaited``: a timer is armed; ``busy``: there is work; ``fair``: some external event is
    fair; ``at_rest``: it may stay there forever.
    """

    name: str
    text: str
    snapshot: Snapshot
    waiting: int = 0
    awaited: bool = False
    busy: bool = False
    fair: bool = False
    at_rest: bool = False

    @property
    def has_work(self) -> bool:
        """Whether work remains although the queue beside it is empty."""
        return self.busy or self.waiting > 0

    @property
    def running(self) -> bool:
        """Whether the machine has not stopped."""
        return self.snapshot.running

    @property
    def faulted(self) -> bool:
        """Whether it stopped with a fault."""
        return self.snapshot.fault is not None


@dataclass(frozen=True, slots=True)
class Sent:
    """A message, by its number among those of the target."""

    target: int
    message: int


@dataclass(frozen=True, slots=True)
class Move:
    """A step of a machine, from ``source`` to ``target``.

    ``taken``: the message at the head of the queue. Without one, ``needs_empty``: the queue must be
    empty. ``from_outside``: it may occur while few events wait; ``fair``: it occurs some time, if
    it stays possible. ``shown``: the label, for all payloads that the system does not distinguish
    from this one, ``f(code = 0..2)``.
    """

    source: int
    target: int
    step: Step
    mover: Mover
    label: str
    shown: str
    taken: int | None = None
    needs_empty: bool = False
    from_outside: bool = False
    fair: bool = False
    sent: tuple[Sent, ...] = ()
    faults: bool = False

    @property
    def action(self) -> Action:
        """The kind of the step."""
        return self.step.action


@dataclass(frozen=True, slots=True)
class Arrival:
    """A possible message to a machine: an event for its queue, or a value, which acts at once."""

    name: str
    text: str
    is_event: bool


@dataclass(frozen=True, slots=True)
class Automaton:
    """A machine. ``queue``: the capacity of its queue; 0 if part of the local states, or unused.

    ``receives``: the local state after a message that is not queued, and whether there was no space
    for it. ``elapsed``: that after a unit of time. ``contents``: the possible contents of the
    queue.
    """

    name: str
    is_environment: bool
    is_monitor: bool
    queue: int
    locals: tuple[Local, ...]
    moves: tuple[Move, ...]
    arrivals: tuple[Arrival, ...]
    receives: Mapping[tuple[int, int], tuple[int, bool]]
    elapsed: Mapping[int, int]
    contents: tuple[tuple[int, ...], ...]

    def where(self, test: Callable[[Local], bool]) -> set[int]:
        """Return the local states, by number, that pass a test."""
        return {number for number, local in enumerate(self.locals) if test(local)}

    def waiting(self) -> Iterator[tuple[int, set[int]]]:
        """Yield numbers of events within local states, with the states that have so many."""
        for count in sorted({local.waiting for local in self.locals} - {0}):
            yield count, {n for n, local in enumerate(self.locals) if local.waiting == count}

    def queues(self, message: int) -> bool:
        """Whether a message goes to the queue beside the machine."""
        return self.queue > 0 and self.arrivals[message].is_event

    def received(self, message: int) -> dict[int, tuple[int, bool]]:
        """Return the effect of an unqueued message on each local state (`receives`)."""
        return {local: after for (local, m), after in self.receives.items() if m == message}

    def stops(self, move: Move) -> bool:
        """Whether the machine stops by a move."""
        return self.locals[move.source].running and not self.locals[move.target].running

    def signature(self, move: Move) -> Hashable:
        """Return the condition of a move, its messages, and whether the machine stops by it.

        Moves of one signature can share an option of a process, or an edge. A chart with an
        unrestricted environment has a hundred paths into each error state: separately they are more
        than tools read.
        """
        when = move.action, move.taken, move.needs_empty, move.from_outside
        return when, move.sent, move.faults, self.stops(move)


def is_idle(changes: Mapping[int, int]) -> bool:
    """Whether no local state changes."""
    return all(before == after for before, after in changes.items())


@dataclass(frozen=True, slots=True)
class Place:
    """A machine in a global state: its local state, and the contents of its queue."""

    local: int
    queue: tuple[int, ...] = ()


@dataclass(frozen=True)
class Network:
    """The automata of a closed system, and the number of global states and steps."""

    closed: ClosedSystem
    automata: tuple[Automaton, ...]
    initial: tuple[tuple[Place, ...], ...]
    starts: tuple[tuple[Step, ...], ...]
    """How the machines start, for each initial state."""
    states: int
    transitions: int

    @property
    def name(self) -> str:
        """The name of the system."""
        return self.closed.system.name

    @property
    def monitors(self) -> list[int]:
        """The machines that move first: monitors."""
        return [n for n, automaton in enumerate(self.automata) if automaton.is_monitor]

    @property
    def plant(self) -> list[int]:
        """The machines that move next: those of the environment."""
        environment = (n for n, a in enumerate(self.automata) if a.is_environment)
        return [n for n in environment if not self.automata[n].is_monitor]
