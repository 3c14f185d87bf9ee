"""The values of the interpreter: snapshots, causes of steps, and effects of steps.

All are frozen and hashable. A step is a function of a `Snapshot` and an event, and its effects are
values in the returned `Macrostep`. States, transitions and events are indices of the Chart; times
are ticks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from fsmkit.chart.statements import Destination
from fsmkit.language import Value

# --- events and timers ---------------------------------------------------


@dataclass(frozen=True, slots=True)
class Occurrence:
    """An event with its payload: a value for each declared field, in order."""

    event: int
    payload: tuple[Value, ...] = ()


@dataclass(frozen=True, slots=True)
class Timeout:
    """The delay of an ``after`` or ``every`` transition has passed. Not an event, never queued."""

    transition: int


@dataclass(frozen=True, slots=True)
class Delayed:
    """A pending ``send`` with a delay."""

    occurrence: Occurrence
    destination: Destination = Destination.SELF
    id: str | None = None
    peer: str | None = None
    invocations: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Timer:
    """Something due at ``deadline`` (ticks, absolute)."""

    deadline: int
    what: Timeout | Delayed


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A machine between two macrosteps.

    ``configuration`` holds the active states and the root; it stays as it was when the machine
    stops, in a final configuration or with a fault. ``data`` holds the values of data and then of
    outputs, in the order of the chart. ``history`` is sorted by state; a history state without a
    recorded value is absent. ``timers`` is in order of (deadline, arming). ``now`` is the time of
    the latest macrostep. ``running``: started, not finished, no fault. ``invoked`` holds, for each
    invocation of the chart, the machine that runs in it.
    """

    configuration: frozenset[int]
    data: tuple[Value, ...]
    inputs: tuple[Value, ...]
    history: tuple[tuple[int, frozenset[int]], ...] = ()
    queue: tuple[Occurrence, ...] = ()
    deferred: tuple[Occurrence, ...] = ()
    timers: tuple[Timer, ...] = ()
    now: int = 0
    running: bool = False
    finished: bool = False
    fault: str | None = None
    invoked: tuple[Snapshot | None, ...] = ()

    def with_queues(
        self,
        now: int,
        queue: tuple[Occurrence, ...],
        deferred: tuple[Occurrence, ...],
        timers: tuple[Timer, ...],
    ) -> Snapshot:
        """Return a copy with other queues and time; faster than `replace`."""
        return Snapshot(
            self.configuration,
            self.data,
            self.inputs,
            self.history,
            queue,
            deferred,
            timers,
            now,
            self.running,
            self.finished,
            self.fault,
            self.invoked,
        )


# --- effects, in the order in which they happened ---------------------------------------------


@dataclass(frozen=True, slots=True)
class Exited:
    """A state was left; its ``onexit`` content follows."""

    state: int


@dataclass(frozen=True, slots=True)
class Taken:
    """A transition was taken; its content follows. Initial and default ones only with content."""

    transition: int


@dataclass(frozen=True, slots=True)
class Entered:
    """A state was entered; its ``onentry`` content follows."""

    state: int


@dataclass(frozen=True, slots=True)
class Posted:
    """An operation posted an event to its caller; ``fits``: the queue had a free entry.

    It precedes the call in which it was posted.
    """

    occurrence: Occurrence
    fits: bool


@dataclass(frozen=True, slots=True)
class Called:
    """An operation of the host was called; ``result`` is None for one without a result."""

    operation: str
    arguments: tuple[Value, ...]
    result: Value | None


@dataclass(frozen=True, slots=True)
class Emitted:
    """An event left the machine by its port; the host delivers it."""

    occurrence: Occurrence
    peer: str | None = None

    @property
    def is_leaving(self) -> bool:
        """Return whether the event goes to the host, not to another machine (SCXML 6.2.4)."""
        return self.peer is None or not self.peer.startswith("#_")


@dataclass(frozen=True, slots=True)
class Raised:
    """An event was raised by content: put in the internal queue."""

    occurrence: Occurrence


@dataclass(frozen=True, slots=True)
class Sent:
    """An event was sent to the own external queue."""

    occurrence: Occurrence


@dataclass(frozen=True, slots=True)
class Postponed:
    """A ``send`` with a delay (ticks) was noted."""

    what: Delayed
    delay: int


@dataclass(frozen=True, slots=True)
class Cancelled:
    """Pending delayed sends of this id, if any, were dropped."""

    id: str


@dataclass(frozen=True, slots=True)
class Logged:
    """A ``log`` statement."""

    label: str
    values: tuple[Value, ...]


@dataclass(frozen=True, slots=True)
class Replied:
    """An answer to the event being dispatched; the last of a macrostep counts."""

    value: Value


@dataclass(frozen=True, slots=True)
class RaisedError:
    """The platform raised an error event; ``reason`` is for people."""

    event: str
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Unhandled:
    """An event, external or internal, enabled no transition and no active state defers it."""

    event: int


@dataclass(frozen=True, slots=True)
class InvokedMacrostep:
    """An invoked machine took a macrostep."""

    invocation: int
    macrostep: Macrostep


@dataclass(frozen=True, slots=True)
class Deferred:
    """An event was kept, because an active state defers it."""

    event: int


@dataclass(frozen=True, slots=True)
class SpentTimeout:
    """A timeout's guard was false; an ``after`` is armed again when its state is re-entered."""

    transition: int


@dataclass(frozen=True, slots=True)
class Overflowed:
    """An event was dropped, because ``queue`` (``queue``, ``internal`` or ``delayed``) was full."""

    queue: str


@dataclass(frozen=True, slots=True)
class Faulted:
    """The machine stops: ``microsteps``, ``internal``, ``range``, or the name of an error event."""

    reason: str


Effect = (
    Exited
    | Taken
    | Entered
    | Posted
    | Called
    | Emitted
    | Raised
    | Sent
    | Postponed
    | Cancelled
    | Logged
    | Replied
    | RaisedError
    | Unhandled
    | Deferred
    | SpentTimeout
    | Overflowed
    | Faulted
    | InvokedMacrostep
)


# --- steps ------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Microstep:
    """The transitions of one optimal enabled set and their effects (SCXML 3.13).

    ``event`` is None for eventless transitions and for the first entry. ``transitions`` is in
    document order; ``exited`` and ``entered`` are in order of execution. A selection without
    transitions is a microstep only if it had effects, such as an unhandled event or a failed
    guard.
    """

    event: Occurrence | Timeout | None
    transitions: tuple[int, ...]
    exited: tuple[int, ...]
    entered: tuple[int, ...]
    effects: tuple[Effect, ...]


@dataclass(frozen=True, slots=True)
class Start:
    """The cause of the first macrostep."""


@dataclass(frozen=True, slots=True)
class InvokedRun:
    """The cause of a macrostep in which only invoked machines continued."""


@dataclass(frozen=True, slots=True)
class Cancellation:
    """The invoker left the state that holds this machine."""


Cause = Occurrence | Timeout | Delayed | Start | InvokedRun | Cancellation | None


@dataclass(frozen=True, slots=True)
class Macrostep:
    """One step between two stable configurations (SCXML 3.13).

    ``event`` is the cause: None for eventless transitions that a changed input enabled, `Delayed`
    if a delayed event only left by the port. ``before`` no longer holds the event in its queue.
    ``at`` is its time in ticks; for a timer, its deadline. The macrosteps of invoked machines are
    included.
    """

    before: Snapshot
    event: Cause
    microsteps: tuple[Microstep, ...]
    after: Snapshot
    at: int

    @property
    def effects(self) -> tuple[Effect, ...]:
        """All effects, in order."""
        return tuple(effect for step in self.microsteps for effect in step.effects)

    @property
    def reply(self) -> Value | None:
        """The value of the last ``reply``, if there was one."""
        replies = [effect.value for effect in self.effects if isinstance(effect, Replied)]
        return replies[-1] if replies else None


@runtime_checkable
class Chance(Protocol):
    """A host that picks the delays of an environment; without it, delays are maximal."""

    def delay(self, least: int, greatest: int) -> int:
        """Return a number of ticks within the bounds."""
        ...


Post = Callable[[Occurrence], bool]
"""Puts an event into the queue of a machine in the middle of a step; false if it does not fit."""


class Host(Protocol):
    """The environment of a machine that a step needs: its operations.

    A host whose operations post events also has a method ``accept_posts(chart, post)``. Each step
    calls it with the chart of the machine, or of an invoked machine, and a `Post`. A host that
    looks at the machine during a call has a method ``accept_view(chart, view)``, where ``view()``
    returns the machine as it is. Its method ``emitted(chart, occurrence)`` takes what leaves.
    """

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Perform an operation; a value of its result type, or None where it returns nothing."""
        ...
