"""The labelled transition system of a closed system.

State 0 is before the machines start; its steps are the possible starts. A label names a machine and
the cause of its step, ``feeder: arrived``, or is ``TICK`` for a unit of time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial

from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.export.exporter import ExportedModel, ExportOptions
from fsmkit.runtime.interpreter.run import is_deferred
from fsmkit.runtime.interpreter.snapshot import Occurrence, Snapshot, Timeout
from fsmkit.system.freezes import cause_of
from fsmkit.system.system import System
from fsmkit.verify.report.counterexample import occurrence_text
from fsmkit.verify.resources.deadline import Stage
from fsmkit.verify.statespace.actions import Action, Step, TooManyChoices
from fsmkit.verify.statespace.closed_system import ClosedSystem, close
from fsmkit.verify.statespace.global_steps import Edge, GlobalSteps, State
from fsmkit.verify.statespace.sessions import timer_of

TICK = "tick"
START = "start"


@dataclass(frozen=True, slots=True)
class Arrow:
    """A transition from one state to another, both by number."""

    source: int
    label: str
    target: int


@dataclass(frozen=True, slots=True)
class TransitionSystem:
    """States are numbered from 0, the initial one; ``configurations``: their active leaves."""

    name: str
    configurations: tuple[str, ...]
    arrows: tuple[Arrow, ...]

    @property
    def states(self) -> int:
        """The number of states."""
        return len(self.configurations)


def export_states(
    system: System, options: ExportOptions, write: Callable[[TransitionSystem], Iterable[str]]
) -> ExportedModel:
    """Explore a system, and write its transition system."""
    found = system_of(system, options)
    figures = {"states": found.states, "transitions": len(found.arrows)}
    return ExportedModel("".join(write(found)), figures)


def system_of(system: System, options: ExportOptions) -> TransitionSystem:
    """Explore a system by the interpreter, breadth first.

    Raises `FsmkitError` (``export-too-large``) beyond the limits: a part of a transition system
    would be taken for the whole. Time also ends within a step, which may last long.
    """
    return options.deadline.cut_off(Stage.EXPLORING, partial(_explored, system, options))


def _explored(system: System, options: ExportOptions) -> TransitionSystem:
    closed = close(system, untimed=options.untimed, silent=options.silent, observed=True)
    steps = GlobalSteps(closed)
    first = list(steps.initial())
    numbers = {edge.to: 0 for edge in first}
    shown: list[str] = [""]
    arrows: list[Arrow] = []
    try:
        for state, edges in breadth_first(steps, numbers, options):
            snapshots = steps.snapshots(state)
            shown.append(_configuration(closed, snapshots))
            for edge in edges:
                label = _label(closed, snapshots, edge)
                arrows.append(Arrow(numbers[state], label, numbers[edge.to]))
    except TooManyChoices as error:
        raise too_many_choices(closed) from error
    starts = [Arrow(0, START, numbers[edge.to]) for edge in first]
    return TransitionSystem(closed.system.name, tuple(shown), (*starts, *arrows))


def breadth_first(
    steps: GlobalSteps, numbers: dict[State, int], options: ExportOptions
) -> Iterator[tuple[State, list[Edge]]]:
    """Yield all reachable states, with their steps; number them from 1.

    ``numbers`` holds the initial ones. Raises `FsmkitError` (``export-too-large``).
    """
    numbers.update({state: number for number, state in enumerate(numbers, 1)})
    ahead, transitions = list(numbers), 0
    for expanded, state in enumerate(ahead):
        options.deadline.look()
        if len(ahead) > options.most:
            raise too_large(steps.closed, options.most)
        if expanded % 256 == 0 and options.progress is not None:
            options.progress(len(ahead), transitions)
        edges = list(steps.successors(state))
        transitions += len(edges)
        for edge in edges:
            if edge.to not in numbers:
                ahead.append(edge.to)
                numbers[edge.to] = len(ahead)
        yield state, edges


def within_limits(
    closed: ClosedSystem, options: ExportOptions, what: str = "states"
) -> Callable[[int, int], None]:
    """Return a function that reports states and transitions as progress.

    It raises `FsmkitError` (``export-too-large``) beyond ``options.most`` states.
    """
    report = options.progress or (lambda *_: None)

    def limited(states: int, transitions: int) -> None:
        report(states, transitions)
        if states > options.most:
            raise too_large(closed, options.most, what)

    return limited


def too_large(closed: ClosedSystem, most: int, what: str = "states") -> FsmkitError:
    """Return the error for a system of more than ``most`` states."""
    return fail(
        "export-too-large",
        f"`{closed.system.name}` has more than {most:,} {what}",
        help="raise `--max-states`, or export a smaller system",
    )


def too_many_choices(closed: ClosedSystem) -> FsmkitError:
    """Return the error for a step with too many combinations of choices."""
    return fail(
        "export-too-large",
        f"a step of `{closed.system.name}` has too many combinations of choices",
        help="declare narrower ranges for inputs, payloads and results",
    )


def _configuration(closed: ClosedSystem, snapshots: tuple[Snapshot, ...]) -> str:
    """Return the active leaves of each machine."""
    found = []
    for machine, chart, snapshot in zip(
        closed.system.machines, closed.charts, snapshots, strict=True
    ):
        leaves = (chart.states[s] for s in sorted(snapshot.configuration))
        active = "+".join(state.id for state in leaves if state.is_leaf)
        found.append(f"{machine.name}={active or 'stopped'}")
    return " ".join(found)


def _label(closed: ClosedSystem, snapshots: tuple[Snapshot, ...], edge: Edge) -> str:
    (step,) = edge.steps
    if step.action is Action.ELAPSE:
        return TICK
    machine = closed.system.machines[step.machine].name
    return f"{machine}: {cause(closed, snapshots[step.machine], step)}"


def occurrence_of(closed: ClosedSystem, snapshot: Snapshot, step: Step) -> Occurrence | None:
    """Return the event that a machine takes in a step, queued or external."""
    chart = closed.charts[step.machine]
    if step.action is Action.TAKE:
        waiting = (o for o in snapshot.deferred if not is_deferred(chart, snapshot, o.event))
        return next((o for heads in (waiting, snapshot.queue) for o in heads), None)
    if step.action is Action.OCCUR and not closed.possible[step.argument].spontaneous:
        possible = closed.possible[step.argument]
        return Occurrence(possible.event, possible.payload)
    return None


def cause(closed: ClosedSystem, snapshot: Snapshot, step: Step) -> str:
    """Return the cause of a step of a machine."""
    chart = closed.charts[step.machine]
    occurrence = occurrence_of(closed, snapshot, step)
    if occurrence is not None:
        return occurrence_text(chart, occurrence)
    freezes = step.machine in closed.freezers.values()
    match step.action:
        case Action.TAKE:
            return "an invoked machine goes on"
        case Action.FIRE:
            own, timer = timer_of(chart, snapshot, step.argument)
            if not isinstance(timer.what, Timeout):
                return "delayed event"
            if freezes:
                return cause_of(chart, timer.what.transition)
            source = own.transitions[timer.what.transition].source
            return f"timeout in {own.states[source].id}"
        case Action.OCCUR:
            event = chart.events[closed.possible[step.argument].event]
            number = int(event.name.rpartition(".")[2])
            if freezes:
                return cause_of(chart, number)
            return f"leaves {chart.states[chart.transitions[number].source].id}"
        case _:
            return "inputs changed"
