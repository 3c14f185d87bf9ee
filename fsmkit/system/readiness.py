"""When a machine need not move, and when it must look at what others have changed."""

from __future__ import annotations

from fsmkit.chart.chart import Chart
from fsmkit.document.document import Kind, Trigger
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.system.shared import reads_shared
from fsmkit.system.system import Machine


def tries_eventless(machine: Machine, chart: Chart) -> bool:
    """Whether an eventless guard reads what others change, so that a change matters at once."""
    return index_of(chart).samples_inputs or reads_shared(
        machine, [t.guard for t in chart.transitions if t.trigger is Trigger.EVENTLESS]
    )


def resting(chart: Chart, machine: Machine) -> frozenset[int]:
    """Return the leaves where a machine may wait for ever: marked, in a marked one, or final.

    A monitor may wait anywhere.
    """
    if machine.is_monitor:
        return frozenset(range(len(chart.states)))
    marked = [False] * len(chart.states)
    for state in chart.states:  # parents come before their children
        marked[state.index] = state.rest or (state.parent is not None and marked[state.parent])
    return frozenset(
        state.index for state in chart.states if state.kind is Kind.FINAL or marked[state.index]
    )
