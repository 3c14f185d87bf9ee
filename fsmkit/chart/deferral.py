"""Deferral and regions: who can still answer an event that a state defers (UML 2.5.1, p. 309).

An event is deferred if an active state defers it and neither that state nor an active one below it
has an enabled transition for it. Then no region takes it.
"""

from __future__ import annotations

from fsmkit.chart.chart import Chart
from fsmkit.document.document import Kind


def shared_deferral(chart: Chart) -> tuple[frozenset[int], ...]:
    """Return by state the events it defers that states in regions below it have transitions on.

    Whether such an event is deferred is known only when all these regions have been asked; of any
    other it is known as soon as the state is reached from one atomic state below it.
    """
    if not any(state.defer for state in chart.states):
        return (frozenset(),) * len(chart.states)
    found: list[set[int]] = [set() for _ in chart.states]
    for transition in chart.transitions:
        events = frozenset(transition.events)
        is_in_region = False
        for above in chart.ancestors(transition.source) if events else ():
            is_in_region = is_in_region or chart.states[above].kind is Kind.PARALLEL
            if is_in_region:
                found[above] |= events.intersection(chart.states[above].defer)
    return tuple(map(frozenset, found))
