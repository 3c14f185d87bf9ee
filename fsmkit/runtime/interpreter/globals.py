"""The global variables of Appendix D, alive during one macrostep."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Callable

from fsmkit.chart.chart import Chart, Transition
from fsmkit.language import ContentError, Environment, Value
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter.index import index_of

Receiver = Callable[[snap.Occurrence], bool]
"""Takes an event for the machine that invoked this one; false if its queue is full."""
Guard = Callable[[Chart, Transition, Environment], Value]
"""Evaluates the guard of a transition: the value, and the errors, of `evaluate`."""


class Globals:
    """Thawed from a Snapshot, changed by the procedures, frozen again; never seen outside.

    It is also the environment in which the expressions of the chart are evaluated.
    """

    def __init__(
        self,
        chart: Chart,
        snapshot: snap.Snapshot,
        host: snap.Host,
        invoker: Receiver | None = None,
    ) -> None:
        self.chart = chart
        self.index = index_of(chart)
        self.host = host
        self.watch: Guard | None = getattr(host, "guard", None)
        """Evaluates guards for a host that observes their decisions."""
        self.configuration = set(snapshot.configuration)
        self.data = list(snapshot.data)
        self.inputs = snapshot.inputs
        self.history = dict(snapshot.history)
        self.queue = list(snapshot.queue)
        self.deferred = list(snapshot.deferred)
        self.timers = list(snapshot.timers)
        self.now = snapshot.now
        self.running = snapshot.running
        self.finished = snapshot.finished
        self.fault = snapshot.fault
        self.internal: deque[snap.Occurrence] = deque()
        self.invoked = list(snapshot.invoked)
        self.states_to_invoke: set[int] = set()
        """Entered in this macrostep and not left since (Appendix D, statesToInvoke)."""
        self.invoker = invoker
        self.is_cancelled = False
        self.event: snap.Occurrence | None = None
        """SCXML 5.10.1, ``_event``: the current event, until the next is taken."""
        self.budget = chart.capacities.microsteps
        self.guards: dict[int, bool] = {}
        """Results of the guards of this selection."""
        self.locals: dict[str, Value] = {}
        """Local variables of the current handler; each is assigned at its declaration."""
        self.effects: list[snap.Effect] = []
        self.microsteps: list[snap.Microstep] = []
        self.after_microstep: Callable[[Chart, snap.Snapshot], None] | None
        self.after_microstep = getattr(host, "after_microstep", None)
        """Is given the machine between microsteps, if the host wants it."""
        accept_posts = getattr(host, "accept_posts", None)
        if accept_posts is not None:
            accept_posts(chart, self.post)
        accept_view = getattr(host, "accept_view", None)
        if accept_view is not None:
            accept_view(chart, self.freeze)
        self.notify_emission: Callable[[Chart, snap.Occurrence], None] | None
        self.notify_emission = getattr(host, "emitted", None)

    def freeze(self) -> snap.Snapshot:
        """Return the machine as it is now."""
        return snap.Snapshot(
            frozenset(self.configuration),
            tuple(self.data),
            self.inputs,
            tuple(sorted(self.history.items())) if self.history else (),
            tuple(self.queue),
            tuple(self.deferred),
            tuple(self.timers),
            self.now,
            self.running,
            self.finished,
            self.fault,
            tuple(self.invoked),
        )

    def close_microstep(
        self,
        event: snap.Occurrence | snap.Timeout | None,
        transitions: tuple[int, ...] = (),
        exited: tuple[int, ...] = (),
        entered: tuple[int, ...] = (),
    ) -> None:
        """Append a microstep with the effects since the last call."""
        done = snap.Microstep(event, transitions, exited, entered, tuple(self.effects))
        self.microsteps.append(done)
        self.effects = []
        if self.after_microstep is not None:
            self.after_microstep(self.chart, self.freeze())

    # --- queues, errors and faults -------------------------------------------------------------

    def enqueue_internal(self, occurrence: snap.Occurrence) -> None:
        """Append to the internal queue; a full one is a fault."""
        if len(self.internal) < self.chart.capacities.internal:
            self.internal.append(occurrence)
        else:
            self.effects.append(snap.Overflowed("internal"))
            self.stop("internal")

    @property
    def has_room(self) -> bool:
        """Whether the external queue takes one more event, deferred ones included."""
        return len(self.queue) + len(self.deferred) < self.chart.capacities.queue

    def enqueue_external(self, occurrence: snap.Occurrence) -> None:
        """Append to the own external queue; when it is full, the event is dropped."""
        if self.has_room:
            self.queue.append(occurrence)
        else:
            self.effects.append(snap.Overflowed("queue"))

    def post(self, occurrence: snap.Occurrence) -> bool:
        """Append an event that an operation posts; false if it is full or the machine has ended."""
        fits = self.running and self.has_room
        if fits:
            self.queue.append(occurrence)
        self.effects.append(snap.Posted(occurrence, fits))
        return fits

    def emit(self, occurrence: snap.Occurrence, peer: str | None) -> None:
        """Let an event leave the machine by its port; a host may want to know at once."""
        if self.notify_emission is not None:
            self.notify_emission(self.chart, occurrence)
        self.effects.append(snap.Emitted(occurrence, peer))

    def enqueue_at_invoker(self, occurrence: snap.Occurrence) -> None:
        """Send to the machine that invoked this one; nothing any more when that cancels it."""
        self.effects.append(snap.Emitted(occurrence, "#_parent"))
        if self.is_cancelled:
            return
        if self.invoker is None or not self.invoker(occurrence):
            self.effects.append(snap.Overflowed("queue"))

    def raise_platform(self, name: str) -> None:
        """Append a platform event (``done.state.x``), if the chart mentions it."""
        event = self.chart.event_index.get(name)
        if event is not None:
            self.enqueue_internal(snap.Occurrence(event, self.index.blank[event]))

    def error(self, name: str, reason: str) -> None:
        """Raise an error event of the platform (SCXML 3.12.2)."""
        self.effects.append(snap.RaisedError(name, reason))
        self.raise_platform(name)

    def stop(self, reason: str) -> None:
        """Put the machine into a fault; the first one counts."""
        if self.fault is None:
            self.fault = reason
            self.effects.append(snap.Faulted(reason))

    def insert_timer(self, timer: snap.Timer) -> None:
        """Insert a timer behind those that are due no later."""
        place = bisect_right(self.timers, timer.deadline, key=lambda other: other.deadline)
        self.timers.insert(place, timer)

    # --- the environment of expressions --------------------------------------------------------

    def variable(self, name: str) -> Value:
        """Return the value of a variable."""
        slot = self.index.slots.get(name)
        if slot is None:
            return self.locals[name]
        return self.data[slot] if slot >= 0 else self.inputs[-1 - slot]

    def event_field(self, name: str) -> Value:
        """Return field `name` of the current event's payload.

        Raises `ContentError` if the current event has no such field.
        """
        if self.event is None:
            raise ContentError(f"`{name}` of an event is read, but no event is current")
        slot = self.index.field_slots[self.event.event].get(name)
        if slot is None:
            event = self.chart.events[self.event.event].name
            raise ContentError(f"the event `{event}` has no `{name}`")
        return self.event.payload[slot]

    def event_name(self) -> str:
        """Return the name of the current event, or an empty string without an event."""
        return "" if self.event is None else self.chart.events[self.event.event].name

    def event_type(self) -> str:
        """Return the type of the current event (SCXML 5.10.1); empty without an event."""
        return "" if self.event is None else self.chart.events[self.event.event].type

    def is_in(self, state: int) -> bool:
        """Whether a state is active (SCXML 5.9.2, ``In``)."""
        return state in self.configuration

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Call an operation of the host."""
        result = self.host.call(operation, arguments)
        self.effects.append(snap.Called(operation, arguments, result))
        return result

    def range_error(self) -> None:
        """Report that a value was brought to the nearest bound of its range."""
        self.error("error.range", "a value outside its range was brought to the nearest bound")
