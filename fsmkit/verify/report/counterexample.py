"""Convert a path to readable steps: machine, cause, effects, time; the interpreter replays it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction

from fsmkit.chart.chart import Chart
from fsmkit.chart.walk import charts_within
from fsmkit.emit import telling
from fsmkit.language import Field, Value
from fsmkit.language.values import show
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.runtime.interpreter.trace import texts_of, trace_lines, value_text
from fsmkit.system.freezes import Hold, cause_of
from fsmkit.system.shared import type_of_slot, written_value
from fsmkit.verify.statespace.actions import Action, Chooser, Message, Mover, Step
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.exploration import Trail
from fsmkit.verify.statespace.local_steps import LocalSteps
from fsmkit.verify.statespace.sessions import effects_within


@dataclass(frozen=True, slots=True)
class Delivery:
    """A message from one machine to another; ``what`` is its text."""

    target: str
    what: str
    is_event: bool


@dataclass(frozen=True, slots=True)
class TraceStep:
    """One step of a counterexample.

    ``at``: whole microseconds since the start; None in an untimed exploration. ``machine`` is empty
    while time passes. ``before`` and ``after``: the active leaves of the machine. ``lines`` are
    those of the trace, the same for every runtime. ``chosen``: inputs with new values, and results
    of operations.
    """

    at: int | None
    machine: str
    action: Action
    cause: str
    before: tuple[str, ...]
    after: tuple[str, ...]
    lines: tuple[str, ...]
    chosen: tuple[str, ...] = ()
    deliveries: tuple[Delivery, ...] = ()
    step: Step | None = field(default=None, compare=False, repr=False)
    done: snap.Macrostep | None = field(default=None, compare=False, repr=False)
    messages: tuple[Message, ...] = field(default=(), compare=False, repr=False)
    state: snap.Snapshot | None = field(default=None, compare=False, repr=False)
    """The machine after it, with what does not count as state cleared."""


@dataclass(frozen=True, slots=True)
class Counterexample:
    """A path. ``loop``: the number of the step from which on the steps repeat forever."""

    steps: tuple[TraceStep, ...]
    trail: Trail = ()
    loop: int | None = None
    replayed: tuple[str, ...] = ("interpreter",)
    """The runtimes that performed it, line by line alike."""
    differs: str = ""
    """Where a runtime did something else: a bug of ours."""
    loses: bool = False
    """Some event found a queue full and was lost."""
    is_longer: bool = False
    """There may be shorter ones."""


class ReplayError(Exception):
    """A step of a path is not possible: the engines disagree."""


class Replay:
    """Performs steps of a closed system in the interpreter, one after another.

    Its data are those of real machines: dead data are not reset.
    """

    def __init__(self, closed: ClosedSystem) -> None:
        """Start before the first step."""
        self._closed = closed
        self._local = LocalSteps(replace(closed, mortal=()))
        self._machines = closed.system.machines
        self._snapshots: list[snap.Snapshot] = [
            self._local.settled(m, self._local.initial(m)) for m in range(len(closed.charts))
        ]
        self._ticks = Fraction(0)
        self._tick = closed.charts[0].capacities.tick
        self._pending: list[Message] = []
        self._inputs: dict[int, Value] = {}
        """The values of chosen inputs in the last step."""
        self.loses = False
        """Some event was lost so far."""

    def write(self, trail: Trail) -> list[TraceStep]:
        """Perform a path from the start."""
        return list(self.walk(trail))

    def walk(self, trail: Trail) -> Iterator[TraceStep]:
        """Perform a path from the start; after each step the machines are in its final state.

        The events sent during the start of the machines reach the queues with the last start.
        """
        if trail:
            yield from self._start(trail[0])
        for (step,) in trail[1:]:
            elapses = step.action is Action.ELAPSE
            yield self._elapse(step) if elapses else self._perform(step)

    @property
    def snapshots(self) -> tuple[snap.Snapshot, ...]:
        """The current machines."""
        return tuple(self._snapshots)

    @property
    def ticks(self) -> Fraction:
        """The time since the start."""
        return self._ticks

    def _start(self, steps: tuple[Step, ...]) -> Iterator[TraceStep]:
        for link in self._closed.system.input_links:
            writer, data = self._machines[link.source], self._snapshots[link.source].data
            value = written_value(writer, self._closed.charts[link.source], data, link.output)
            self._deliver(Message(link.target, input=link.input, value=value))
        for number, step in enumerate(steps, 1):
            found = self._perform(step)
            for message in self._pending if number == len(steps) else ():
                self._deliver(message)
            yield found

    def _elapse(self, step: Step) -> TraceStep:
        local, holds = self._local, self._closed.holds(self._snapshots)
        self._snapshots = [
            s if holds[m] is Hold.STOPPED else local.settled(m, local.elapsed(m, s, step.ticks))
            for m, s in enumerate(self._snapshots)
        ]
        self._ticks += step.ticks or self._closed.unit
        return TraceStep(self._at, "", Action.ELAPSE, "time passes", (), (), (), step=step)

    @property
    def _at(self) -> int | None:
        return None if self._closed.untimed else int(self._ticks * self._tick)

    def _deliver(self, message: Message) -> None:
        after, is_lost = self._local.delivered(self._snapshots[message.target], message)
        self.loses = self.loses or is_lost
        self._snapshots[message.target] = self._local.settled(message.target, after)

    def _perform(self, step: Step) -> TraceStep:
        machine = step.machine
        chart = self._closed.charts[machine]
        before = self._snapshots[machine]
        chooser = Chooser(self._closed.results[machine], step.choices)
        done = self._local.perform(machine, before, step, chooser)
        if done is None:
            name = self._machines[machine].name
            raise ReplayError(f"the interpreter has no step `{step.action.value}` of `{name}` here")
        holds = self._closed.holds(self._snapshots)
        who = Mover.INTERNAL if step.action is not Action.OCCUR else Mover.ENVIRONMENT
        outcome = self._local.outcome(machine, before, step, who, done)
        self._snapshots[machine] = outcome.after
        for message in outcome.messages:
            if step.action is Action.START and message.event is not None:
                self._pending.append(message)
            elif holds[message.target] is not Hold.STOPPED:
                self._deliver(message)
        return TraceStep(
            self._at,
            self._machines[machine].name,
            step.action,
            cause(chart, step, done, self._closed),
            leaves(chart, before),
            leaves(chart, outcome.after),
            tuple(trace_lines(chart, [done])),
            self._chosen(chart, done),
            tuple(self._delivery(message) for message in outcome.messages),
            step,
            done,
            outcome.messages,
            outcome.after,
        )

    def _chosen(self, chart: Chart, done: snap.Macrostep) -> tuple[str, ...]:
        tick = chart.capacities.tick
        found = []
        for free in self._closed.free_inputs:
            declared, value = chart.inputs[free.input], done.before.inputs[free.input]
            if self._inputs.get(free.input) != value:
                found.append(f"{declared.name} = {show(value, declared.type, tick)}")
            self._inputs[free.input] = value
        types = {o.name: o.result for one in charts_within(chart) for o in one.operations}
        for _, _, effect in effects_within(chart, done):
            match effect:
                case snap.Called(operation, _, result) if result is not None:
                    type_ = types[operation]
                    shown = str(result) if type_ is None else show(result, type_, tick)
                    found.append(f"{operation}() = {shown}")
                case _:
                    pass
        return tuple(found)

    def _delivery(self, message: Message) -> Delivery:
        target = self._machines[message.target]
        chart = target.chart
        if message.event is not None:
            return Delivery(target.name, occurrence_text(chart, message.event), is_event=True)
        if message.input < len(chart.inputs):
            declared = chart.inputs[message.input]
            name, type_ = declared.name, declared.type
        else:
            slot = target.shared[message.input - len(chart.inputs)]
            name, type_ = str(slot), type_of_slot(chart, slot)
        shown = show(message.value, type_, chart.capacities.tick)
        return Delivery(target.name, f"{name} = {shown}", is_event=False)


def explorer_lines(chart: Chart, done: snap.Macrostep) -> Iterator[str]:
    """Yield the explorer's output for a macrostep: states and transitions by number."""
    for path, own, effect in effects_within(chart, done):
        match effect:
            case snap.Exited(state):
                yield f"{path}- {state}"
            case snap.Taken(transition):
                yield f"{path}t {transition}"
            case snap.Entered(state):
                yield f"{path}+ {state}"
            case snap.Called(operation, arguments, result):
                answer = () if result is None else ("=", plain(result))
                yield path + " ".join(("op", operation, *map(plain, arguments), *answer))
            case snap.Emitted(snap.Occurrence(event, payload)) if effect.is_leaving:
                yield path + " ".join(("out", own.events[event].name, *map(plain, payload)))
            case snap.Overflowed(queue):
                yield f"{path}full {queue}"
            case snap.Faulted(reason):
                yield f"{path}fault {reason}"
            case _:
                pass


def explorer_state(chart: Chart, snapshot: snap.Snapshot) -> Iterator[str]:
    """Yield the explorer's output for a machine after a step."""
    for variable, value in zip((*chart.data, *chart.outputs), snapshot.data, strict=True):
        yield f"d {variable.name} {plain(value)}"
    active = sorted(index_of(chart).leaves & snapshot.configuration)
    yield " ".join(("=", *map(str, active), *(("finished",) if snapshot.finished else ())))
    for invocation, child in zip(chart.invocations, snapshot.invoked, strict=True):
        if child is not None:
            for line in explorer_state(invocation.chart, child):
                yield f"{invocation.id}: {line}"


@telling
def explorer_step(chart: Chart, told: TraceStep) -> tuple[str, ...]:
    """Return the output of generated C for a step of a machine."""
    if told.done is None or told.state is None:
        return ()
    return (*explorer_lines(chart, told.done), *explorer_state(chart, told.state))


def explorer_output(
    closed: ClosedSystem,
    steps: Iterable[TraceStep],
    shown: Callable[[int, snap.Snapshot], Iterable[str]],
) -> Iterator[tuple[str, ...]]:
    """Yield the explorer's output for each step, which has only data that count as state.

    ``shown``: its output for a machine, by number.
    """
    local = LocalSteps(closed)
    for told in steps:
        if told.step is None or told.done is None:
            yield ()
            continue
        chart = closed.charts[told.step.machine]
        after = local.settled(told.step.machine, told.done.after)
        yield (*explorer_lines(chart, told.done), *shown(told.step.machine, after))


def plain(value: Value) -> str:
    """Return a value in the explorer's format."""
    if isinstance(value, tuple):
        return " ".join(("[", *texts_of(value, plain), "]"))
    return value_text(value)


def cause(chart: Chart, step: Step, done: snap.Macrostep, closed: ClosedSystem) -> str:
    """Return the cause of a step, in words."""
    if step.action is not Action.START and step.machine in closed.freezers.values():
        return cause_of(chart, done.microsteps[0].transitions[0])
    match done.event:
        case snap.Timeout(transition):
            source = chart.states[chart.transitions[transition].source].id
            return f"timeout in {source}"
        case snap.Occurrence() as occurrence:
            if step.action is Action.OCCUR and closed.possible[step.argument].spontaneous:
                number = int(chart.events[occurrence.event].name.rpartition(".")[2])
                return f"spontaneously leaves {chart.states[chart.transitions[number].source].id}"
            return occurrence_text(chart, occurrence)
        case None:
            return "inputs changed"
        case snap.InvokedRun():
            return "an invoked machine goes on"
        case _:
            return "start" if step.action is Action.START else "delayed event"


@telling
def occurrence_text(chart: Chart, occurrence: snap.Occurrence) -> str:
    """Return an event with its payload as text."""
    event = chart.events[occurrence.event]
    return f"{event.name}{_values(event.fields, occurrence.payload, chart.capacities.tick)}"


def _values(fields: tuple[Field, ...], values: tuple[Value, ...], tick: int) -> str:
    if not fields:
        return ""
    parts = zip(fields, values, strict=True)
    return "(" + ", ".join(f"{f.name} = {show(v, f.type, tick)}" for f, v in parts) + ")"


def leaves(chart: Chart, snapshot: snap.Snapshot) -> tuple[str, ...]:
    """Return the names of the active leaves, in document order."""
    active = sorted(index_of(chart).leaves & snapshot.configuration)
    return tuple(chart.states[state].id for state in active)


def write(closed: ClosedSystem, trail: Trail, cycle: Trail = ()) -> Counterexample:
    """Return a path, performed in the interpreter; ``cycle`` are the steps that then repeat."""
    replay = Replay(closed)
    whole = (*trail, *cycle)
    steps = replay.write(whole)
    loop = len(steps) - len(cycle) if cycle else None
    return Counterexample(tuple(steps), whole, loop, loses=replay.loses)


def as_json(found: Counterexample) -> list[Mapping[str, object]]:
    """Return the steps in the form of the command line's JSON."""
    return [
        {
            "at": step.at,
            "machine": step.machine,
            "action": step.action.value,
            "event": step.cause,
            "from": list(step.before),
            "to": list(step.after),
            "chosen": list(step.chosen),
            "sent": [f"{d.what} -> {d.target}" for d in step.deliveries],
            "lines": list(step.lines),
        }
        for step in found.steps
    ]
