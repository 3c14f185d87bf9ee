"""Convert a path to the host's commands for each machine, from which tests are written.

Machines do not communicate in a test: the messages to each are inserted, and all of its effects are
compared. So each machine can be tested without the others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import floor

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import fail
from fsmkit.language import Value
from fsmkit.runtime.interpreter.macrostep import initial
from fsmkit.runtime.interpreter.run import has_room, is_deferred
from fsmkit.runtime.interpreter.snapshot import Delayed, Occurrence, Snapshot, Timeout
from fsmkit.verify.report.counterexample import TraceStep
from fsmkit.verify.statespace.actions import Action
from fsmkit.verify.statespace.closed_system import ClosedSystem

Waiting = Timeout | Occurrence
"""A timer: of a transition, or of an event that a machine sends with a delay."""


@dataclass(frozen=True, slots=True)
class Command:
    """One step of one machine, and the changes before it.

    ``number``: of the step, from 1. ``now``: its time in whole ticks. ``inputs``: those that
    changed, by index; the shared variables follow the inputs. ``posts``: the events queued since
    its last step. ``occurs``: the external event, ahead of the queue; ``may_defer``: it may be
    deferred there. ``timer``: the one that fires; ``due``: its deadline is known, and lies ``late``
    ticks before now; it is unknown without time, or if it is not a whole number of ticks.
    ``choices``: of results of operations, in order.
    """

    number: int
    machine: int
    action: Action
    now: int
    inputs: tuple[tuple[int, Value], ...]
    posts: tuple[Occurrence, ...]
    occurs: Occurrence | None
    may_defer: bool
    timer: Waiting | None
    due: bool
    late: int
    choices: tuple[int, ...]
    trace_step: TraceStep


def commands(closed: ClosedSystem, steps: Sequence[TraceStep]) -> Iterator[Command]:
    """Yield the commands of a path."""
    machines = closed.system.machines
    numbers = {machine.name: n for n, machine in enumerate(machines)}
    inputs: list[tuple[Value, ...]] = [initial(chart).inputs for chart in closed.charts]
    written: dict[tuple[int, int], Value] = {}
    posts: list[list[Occurrence]] = [[] for _ in machines]
    elapsed = Fraction(0)
    whole = not closed.untimed and all(
        trace_step.step is None or trace_step.step.ticks.denominator == 1 for trace_step in steps
    )
    for number, trace_step in enumerate(steps, 1):
        step, done = trace_step.step, trace_step.done
        if step is None or done is None:
            elapsed += (step.ticks if step is not None else 0) or closed.unit
            continue
        machine = numbers[trace_step.machine]
        before = done.before
        changed = [
            (n, now)
            for n, (was, now) in enumerate(zip(inputs[machine], before.inputs, strict=True))
            if was != now
        ]
        shared = [(n, value) for (m, n), value in written.items() if m == machine]
        if shared and step.action is Action.START:
            raise fail(
                "not-expressible",
                f"`{trace_step.machine}` starts with shared data of others, which no test can set",
                machines[machine].span,
            )
        changed += shared
        written = {key: value for key, value in written.items() if key[0] != machine}
        inputs[machine] = done.after.inputs
        occurs = None
        if step.action is Action.OCCUR:
            possible = closed.possible[step.argument]
            occurs = Occurrence(possible.event, possible.payload)
        fires = step.action is Action.FIRE
        event = done.event.occurrence if isinstance(done.event, Delayed) else done.event
        waiting = event if fires and isinstance(event, Timeout | Occurrence) else None
        due = whole and fires and _is_exact(closed, machine, waiting)
        yield Command(
            number, machine, step.action, floor(elapsed), tuple(changed), tuple(posts[machine]),
            occurs, _may_defer(closed.charts[machine], before), waiting,
            due, -done.at if due else 0,
            step.choices[len(closed.free_inputs) :], trace_step,
        )  # fmt: skip
        posts[machine] = []
        for message in trace_step.messages:
            if message.event is not None:
                posts[message.target].append(message.event)
            elif message.input >= len(closed.charts[message.target].inputs):
                written[message.target, message.input] = message.value


def _may_defer(chart: Chart, before: Snapshot) -> bool:
    recalls = any(not is_deferred(chart, before, o.event) for o in before.deferred)
    return has_room(chart, before) and not recalls


def _is_exact(closed: ClosedSystem, machine: int, timer: Waiting | None) -> bool:
    transitions = closed.charts[machine].transitions
    return not isinstance(timer, Timeout) or transitions[timer.transition].least is None
