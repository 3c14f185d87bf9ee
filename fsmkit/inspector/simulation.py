"""Simulate a system one macrostep at a time, as a pure function that permits undo and forks.

The schedule is that of `runtime.system_session`, interruptible between any two macrosteps. A
single chart is a system of one machine.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

from fsmkit.chart.chart import Chart
from fsmkit.language import Value
from fsmkit.runtime.driving import driven
from fsmkit.runtime.interpreter.macrostep import initial, start
from fsmkit.runtime.interpreter.run import (
    at_time,
    is_deferred,
    livelock_error,
    max_steps_at_one_time,
    next_deadline,
    post,
    step_event,
    step_eventless,
    step_timer,
)
from fsmkit.runtime.interpreter.snapshot import Called, Emitted, Macrostep, Occurrence, Snapshot
from fsmkit.runtime.script import SeededHost
from fsmkit.system.machine import EventLink, operation_port
from fsmkit.system.schedule import time_unit
from fsmkit.system.shared import has_data_trigger, kept_at_start, written_value
from fsmkit.system.system import System

FOR_EVER = 2**62
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Turn:
    """A machine that runs until it is quiet, and its steps, which are delivered at the end."""

    machine: int
    before: Snapshot
    allowance: int
    """Events that it still takes at this time."""
    done: tuple[Macrostep, ...]
    is_single: bool = False
    """Whether the turn has a single step, because shared data enabled an eventless transition."""


@dataclass(frozen=True, slots=True)
class Moment:
    """All machines, in the order of the system, between two macrosteps.

    ``answers``: the states of the pseudo-random hosts. ``given``: the next results of each
    machine's operations, as `SeededHost.given`. ``at_once``: steps since the time advanced.
    """

    now: int
    snapshots: tuple[Snapshot, ...]
    answers: tuple[int, ...]
    given: tuple[Mapping[str, tuple[Value, ...]], ...]
    to_start: tuple[int, ...] = ()
    started: tuple[tuple[int, Macrostep], ...] = ()
    turn: Turn | None = None
    at_once: int = 0


@dataclass(frozen=True, slots=True)
class Delivery:
    """An event that went, or did not fit, from a machine to another."""

    link: EventLink
    occurrence: Occurrence
    has_room: bool


@dataclass(frozen=True, slots=True)
class InputChange:
    """An input that a machine changed by an output; or shared data, after the inputs."""

    machine: int
    number: int
    value: Value


@dataclass(frozen=True, slots=True)
class SimulationStep:
    """The result of a step: a macrostep of a machine, and the changes it caused in others."""

    machine: int
    macrostep: Macrostep
    passed: tuple[Delivery, ...]
    driven: tuple[InputChange, ...]


class Simulation:
    """The steps of a system; it holds nothing that changes but the hosts, set before each use."""

    def __init__(self, system: System, seed: int = 1) -> None:
        """`FsmkitError` if the machines do not count time alike."""
        time_unit(system)
        self.system = system
        self.charts: tuple[Chart, ...] = tuple(machine.chart for machine in system.machines)
        self.names = tuple(machine.name for machine in system.machines)
        self.tick: int = self.charts[0].capacities.tick
        """Microseconds in a tick."""
        self.seed = seed
        self._hosts = [SeededHost(chart, seed) for chart in self.charts]
        self._order = sorted(range(len(self.charts)), key=lambda m: not self._is_environment(m))
        self._most = sum(map(max_steps_at_one_time, self.charts))

    def _is_environment(self, machine: int) -> bool:
        return self.system.machines[machine].environment

    # --- actions of clients --------------------------------------------------------------------

    def begin(self) -> Moment:
        """Return the system before its start."""
        moment = Moment(
            0,
            tuple(map(initial, self.charts)),
            (self.seed,) * len(self.charts),
            ({},) * len(self.charts),
            to_start=tuple(self._order),
        )
        for machine in self._order:
            moment, _ = self.drive(moment, machine, None)
        return moment

    def post(self, moment: Moment, machine: int, occurrence: Occurrence) -> Moment | None:
        """Put an event in the queue of a machine; None if it has no room or does not run."""
        after = post(self.charts[machine], moment.snapshots[machine], occurrence)
        return None if after is None else _with(moment, machine, after)

    def set_input(self, moment: Moment, machine: int, place: int, value: Value) -> Moment:
        """Give an input another value."""
        target = self.system.machines[machine]
        return _with(moment, machine, driven(target, moment.snapshots[machine], place, value))

    def set_results(
        self, moment: Moment, machine: int, operation: str, results: tuple[Value, ...]
    ) -> Moment:
        """Give the results of an operation from here on, one a call; the last one stays."""
        given = {**moment.given[machine], operation: results}
        return replace(moment, given=_with_element(moment.given, machine, given))

    def set_data(self, moment: Moment, machine: int, place: int, value: Value) -> Moment:
        """Give a datum another value, and with it whoever shares it."""
        before = moment.snapshots[machine]
        data = list(before.data)
        data[place] = value
        moment = _with(moment, machine, replace(before, data=tuple(data)))
        return self.drive(moment, machine, before)[0]

    def step(self, moment: Moment, until: int = FOR_EVER) -> tuple[Moment, SimulationStep | None]:
        """Take the next macrostep up to a time in ticks.

        Without one until then, the step is absent, and the time is `until`, or that of the last
        step if no timer is armed. Raises `FsmkitError` (``livelock``) if time does not advance.
        """
        if moment.to_start:
            return self._start(moment)
        while True:
            if moment.turn is not None:
                return self._go_on(moment, moment.turn)
            for machine in self._order:
                moment = _at_time(moment, machine)
                found = self._begin_turn(moment, machine)
                if found is not None:
                    return self._close(*found)
            deadline = self.next_deadline(moment)
            if deadline is None or deadline > until:
                return replace(moment, now=moment.now if until == FOR_EVER else until), None
            moment = replace(moment, now=deadline, at_once=0)

    def next_deadline(self, moment: Moment) -> int | None:
        """Return the first deadline of any machine."""
        deadlines = [next_deadline(each) for each in moment.snapshots if each.running]
        return min((due for due in deadlines if due is not None), default=None)

    # --- turns ---------------------------------------------------------------------------------

    def _start(self, moment: Moment) -> tuple[Moment, SimulationStep]:
        machine, *rest = moment.to_start
        chart, before = self.charts[machine], moment.snapshots[machine]
        kept = kept_at_start(self.system.machines[machine], before.data)
        host = self._host(moment, machine)
        first = start(chart, moment.now, host, before.inputs, given=kept)
        moment = self._after(moment, machine, first)
        started = (*moment.started, (machine, first))
        moment, changed = self.drive(moment, machine, before)
        moment = replace(moment, to_start=tuple(rest), started=() if not rest else started)
        passed: tuple[Delivery, ...] = ()
        if not rest:
            for each, macrostep in started:
                moment, more = self.deliver(moment, each, (macrostep,))
                passed += more
        return moment, SimulationStep(machine, first, passed, changed)

    def _begin_turn(self, moment: Moment, machine: int) -> tuple[Moment, Turn] | None:
        """Return the turn of a machine, with its first macrostep; None if it has nothing to do."""
        chart, before = self.charts[machine], moment.snapshots[machine]
        if not before.running:
            return None
        own = self.system.machines[machine]
        if has_data_trigger(own, chart):
            host = self._host(moment, machine)
            tried = step_eventless(chart, before, host)
            if tried is not None:
                allowance = self._allowance(machine, tried.after)
                turn = Turn(machine, before, allowance, (tried,), is_single=bool(own.shared))
                return self._after(moment, machine, tried), turn
        turn = Turn(machine, before, self._allowance(machine, before), ())
        return self._next_macrostep(moment, turn)

    def _allowance(self, machine: int, snapshot: Snapshot) -> int:
        waiting = len(snapshot.queue) + len(snapshot.deferred)
        return waiting + self.charts[machine].capacities.microsteps

    def _next_macrostep(self, moment: Moment, turn: Turn) -> tuple[Moment, Turn] | None:
        """Process the next event or timer of the present turn; None if there is none.

        It follows `runtime.interpreter.run.run`.
        """
        machine, chart = turn.machine, self.charts[turn.machine]
        snapshot, host = moment.snapshots[machine], self._host(moment, machine)
        if not snapshot.running or turn.is_single:
            return None
        allowance = turn.allowance - 1
        done = step_event(chart, snapshot, host) if turn.allowance > 0 else None
        if done is None:
            due = next_deadline(snapshot)
            if due is None or due > moment.now:
                return None
            done = step_timer(chart, snapshot, host)
            allowance = chart.capacities.microsteps
            if done is None:
                return None
        turn = replace(turn, allowance=allowance, done=(*turn.done, done))
        return self._after(moment, machine, done), turn

    def _go_on(self, moment: Moment, turn: Turn) -> tuple[Moment, SimulationStep]:
        found = self._next_macrostep(replace(moment, turn=None), turn)
        if found is None:
            raise AssertionError("a stored turn must have another step")
        return self._close(*found)

    def _close(self, moment: Moment, turn: Turn) -> tuple[Moment, SimulationStep]:
        """Count the step; deliver the events of the turn if the machine is quiet."""
        machine, chart = turn.machine, self.charts[turn.machine]
        last = turn.done[-1]
        moment = replace(moment, at_once=moment.at_once + 1)
        if moment.at_once > self._most:
            raise livelock_error(chart, turn.done)
        if self._has_more(moment, turn):
            return replace(moment, turn=turn), SimulationStep(machine, last, (), ())
        moment = _at_time(moment, machine)
        moment, passed = self.deliver(moment, machine, turn.done)
        moment, changed = self.drive(moment, machine, turn.before)
        return moment, SimulationStep(machine, last, passed, changed)

    def _has_more(self, moment: Moment, turn: Turn) -> bool:
        """Whether the machine has an event or a timer left that it takes in this turn."""
        chart, snapshot = self.charts[turn.machine], moment.snapshots[turn.machine]
        if not snapshot.running or turn.is_single:
            return False
        due = next_deadline(snapshot)
        if due is not None and due <= moment.now:
            return True
        if turn.allowance <= 0:
            return False
        recalled = (not is_deferred(chart, snapshot, each.event) for each in snapshot.deferred)
        if snapshot.queue or any(recalled):
            return True
        return any(snapshot.invoked) and self._next_macrostep(moment, turn) is not None

    # --- between machines ----------------------------------------------------------------------

    def _host(self, moment: Moment, machine: int) -> SeededHost:
        host = self._hosts[machine]
        host.state, host.given = moment.answers[machine], moment.given[machine]
        return host

    def _after(self, moment: Moment, machine: int, done: Macrostep) -> Moment:
        """Return the system after a macrostep; the host has answered meanwhile."""
        host = self._hosts[machine]
        answers = _with_element(moment.answers, machine, host.state)
        given = _with_element(moment.given, machine, host.given)
        return _with(replace(moment, answers=answers, given=given), machine, done.after)

    def deliver(
        self, moment: Moment, source: int, done: tuple[Macrostep, ...]
    ) -> tuple[Moment, tuple[Delivery, ...]]:
        """Deliver the sent events and called operations."""
        chart, passed = self.charts[source], []
        for effect in (effect for macrostep in done for effect in macrostep.effects):
            match effect:
                case Emitted(Occurrence(event, payload)):
                    port, values = event, payload
                case Called(operation, arguments):
                    port, values = operation_port(chart, operation), arguments
                case _:
                    continue
            for link in self.system.event_links:
                if (link.source, link.port) == (source, port):
                    sent = Occurrence(link.event, tuple(values[n] for n in link.arguments))
                    after = self.post(moment, link.target, sent)
                    passed.append(Delivery(link, sent, after is not None))
                    moment = moment if after is None else after
        return moment, tuple(passed)

    def drive(
        self, moment: Moment, source: int, before: Snapshot | None
    ) -> tuple[Moment, tuple[InputChange, ...]]:
        """Copy changed outputs and shared variables of a machine to the machines that read them."""
        machine, chart = self.system.machines[source], self.charts[source]
        changed = []
        for link in self.system.input_links:
            if link.source != source:
                continue
            value = written_value(machine, chart, moment.snapshots[source].data, link.output)
            if before is None or value != written_value(machine, chart, before.data, link.output):
                moment = self.set_input(moment, link.target, link.input, value)
                changed.append(InputChange(link.target, link.input, value))
        return moment, tuple(changed)


def _with(moment: Moment, machine: int, snapshot: Snapshot) -> Moment:
    """Return the system with another state of one machine."""
    return replace(moment, snapshots=_with_element(moment.snapshots, machine, snapshot))


def _with_element(of_each: tuple[T, ...], machine: int, one: T) -> tuple[T, ...]:
    """Return a copy of a tuple with another element for one machine."""
    return (*of_each[:machine], one, *of_each[machine + 1 :])


def _at_time(moment: Moment, machine: int) -> Moment:
    """Return the system in which a machine has seen the time."""
    here = at_time(moment.snapshots[machine], moment.now)
    return moment if here is moment.snapshots[machine] else _with(moment, machine, here)
