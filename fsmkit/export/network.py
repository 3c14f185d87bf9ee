"""A closed system as a network of finite automata with queues between them.

Each machine is an automaton over its *local states*: active states, data, histories, timers, and
wired inputs, all but its queue, which stands beside it. A move of one machine is a step of the
system: it takes the head of the queue or not, goes to another local state, and then, in order,
appends messages to queues and tells other machines values, which change their local states at once.

Only what some global state has is in it. A notation in which something else turns out to be
possible disagrees with the explorer, so the other tool judges that, too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.verify.statespace.actions import Action, Step, Who
from fsmkit.verify.statespace.closed_system import ClosedSystem


@dataclass(frozen=True, slots=True)
class Local:
    """A local state. ``name`` is an identifier, ``text`` what it means.

    ``waiting``: events in a queue that is part of it. The others are of the state with an empty
    queue: ``awaited``, a timer is armed; ``busy``, there is something to do; ``owed``, something
    comes from outside some time; ``at_rest``, it may stay there for ever.
    """

    name: str
    text: str
    snapshot: Snapshot
    waiting: int = 0
    awaited: bool = False
    busy: bool = False
    owed: bool = False
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
    queue must be empty. ``from_outside``: it may happen while few events wait (`PATIENCE`);
    ``owed``: it does happen some time, if it stays possible.
    """

    source: int
    target: int
    step: Step
    who: Who
    label: str
    taken: int | None = None
    needs_empty: bool = False
    from_outside: bool = False
    owed: bool = False
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
