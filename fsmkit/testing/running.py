"""Runs a case on the interpreter, which evaluates it, and on another runtime by the same trace."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import Protocol

from fsmkit.chart.chart import Chart, Operation, every_operation
from fsmkit.diagnostics import FsmkitError, Span, Text
from fsmkit.language import ContentError, RangeFault, Type, Value
from fsmkit.language.values import show
from fsmkit.runtime.interpreter.snapshot import (
    Called,
    Emitted,
    InvokedMacrostep,
    Macrostep,
    Snapshot,
)
from fsmkit.runtime.interpreter.trace import active_leaves, dump_lines, trace_lines, value_text
from fsmkit.runtime.system_session import Happening, SystemSession
from fsmkit.system.system import System
from fsmkit.testing.coverage.record import Recorder
from fsmkit.testing.suite import (
    Case,
    Expect,
    InState,
    Pattern,
    Post,
    Returns,
    SetInput,
    Start,
    Suite,
    Wait,
)
from fsmkit.verify.questions import Expression


@dataclass(frozen=True, slots=True)
class Failure:
    """An expectation that was not met, or a step that could not be done."""

    at: Span
    message: str


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of a case; it passed if there are no failures."""

    case: Case
    failures: tuple[Failure, ...]
    happened: tuple[Happening, ...]


class Runtime(Protocol):
    """Another runtime than the interpreter, which does the steps of a chart, too."""

    name: str

    def do(self, line: str, answers: Mapping[str, Sequence[Value]]) -> list[str]:
        """Do a line of a script and return the lines of its trace.

        ``answers``: for each operation the results of the calls that the line leads to, in order.
        """
        ...


@dataclass(frozen=True, slots=True)
class Action:
    """A call of an operation, or an event that left a machine."""

    machine: int
    name: str
    values: tuple[Value, ...]
    types: tuple[Type, ...]


def run_case(
    suite: Suite,
    case: Case,
    *,
    recorder: Recorder | None = None,
    runtime: Callable[[Chart], Runtime] | None = None,
) -> Outcome:
    """Run a case until it ends or an expectation fails.

    Args:
        suite: The file of the case.
        case: The steps and expectations.
        recorder: Counts the coverage.
        runtime: Creates another runtime, whose trace must equal that of the interpreter.

    """
    performer = _Performer(suite.system, recorder, runtime)
    for step in case.steps:
        failures = tuple(performer.perform(step))
        if failures:
            return Outcome(case, failures, tuple(performer.happened))
    return Outcome(case, (), tuple(performer.happened))


@dataclass(slots=True)
class _Answers:
    """Results of operations: the first matching pattern, the latest first, else the default."""

    machine: int
    scripted: list[tuple[Pattern, list[Value]]] = field(default_factory=list)
    given: dict[str, list[Value]] = field(default_factory=dict)
    """Results since the last reset, by operation."""

    def function(self, operation: Operation) -> Callable[[tuple[Value, ...]], Value | None]:
        """Return the operation as a function that answers by the script and records its results."""

        def answer(arguments: tuple[Value, ...]) -> Value | None:
            value = self._value(operation, arguments)
            if value is not None:
                self.given.setdefault(operation.name, []).append(value)
            return value

        return answer

    def _value(self, operation: Operation, arguments: tuple[Value, ...]) -> Value | None:
        for pattern, values in reversed(self.scripted):
            if pattern.fits(self.machine, operation.name, arguments):
                return values.pop(0) if len(values) > 1 else values[0]
        return operation.default


class _Performer:
    """The machines of a case."""

    def __init__(
        self,
        system: System,
        recorder: Recorder | None,
        runtime: Callable[[Chart], Runtime] | None,
    ) -> None:
        self._system = system
        self._charts = [machine.chart for machine in system.machines]
        self._answers = [_Answers(number) for number in range(len(self._charts))]
        functions = {
            machine.name: {
                name: self._answers[number].function(operation)
                for name, operation in every_operation(machine.chart).items()
            }
            for number, machine in enumerate(system.machines)
        }
        watch = None if recorder is None else recorder.guard
        self._session = SystemSession(system, functions, watch=watch)
        if recorder is not None:
            self._session.observers.append(recorder.observer(*self._charts))
        self._other = None if runtime is None else runtime(self._charts[0])
        self._is_started = False
        self._seen = 0
        self.happened: list[Happening] = []

    def _snapshot(self, machine: int) -> Snapshot:
        return self._session.snapshot(self._name(machine))

    def _name(self, machine: int) -> str:
        return self._system.machines[machine].name

    def perform(self, step: object) -> Iterator[Failure]:
        """Do a step; yield why it failed."""
        try:
            yield from self._perform(step)
        except FsmkitError as error:
            at = getattr(step, "at", None)
            span = at.span if isinstance(at, Text) else at
            if not isinstance(span, Span):
                raise
            yield Failure(span, "; ".join(d.message for d in error.diagnostics))

    def _perform(self, step: object) -> Iterator[Failure]:
        match step:
            case Start(at):
                self._is_started = True
                yield from self._do(at, ["start 0", "run 0"], self._session.start)
            case Wait(at, ticks):
                until = self._session.now + ticks
                yield from self._do(at, [f"run {until}"], lambda: self._session.run(until))
            case Post(at, machine, event):
                if not self._session.enqueue(self._name(machine), event):
                    why = "has no room left" if self._snapshot(machine).running else "is no more"
                    where = "the queue" if self._snapshot(machine).running else "the machine"
                    yield Failure(at.span, f"the event is not accepted: {where} {why}")
                    return
                name = self._charts[machine].events[event.event].name
                line = " ".join(("post", name, *map(value_text, event.payload)))
                yield from self._go_on(at, line)
            case SetInput(at, machine, place, value):
                self._session.drive(self._name(machine), place, value)
                declared = self._charts[machine].inputs[place]
                yield from self._go_on(at, f"input {declared.name} {value_text(value)}")
            case Returns(_, call, values):
                self._answers[call.machine].scripted.append((call, list(values)))
            case Expect():
                yield from self._evaluate(step)
            case _:
                raise AssertionError(step)

    def _go_on(self, at: Text, line: str) -> Iterator[Failure]:
        """Run at the same time; before the start nothing runs."""
        now = self._session.now
        if not self._is_started:
            yield from self._do(at, [line], list)
            return
        yield from self._do(at, [line, f"run {now}"], lambda: self._session.run(now))

    def _do(
        self, at: Text, lines: Sequence[str], run: Callable[[], list[Happening]]
    ) -> Iterator[Failure]:
        self._answers[0].given.clear()
        done = run()
        self.happened += done
        if self._other is None:
            return
        chart = self._charts[0]
        wanted = list(trace_lines(chart, (each.macrostep for each in done)))
        wanted += dump_lines(chart, self._snapshot(0))
        found: list[str] = []
        for line in (*lines, "dump"):
            found += self._other.do(line, self._answers[0].given)
        for one, other in zip_longest(wanted, found, fillvalue="nothing"):
            if one != other:
                yield Failure(at.span, f"{self._other.name} does otherwise: `{other}`, not `{one}`")
                return

    # --- expectations ----------------------------------------------------------------------------

    def _evaluate(self, expect: Expect) -> Iterator[Failure]:
        new, self._seen = self.happened[self._seen :], len(self.happened)
        calls, sends = self._actions(new)
        for states, wanted in ((expect.states, True), (expect.left, False)):
            for state in states:
                yield from self._evaluate_state(state, wanted=wanted)
        for patterns, unwanted, actions, word in (
            (expect.called, expect.not_called, calls, "called"),
            (expect.sent, expect.not_sent, sends, "sent"),
        ):
            if patterns is not None:
                only = expect.at if expect.only else None
                yield from self._evaluate_actions(patterns, actions, word, only)
            for pattern in unwanted:
                for action in actions:
                    if pattern.fits(action.machine, action.name, action.values):
                        yield Failure(pattern.at.span, f"{word} all the same: {self._text(action)}")
                        break
        if expect.fault is not None:
            faults = [s.fault for s in map(self._snapshot, range(len(self._charts))) if s.fault]
            if (faults[:1] or [""]) != [expect.fault.value]:
                yield Failure(expect.fault.span, f"the fault is {(faults or ['none'])[0]}")
        snapshots = [self._snapshot(number) for number in range(len(self._charts))]
        for that in expect.that:
            yield from _evaluate_condition(that.at, that.condition, snapshots)

    def _evaluate_state(self, state: InState, *, wanted: bool) -> Iterator[Failure]:
        snapshot = self._snapshot(state.machine)
        if (state.state in snapshot.configuration) != wanted:
            active = " ".join(active_leaves(self._charts[state.machine], snapshot)) or "nothing"
            what = f"not in `{state.at}`" if wanted else f"in `{state.at}` all the same"
            yield Failure(state.at.span, f"{what}: active is {active}")

    def _evaluate_actions(
        self, patterns: Sequence[Pattern], actions: Sequence[Action], word: str, only: Span | None
    ) -> Iterator[Failure]:
        """Match patterns in order with the actions; ``only`` (a location): reject other actions."""
        rest = iter(actions)
        found = ", ".join(map(self._text, actions)) or "nothing"
        matched = 0
        for pattern in patterns:
            for action in rest:
                if pattern.fits(action.machine, action.name, action.values):
                    matched += 1
                    break
            else:
                yield Failure(pattern.at.span, f"not {word}: `{pattern.at}`; {word} was {found}")
                return
        if only is not None and matched != len(actions):
            yield Failure(only, f"{word} was more than that: {found}")

    def _actions(self, new: Sequence[Happening]) -> tuple[list[Action], list[Action]]:
        calls: list[Action] = []
        sends: list[Action] = []
        names = [machine.name for machine in self._system.machines]
        for each in new:
            number = names.index(each.machine)
            for chart, effect in effects_within(self._charts[number], each.macrostep):
                match effect:
                    case Called(operation, arguments):
                        declared = every_operation(self._charts[number])[operation]
                        types = tuple(p.type for p in declared.parameters)
                        calls.append(Action(number, operation, arguments, types))
                    case Emitted(occurrence) if effect.is_leaving:
                        event = chart.events[occurrence.event]
                        types = tuple(f.type for f in event.fields)
                        sends.append(Action(number, event.name, occurrence.payload, types))
        return calls, sends

    def _text(self, action: Action) -> str:
        tick = self._charts[action.machine].capacities.tick
        shown = ", ".join(
            show(v, t, tick) for v, t in zip(action.values, action.types, strict=True)
        )
        machine = "" if self._system.is_open else f"{self._name(action.machine)}."
        return f"{machine}{action.name}({shown})"


def _evaluate_condition(
    at: Text, condition: Expression, snapshots: Sequence[Snapshot]
) -> Iterator[Failure]:
    try:
        if not condition.value(snapshots):
            yield Failure(at.span, f"`{at}` does not hold")
    except (ContentError, RangeFault) as error:
        yield Failure(at.span, f"`{at}` has no value: {error.reason}")


def effects_within(chart: Chart, done: Macrostep) -> Iterator[tuple[Chart, Called | Emitted]]:
    """Yield the calls and events of a macrostep with their chart, including invoked machines."""
    for effect in done.effects:
        match effect:
            case Called() | Emitted():
                yield chart, effect
            case InvokedMacrostep(slot, within):
                yield from effects_within(chart.invocations[slot].chart, within)
            case _:
                pass
