"""Drive the generated Python machines by the steps of a path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.codegen.python.family import family_of
from fsmkit.codegen.python.loading import load_machine
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Timeout
from fsmkit.verify.report.counterexample import TraceStep
from fsmkit.verify.statespace.actions import Action
from fsmkit.verify.statespace.closed_system import ClosedSystem, with_greatest_delays
from fsmkit.verify.testgen.script import Command, Waiting, commands


def in_python(closed: ClosedSystem, steps: Sequence[TraceStep]) -> list[list[str]]:
    """Return the lines of the trace of each step; none for steps in which time passes."""
    machines = [_Machine(closed, number) for number in range(len(closed.charts))]
    found: list[list[str]] = [[] for _ in steps]
    for command in commands(closed, steps):
        found[command.number - 1] = machines[command.machine].perform(command)
    return found


class _Host:
    """Returns the chosen results of operations; sent events are only traced."""

    def __init__(self, closed: ClosedSystem, machine: int) -> None:
        self.choices: list[int] = []
        names = family_of(closed.charts[machine]).names
        for operation in closed.charts[machine].operations:
            values = closed.results[machine].get(operation.name, ())
            method: Callable[..., Any] = partial(self._answer, values)
            setattr(self, names.operations[operation.name], method)
        for event in names.events:
            setattr(self, f"send_{event}", lambda *_: None)

    def _answer(self, values: tuple[Value, ...], *_: object) -> Value | None:
        if not values:
            return None
        return values[self.choices.pop(0) if len(values) > 1 else 0]


class _Machine:
    def __init__(self, closed: ClosedSystem, number: int) -> None:
        self._chart: Chart = with_greatest_delays(closed.charts[number])
        self._instance = closed.system.machines[number]
        self._names = family_of(self._chart).names
        self._host = _Host(closed, number)
        self._lines: list[str] = []
        self._machine: Any = load_machine(self._chart, traced=True)(self._host)
        self._machine.trace = self._lines.append
        self._width: int = getattr(self._machine, "WIDTH", 0)
        """The types of payloads; a machine without payloads has no such constant."""

    def perform(self, command: Command) -> list[str]:
        """Take one step; return its trace, without the line with the time."""
        machine = self._machine
        self._lines.clear()
        self._host.choices = list(command.choices)
        for place, value in command.inputs:
            self._write(place, value)
        for event in command.posts:
            machine.post(self._chart.events[event.event].name, *event.payload)
        self._lines.clear()
        machine._now = command.now  # noqa: SLF001  (single steps are for tests only)
        match command.action:
            case Action.START:
                machine.start(command.now)
            case Action.TAKE:
                machine._take_queued()  # noqa: SLF001
            case Action.EVENTLESS:
                machine._try_eventless()  # noqa: SLF001
            case Action.OCCUR:
                self._occur(command)
            case Action.FIRE:
                self._fire(command)
            case _:
                pass
        return [line for line in self._lines if not line.startswith("@")]

    def _write(self, place: int, value: Value) -> None:
        if place < len(self._chart.inputs):
            name = self._names.variables[self._chart.inputs[place].name]
            setattr(self._machine, name, value)
            return
        slot = self._instance.shared[place - len(self._chart.inputs)]
        name = self._names.variables[slot.name]
        if slot.element is None:
            setattr(self._machine, name, value)
        else:
            getattr(self._machine, name)[slot.element] = value

    def _occur(self, command: Command) -> None:
        """Deliver an event ahead of the queue."""
        machine, event = self._machine, command.occurs
        assert event is not None  # noqa: S101  (an event comes)
        if not command.may_defer:
            machine.dispatch(self._chart.events[event.event].name, *event.payload)
            return
        head = (machine._queue_head - 1) % machine.QUEUE  # noqa: SLF001
        machine._queue_head = head  # noqa: SLF001
        machine._queue_count += 1  # noqa: SLF001
        machine._queue_event[head] = event.event  # noqa: SLF001
        at = head * self._width
        if event.payload:
            machine._queue_fields[at : at + len(event.payload)] = event.payload  # noqa: SLF001
        machine._take_queued()  # noqa: SLF001

    def _fire(self, command: Command) -> None:
        """Fire a timer before all others: late, if it has expired, else before its deadline."""
        machine = self._machine
        place = self._place(command.timer)
        due = machine._timer_due[place]  # noqa: SLF001
        deadline = command.now - command.late
        if command.due and due != deadline:
            self._lines.append(f"due at {due}, not {deadline}")
        for name, width in (
            ("_timer_due", 1), ("_timer_what", 1), ("_timer_mark", 1),
            ("_timer_route", 1), ("_timer_peer", 1), ("_timer_fields", self._width),
        ):  # fmt: skip
            found = getattr(machine, name, [])
            chosen = found[place * width : (place + 1) * width]
            found[: (place + 1) * width] = [*chosen, *found[: place * width]]
        machine._timer_due[0] = deadline  # noqa: SLF001
        machine._fire()  # noqa: SLF001

    def _place(self, timer: Waiting | None) -> int:
        """Return the index of a timer among the armed ones."""
        machine = self._machine
        count, width = machine._timer_count, self._width  # noqa: SLF001
        armed = machine._timer_what[:count]  # noqa: SLF001
        if isinstance(timer, Timeout):
            return int(armed.index(timer.transition))
        assert timer is not None  # noqa: S101  (one fires)
        fields = getattr(machine, "_timer_fields", [])
        return next(
            place
            for place, what in enumerate(armed)
            if what == ~timer.event
            and tuple(fields[place * width :][: len(timer.payload)]) == timer.payload
        )
