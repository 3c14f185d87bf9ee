"""A closed system as a network of finite automata with queues between them.

Each machine is an automaton over its *local states*: active states, data, histories, timers, and
wired inputs, all but its queue, which stands beside it. A move of one machine is a step of the
system: it takes the head of the queue or not, goes to another local state, and then, in order,
appends messages to queues and tells other machines values, which change their local states at once.

Only what some global state has is in it. A notation in which something else turns out to be
possible disagrees with the explorer, so the other tool evaluates that, too.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass

from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.verify.statespace.actions import Action, Step, Who
from fsmkit.verify.statespace.closed_system import ClosedSystem


@dataclass(frozen=True, slots=True)
class Local:
    """A local state. ``name`` is an identifier, ``text`` what it means.

    ``waiting``: events in a queue that is part of it. The others are of the state with an empty
    queue: ``awaited``, a timer is armed; ``busy``, there is something to do; ``fair``, something
    comes from outside some time; ``at_rest``, it may stay there for ever.
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
        """Whether something is left to do, though the queue beside it is empty."""
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

    ``taken``: the message at the head of the queue. Without one, ``needs_empty`` says that the
    queue must be empty. ``from_outside``: it may happen while few events wait; ``fair``: it does
    happen some time, if it stays possible. ``shown``: the label, for all payloads that nothing in
    the system distinguishes from this one, ``f(code = 0..2)``.
    """

    source: int
    target: int
    step: Step
    who: Who
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
        """What kind of step it is."""
        return self.step.action


@dataclass(frozen=True, slots=True)
class Arrival:
    """What may come to a machine: an event for its queue, or a value, which counts at once."""

    name: str
    text: str
    is_event: bool


@dataclass(frozen=True, slots=True)
class Automaton:
    """A machine. ``queue``: what its queue holds; 0 if it is part of the local states, or unused.

    ``receives``: the local state after a message that does not go to a queue, and whether there was
    no room for it. ``elapsed``: that after a unit of time. ``contents``: what the queue can hold.
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
        """Return the local states, by number, of which something holds."""
        return {number for number, local in enumerate(self.locals) if test(local)}

    def waiting(self) -> Iterator[tuple[int, set[int]]]:
        """Yield how many events wait within local states, and in which so many do."""
        for count in sorted({local.waiting for local in self.locals} - {0}):
            yield count, {n for n, local in enumerate(self.locals) if local.waiting == count}

    def queues(self, message: int) -> bool:
        """Whether a message goes to the queue that stands beside the machine."""
        return self.queue > 0 and self.arrivals[message].is_event

    def received(self, message: int) -> dict[int, tuple[int, bool]]:
        """Return what a message that goes to no queue does to each local state (`receives`)."""
        return {local: after for (local, m), after in self.receives.items() if m == message}

    def stops(self, move: Move) -> bool:
        """Whether the machine stops by a move."""
        return self.locals[move.source].running and not self.locals[move.target].running

    def signature(self, move: Move) -> Hashable:
        """Return when a move may happen, what it tells others, and whether the machine stops by it.

        Moves of one signature can share an option of a process, or an edge. A chart that stands
        open has a hundred ways into each state of its error: one by one they are more than tools
        read.
        """
        when = move.action, move.taken, move.needs_empty, move.from_outside
        return when, move.sent, move.faults, self.stops(move)


def is_idle(changes: Mapping[int, int]) -> bool:
    """Whether no local state changes."""
    return all(before == after for before, after in changes.items())


@dataclass(frozen=True, slots=True)
class Place:
    """A machine in a global state: its local state, and what its queue holds."""

    local: int
    queue: tuple[int, ...] = ()


@dataclass(frozen=True)
class Network:
    """The automata of a closed system, and how many global states and steps the explorer found."""

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
