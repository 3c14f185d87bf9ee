"""A running machine for Python programs: friendly names around the pure interpreter."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import wraps
from typing import Any, Protocol, TypeVar

from fsmkit.chart.chart import Chart, Data, every_operation
from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.language import Value
from fsmkit.language.units import read_microseconds
from fsmkit.language.values import from_python, to_python
from fsmkit.runtime import interpreter, saving, snapshot_bytes
from fsmkit.runtime.clock import Clock, SimulatedClock
from fsmkit.runtime.host_methods import (
    BoundHost,
    Delivery,
    deliver,
    find,
    missing_operations,
)
from fsmkit.runtime.interpreter.globals import Guard
from fsmkit.runtime.interpreter.snapshot import (
    Emitted,
    InvokedMacrostep,
    Macrostep,
    Occurrence,
    Snapshot,
)
from fsmkit.runtime.interpreter.trace import active_leaves, trace_lines
from fsmkit.runtime.script import help_for, is_received

Class = TypeVar("Class", bound=type)
KEPT = 10_000
"""Macrosteps that a session remembers by default."""


class Recording(Protocol):
    """An observer that records the calls of a session (`fsmkit.runtime.tracing.recorder`)."""

    def started(self, before: Snapshot, step: Macrostep) -> None:
        """Take a start."""

    def posted(self, occurrence: Occurrence) -> None:
        """Take an event that was posted, whether it found room or not."""

    def ran(
        self,
        before: Snapshot,
        now: int,
        steps: Sequence[Macrostep],
        dispatched: Occurrence | None = None,
    ) -> None:
        """Take a call that ran the machine, or dispatched an event to it."""

    def restored(self, snapshot: Snapshot, now: int) -> None:
        """Take a machine that was restored."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of `Session.dispatch`: whether the event enabled a transition, and the reply."""

    handled: bool
    reply: object = None

    def __bool__(self) -> bool:
        return self.handled


class Session:
    """A machine that runs a chart.

    ``operations`` performs the chart's operations: an object with a method for each, or a mapping
    of functions. Events that leave the machine are passed to its methods ``on_<event>`` (payload
    by name) and ``on_event``, and stored in ``sent``. ``clock`` is the time source (default:
    simulated). ``inputs`` holds initial values by name. The machine is started unless ``start`` is
    False.
    ``keep`` is the number of macrosteps that ``trace`` stores. ``seed`` picks the delays that a
    chart of an environment gives as intervals. ``watch`` evaluates guards, to observe their
    decisions.

    Enumeration members are strings, arrays lists, records dictionaries. Not thread-safe.
    """

    def __init__(
        self,
        chart: Chart,
        operations: object = None,
        clock: Clock | None = None,
        *,
        inputs: Mapping[str, object] | None = None,
        on_event: Callable[[Delivery], object] | None = None,
        start: bool = True,
        keep: int = KEPT,
        seed: int = 0,
        watch: Guard | None = None,
    ) -> None:
        given: object = chart
        if not isinstance(given, Chart):
            raise TypeError(
                f"a session runs a chart, not a {type(given).__name__}: fsmkit.read_chart(path)"
            )
        self.chart = chart
        self.clock: Clock = SimulatedClock() if clock is None else clock
        self.snapshot: Snapshot = interpreter.initial(chart)
        """The present state of the machine: a value that can be stored and set again."""
        self.trace: deque[Macrostep] = deque(maxlen=keep)
        self.sent: deque[Delivery] = deque(maxlen=keep)
        self.inputs: MutableMapping[str, object] = Inputs(self)
        self._operations = operations
        self._host = BoundHost(chart, operations, seed, watch)
        self._on_event = on_event
        self._is_stepping = False
        self.observers: list[Callable[[int, tuple[Macrostep, ...]], object]] = []
        """Called after each change of the machine, with 0 and its macrosteps.

        The observers of a `SystemSession` get the number of the machine instead of 0.
        """
        self.recorders: list[Recording] = []
        """Record each call of the host with its steps."""
        self.inputs.update(inputs or {})
        if start:
            self.start()

    # --- running -------------------------------------------------------------------------------

    def start(self) -> tuple[Macrostep, ...]:
        """Start or restart: data get their initial values, inputs keep their values."""
        with self._stepping("start"):
            before = self.snapshot
            done = interpreter.start(self.chart, self.now, self._host, before.inputs)
        for recorder in self.recorders:
            recorder.started(before, done)
        return self._finish((done,))

    def post(self, event: str, *values: object, **fields: object) -> bool:
        """Append an event to the queue, with its payload by position or by name.

        Return False if the queue is full or the machine is not running. An operation may post,
        too: its event enters the queue immediately and is taken after the step, as in generated
        code. If the step raises an exception, the step is undone and the event is discarded.
        """
        return self.enqueue(occurrence_of(self.chart, event, values, fields))

    def enqueue(self, occurrence: Occurrence) -> bool:
        """Put an event in the queue, as `post` does."""
        if self._host.post is not None:
            return self._host.post(occurrence)
        posted = self._posted(occurrence)
        if posted is not None:
            self._change(posted)
        return posted is not None

    def drive(self, place: int, value: Value) -> None:
        """Give an input, by its place, a value of its type."""
        inputs = (*self.snapshot.inputs[:place], value, *self.snapshot.inputs[place + 1 :])
        self._change(replace(self.snapshot, inputs=inputs))

    def run(self, now: int | None = None) -> tuple[Macrostep, ...]:
        """Process all events and timers up to ``now`` (ticks; default: the clock's time)."""
        with self._stepping("run"):
            at = self.now if now is None else now
            before = self.snapshot
            done = interpreter.run(self.chart, before, at, self._host)
        for recorder in self.recorders:
            recorder.ran(before, at, done)
        return self._finish(done)

    def advance(self, duration: str | int) -> tuple[Macrostep, ...]:
        """Let simulated time pass, ``"500ms"`` or a number of ticks, and run."""
        if not isinstance(self.clock, SimulatedClock):
            raise fail(
                "clock-not-simulated",
                f"`advance` cannot move a `{type(self.clock).__name__}`",
                help="use a `SimulatedClock`, or let time pass and call `run`",
            )
        try:
            tick = self.chart.capacities.tick
            passed = read_microseconds(duration) if isinstance(duration, str) else duration * tick
            self.clock.advance(passed)
        except ValueError as error:
            raise fail("wrong-value", f"the duration {error}") from error
        return self.run()

    def dispatch(self, event: str, *values: object, **fields: object) -> Outcome:
        """Process one event immediately, ahead of the queue; see `Outcome`."""
        occurrence = occurrence_of(self.chart, event, values, fields)
        if not self.snapshot.running:
            return Outcome(handled=False)
        with self._stepping("dispatch"):
            before, now = self.snapshot, self.now
            done, handled, reply = interpreter.dispatch(
                self.chart, before, occurrence, now, self._host
            )
        for recorder in self.recorders:
            recorder.ran(before, now, (done,), occurrence)
        self._finish((done,))
        type_ = self.chart.events[occurrence.event].reply
        shown = reply if reply is None or type_ is None else to_python(reply, type_)
        return Outcome(handled, shown)

    # --- looking -------------------------------------------------------------------------------

    @property
    def now(self) -> int:
        """The clock's time in ticks."""
        return self.clock.microseconds() // self.chart.capacities.tick

    @property
    def next_deadline(self) -> int | None:
        """Return the deadline of the first timer in ticks, or None."""
        return interpreter.next_deadline(self.snapshot)

    @property
    def configuration(self) -> tuple[str, ...]:
        """The active states in document order, without the root."""
        return _configuration(self.chart, self.snapshot)

    @property
    def active(self) -> tuple[str, ...]:
        """The active atomic states in document order."""
        return tuple(active_leaves(self.chart, self.snapshot))

    def is_in(self, state: str) -> bool:
        """Whether a state is active."""
        known = self.chart.state_index
        if state not in known:
            raise _unknown("state", state, list(known))
        return known[state] in self.snapshot.configuration

    @property
    def is_running(self) -> bool:
        """Whether it is started, not finished and without a fault."""
        return self.snapshot.running

    @property
    def is_finished(self) -> bool:
        """Whether it ended in a top-level final state."""
        return self.snapshot.finished

    @property
    def fault(self) -> str | None:
        """Why the machine stopped, if it stopped by a fault."""
        return self.snapshot.fault

    @property
    def invoked(self) -> dict[str, tuple[str, ...]]:
        """The active states of the running invoked machines, by the ids of their invocations.

        Nested invocations have both ids, as in traces: ``outer: inner``.
        """
        return dict(_invoked(self.chart, self.snapshot))

    @property
    def data(self) -> dict[str, object]:
        """The values of data, by name."""
        found = values_by_name(self.chart, self.snapshot)
        return {one.name: found[one.name] for one in self.chart.data}

    @property
    def outputs(self) -> dict[str, object]:
        """The values of outputs, by name."""
        found = values_by_name(self.chart, self.snapshot)
        return {one.name: found[one.name] for one in self.chart.outputs}

    def __getitem__(self, name: str) -> object:
        found = values_by_name(self.chart, self.snapshot)
        if name not in found:
            raise _unknown("variable", name, list(found))
        return found[name]

    def trace_text(self) -> str:
        """Return the trace as lines (see `fsmkit.runtime.interpreter.trace`)."""
        return "\n".join(trace_lines(self.chart, self.trace))

    # --- saving --------------------------------------------------------------------------------

    def save(self) -> dict[str, Any]:
        """Return the machine as data that `json` can write."""
        return saving.save(self.chart, interpreter.at_time(self.snapshot, self.now))

    def save_bytes(self) -> bytes:
        """Return the machine as generated C and Python save it, too."""
        return snapshot_bytes.pack(self.chart, interpreter.at_time(self.snapshot, self.now))

    def restore(self, saved: Mapping[str, Any] | bytes) -> None:
        """Continue from the result of `save` or `save_bytes`; rejects that of another chart."""
        with self._stepping("restore"):
            if isinstance(saved, bytes):
                self._change(snapshot_bytes.unpack(self.chart, saved, self.now))
            else:
                self._change(saving.restore(self.chart, saved, self.now))
            for recorder in self.recorders:
                recorder.restored(self.snapshot, self.now)

    # --- inside --------------------------------------------------------------------------------

    @contextmanager
    def _stepping(self, what: str) -> Iterator[None]:
        """Guard against a step inside a step, which the standard does not define."""
        if self._is_stepping:
            raise fail(
                "step-within-step",
                f"`{what}` was called from within a step of the same machine",
                help="use `post` in an operation; the event is taken after the step",
            )
        self._is_stepping = True
        try:
            yield
        finally:
            self._is_stepping = False
            self._host.post = None

    def _finish(self, done: tuple[Macrostep, ...]) -> tuple[Macrostep, ...]:
        """Keep the result of a step, then deliver its events."""
        if done:
            self.snapshot = done[-1].after
        self.trace.extend(done)
        self._change(self.snapshot, done)
        for macrostep in done:
            self._deliver_all(self.chart, macrostep)
        return done

    def _posted(self, occurrence: Occurrence) -> Snapshot | None:
        """Return the machine with an event more in its queue; None if there is no room."""
        for recorder in self.recorders:
            recorder.posted(occurrence)
        return interpreter.post(self.chart, self.snapshot, occurrence)

    def _change(self, snapshot: Snapshot, done: tuple[Macrostep, ...] = ()) -> None:
        """Set the snapshot, after steps or without any, and notify the observers."""
        self.snapshot = snapshot
        for observer in self.observers:
            observer(0, done)

    def _deliver_all(self, chart: Chart, macrostep: Macrostep) -> None:
        """Deliver all outgoing events, including those of invoked machines."""
        for effect in macrostep.effects:
            match effect:
                case Emitted() if effect.is_leaving:
                    self._deliver(chart, effect)
                case InvokedMacrostep(slot, within):
                    self._deliver_all(chart.invocations[slot].chart, within)
                case _:
                    pass

    def _deliver(self, chart: Chart, effect: Emitted) -> None:
        event = chart.events[effect.occurrence.event]
        values = zip(event.fields, effect.occurrence.payload, strict=True)
        fields = {field.name: to_python(value, field.type) for field, value in values}
        delivery = Delivery(event.name, fields, effect.peer)
        self.sent.append(delivery)
        deliver(self._operations, delivery)
        if self._on_event is not None:
            self._on_event(delivery)


class Inputs(MutableMapping[str, object]):
    """The inputs of a machine, by name; there are exactly those that the chart declares."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def _place(self, name: str) -> int:
        names = [variable.name for variable in self._session.chart.inputs]
        if name not in names:
            raise _unknown("input", name, names)
        return names.index(name)

    def __getitem__(self, name: str) -> object:
        place = self._place(name)
        type_ = self._session.chart.inputs[place].type
        return to_python(self._session.snapshot.inputs[place], type_)

    def __setitem__(self, name: str, value: object) -> None:
        place = self._place(name)
        declared = self._session.chart.inputs[place]
        try:
            stored = from_python(value, declared.type)
        except ValueError as error:
            raise fail("wrong-value", f"the input `{name}` {error}", declared.span) from error
        self._session.drive(place, stored)

    def __delitem__(self, name: str) -> None:
        raise TypeError(f"an input cannot be removed: {name}")

    def __iter__(self) -> Iterator[str]:
        return (variable.name for variable in self._session.chart.inputs)

    def __len__(self) -> int:
        return len(self._session.chart.inputs)


def _configuration(chart: Chart, snapshot: Snapshot) -> tuple[str, ...]:
    return tuple(chart.states[state].id for state in sorted(snapshot.configuration - {0}))


def _invoked(chart: Chart, snapshot: Snapshot) -> Iterator[tuple[str, tuple[str, ...]]]:
    for invocation, child in zip(chart.invocations, snapshot.invoked, strict=True):
        if child is not None:
            yield invocation.id, _configuration(invocation.chart, child)
            for inner, active in _invoked(invocation.chart, child):
                yield f"{invocation.id}: {inner}", active


def variables(chart: Chart, snapshot: Snapshot) -> Iterator[tuple[Data, Value]]:
    """Yield data, outputs and inputs with their values."""
    declared = (*chart.data, *chart.outputs, *chart.inputs)
    return zip(declared, (*snapshot.data, *snapshot.inputs), strict=True)


def values_by_name(chart: Chart, snapshot: Snapshot) -> dict[str, object]:
    """Return the values of data, outputs and inputs, as Python values."""
    return {one.name: to_python(value, one.type) for one, value in variables(chart, snapshot)}


def occurrence_of(
    chart: Chart, name: str, values: Sequence[object], fields: Mapping[str, object]
) -> Occurrence:
    """Return an event that a host posts, its payload by position or by name.

    `FsmkitError` for an event that the chart does not receive, and for values that do not fit.
    """
    known = (chart.events[index] for index in chart.event_index.values())
    events = {event.name: event for event in known if is_received(event)}
    if name not in events:
        raise _unknown("event", name, list(events))
    event = events[name]
    names = [field.name for field in event.fields]
    given: dict[str, object] = dict(zip(names, values, strict=False)) | dict(fields)
    if set(given) != set(names) or len(values) + len(fields) != len(names):
        raise fail(
            "wrong-value",
            f"the event `{name}` takes {', '.join(f'`{n}`' for n in names) or 'no values'}",
            event.span,
            help="give each field once",
        )
    payload = []
    for field in event.fields:
        try:
            payload.append(from_python(given[field.name], field.type))
        except ValueError as error:
            raise fail(
                "wrong-value", f"`{field.name}` of the event `{name}` {error}", event.span
            ) from error
    return Occurrence(event.index, tuple(payload))


def _unknown(kind: str, name: str, known: Sequence[str]) -> FsmkitError:
    help_ = help_for(kind, name, known)
    return fail("unknown-at-run-time", f"the chart has no {kind} `{name}`", help=help_)


def bind(chart: Chart, clock: Callable[[], Clock] = SimulatedClock) -> Callable[[Class], Class]:
    """Return a class decorator that gives each object a running `Session` as its ``machine``.

    The machine starts when ``__init__`` has returned, on the clock that ``clock`` returns. Missing
    methods for operations are an error when the class is defined.
    """

    def decorate(cls: Class) -> Class:
        missing = [one for one in every_operation(chart).values() if find(cls, one.name) is None]
        if missing:
            raise missing_operations(chart, missing)
        initialise: Callable[..., None] = cls.__init__  # type: ignore[misc]

        @wraps(initialise)
        def with_machine(self: Any, *args: Any, **kwargs: Any) -> None:
            initialise(self, *args, **kwargs)
            if type(self).__init__ is with_machine:
                self.machine = Session(chart, self, clock(), start=False)
                self.machine.start()

        cls.__init__ = with_machine  # type: ignore[misc]
        return cls

    return decorate
