"""The forms of a machine's code, and the choice of one for a chart."""

from __future__ import annotations

from enum import Enum, auto

from fsmkit.chart.analysis.effects import can_fail, has_effect
from fsmkit.codegen.c.options import Options
from fsmkit.document.document import Trigger
from fsmkit.plan import Plan


class Form(Enum):
    """The representation of candidates and reactions in C."""

    FUNCTIONS = auto()
    """Straight code, in a function for each state or event."""
    TABLES = auto()
    """Tables of candidates, exit sets and entry sets, and functions that read them."""
    GRID = auto()
    """A flat chart: the number of a piece of straight code, by state and event."""


def form_of(plan: Plan, options: Options) -> Form:
    """Return the form for speed, or the form with the fewest bytes."""
    if not options.is_small:
        return Form.FUNCTIONS
    has_grid = not options.is_tabled and _is_flat(plan) and _is_full(plan)
    return Form.GRID if has_grid else Form.TABLES


def _is_flat(plan: Plan) -> bool:
    """Whether the chart has no nested states and no guard has a side effect."""
    chart = plan.chart
    guards = (t.guard for t in chart.transitions if t.guard is not None)
    return (
        plan.is_flat
        and not any(state.is_history or state.defer for state in chart.states)
        and any(t.trigger is Trigger.EVENT and t.events for t in chart.transitions)
        and not any(can_fail(guard) or has_effect(guard) for guard in guards)
    )


READERS = 110
"""The bytes of the functions that read tables (Cortex-M0, gcc -Os)."""
ROW = 6
"""Bytes by which a transition's table row exceeds its entry in the grid, on the average."""


def _is_full(plan: Plan) -> bool:
    """Whether the grid takes fewer bytes than tables and their readers."""
    asked = [t for t in plan.chart.transitions if t.trigger is Trigger.EVENT]
    events = [event for t in asked for event in t.events]
    places = (len(plan.chart.states) - 1) * (max(events) + 1)
    return places < READERS + ROW * len(events)
