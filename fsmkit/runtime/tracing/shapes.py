"""Apply transitions to states when data are unknown, with a chart without content."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from fsmkit.chart.chart import Chart
from fsmkit.language import Value
from fsmkit.plan.image import FAULTS, Image
from fsmkit.runtime.interpreter import initial
from fsmkit.runtime.interpreter.entry_exit import enter_states
from fsmkit.runtime.interpreter.globals import Globals
from fsmkit.runtime.interpreter.macrostep import microstep
from fsmkit.runtime.interpreter.snapshot import Macrostep, Snapshot, Start
from fsmkit.runtime.interpreter.structure import default_transition
from fsmkit.runtime.snapshot_bytes import configuration_of
from fsmkit.runtime.tracing.records import FINISHED, RUNNING


class _NoHost:
    """The host of a chart without content, which is never called."""

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Never called."""
        raise AssertionError(operation, arguments)


@lru_cache(maxsize=64)
def shape_of(chart: Chart) -> Chart:
    """Return a chart with the same states and transitions, and nothing to execute or evaluate."""
    nothing = {"on_entry": (), "on_exit": (), "done_data": (), "invokes": (), "invariant": None}
    states = tuple(replace(state, **nothing) for state in chart.states)  # type: ignore[arg-type]
    transitions = tuple(replace(each, guard=None, content=()) for each in chart.transitions)
    return replace(chart, states=states, transitions=transitions, script=(), invocations=())


@lru_cache(maxsize=64)
def default_transitions(chart: Chart) -> frozenset[int]:
    """Return the transitions that are part of an entry: of initial states and histories."""
    return frozenset(state.initial for state in chart.states if state.initial is not None)


def started(chart: Chart, now: int) -> Macrostep:
    """Return the first macrostep as far as it is known: the initial states."""
    shape = shape_of(chart)
    before = replace(initial(shape), now=now)
    g = Globals(shape, before, _NoHost())
    g.running = True
    g.configuration.add(0)
    entered = enter_states(g, (default_transition(g, 0),))
    g.close_microstep(None, entered=entered)
    return Macrostep(before, Start(), tuple(g.microsteps), _frozen(g), now)


def step_of_transition(chart: Chart, snapshot: Snapshot, transition: int, now: int) -> Macrostep:
    """Return the effect of a transition on the states."""
    shape = shape_of(chart)
    before = replace(snapshot, now=now)
    g = Globals(shape, before, _NoHost())
    microstep(g, None, (shape.transitions[transition],))
    return Macrostep(before, None, tuple(g.microsteps), _frozen(g), now)


def _frozen(g: Globals) -> Snapshot:
    return replace(g.freeze(), timers=(), fault=None)


def snapshot_of_sync(
    image: Image, numbers: tuple[int, ...], status: int, fault: int, now: int
) -> Snapshot:
    """Return the snapshot with the states and histories of a sync.

    Raises `ValueError` if they are impossible.
    """
    chart = image.chart
    active, history = configuration_of(image, numbers)
    is_on = bool(status & RUNNING)
    return replace(
        initial(shape_of(chart)),
        configuration=active if active or not is_on else frozenset((0,)),
        history=history,
        now=now,
        running=is_on,
        finished=bool(status & FINISHED),
        fault=FAULTS[fault] if fault < len(FAULTS) else "unknown",
    )


def without_data(chart: Chart, snapshot: Snapshot) -> Snapshot:
    """Return a snapshot with the states only."""
    return replace(
        initial(shape_of(chart)),
        configuration=snapshot.configuration,
        history=snapshot.history,
        now=snapshot.now,
        running=snapshot.running,
        finished=snapshot.finished,
        fault=snapshot.fault,
    )
