"""``invariant: P``: P holds in all reachable states.

An ``invariant`` of a state of a chart is a property of this kind: it holds while the state is
active.
"""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.chart.chart import Chart
from fsmkit.language import BOOL, Binary, BinaryOp, InState, Unary, UnaryOp
from fsmkit.system.properties.property import AtStates, Kind, Property

KIND = Kind("invariant", AtStates(negated=True), is_local=True)


def invariants_of(chart: Chart, machine: int, *, prefix: str) -> Iterator[Property]:
    """Yield a property for each ``invariant`` of a state of a machine, so numbered."""
    for state in chart.states:
        if state.invariant is None:
            continue
        span = state.invariant.span
        left = Unary(UnaryOp.NOT, InState(state.index, state.id, span), BOOL, span)
        condition = Binary(BinaryOp.OR, left, state.invariant, BOOL, span)
        name = f"{prefix}{state.id}.invariant"
        text = f"the invariant of `{prefix}{state.id}`"
        yield Property(name, KIND, text, condition, owner=machine, span=span, req=state.req)
