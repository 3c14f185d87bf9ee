"""Charts that count what tests reach of them: what is counted, and where in an area of bytes.

An area holds a byte for each state, then for each transition, then for each guard one for each way
through it. Where a guard has very many conditions it has two bytes (it was false, it was true) and
then, in whole bytes, two bits for each condition. A byte says how often, and stops at 255; of ways
code may say only that they were taken, which is 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from fsmkit.chart.analysis.decisions import (
    MOST_CONDITIONS,
    DecisionPaths,
    Outcomes,
    decision_paths,
    shape_of,
)
from fsmkit.chart.chart import Chart
from fsmkit.language import Binary, BinaryOp, CoveredCondition, CoveredGuard, Expr, Unary, UnaryOp
from fsmkit.plan.fingerprint import MEMO, fingerprint

FULL = 255
"""The value at which a counter stops."""


@dataclass(frozen=True, slots=True)
class Guard:
    """The location and the layout of a guard's counters."""

    counter: int
    """The byte of its first path; without paths, that of its false values, then its true values."""
    ways: DecisionPaths
    """Its paths; for a guard without paths, `outcomes` names the bits instead."""

    @property
    def is_noted(self) -> bool:
        """Whether its conditions are counted by their values instead of its paths."""
        return not self.ways.missed

    @property
    def bytes(self) -> int:
        """The number of its bytes."""
        count = len(self.ways.outcomes)
        return 2 + (count + 7) // 8 if self.is_noted else count


@dataclass(frozen=True, slots=True)
class Area:
    """The layout of a chart's counters."""

    first_transition: int
    guards: Mapping[int, Guard]
    """The guards, by transition."""
    size: int
    """The size in bytes."""

    @property
    def noted(self) -> int:
        """The most bytes for the values of conditions of one guard without paths."""
        return max((g.bytes - 2 for g in self.guards.values() if g.is_noted), default=0)


def area_of(chart: Chart) -> Area:
    """Return the layout of a chart's counters, without its invoked charts; `counted` or not."""
    transitions = len(chart.states)
    counter = transitions + len(chart.transitions)
    guards: dict[int, Guard] = {}
    for transition in chart.transitions:
        if transition.guard is not None:
            guard = guards[transition.index] = Guard(counter, _paths_of(transition.guard))
            counter += guard.bytes
    return Area(transitions, guards, counter)


def _paths_of(guard: Expr) -> DecisionPaths:
    shape, conditions = shape_of(guard.operand if isinstance(guard, CoveredGuard) else guard)
    count = len(conditions)
    if count <= MOST_CONDITIONS:
        return decision_paths(shape, count)
    nothing: Outcomes = (None,) * count
    outcomes = (
        (*nothing[:place], value, *nothing[place + 1 :])
        for place in range(count)
        for value in (False, True)
    )
    return DecisionPaths((), tuple(outcomes))


def counted(chart: Chart) -> Chart:
    """Return a chart with counted guards, also in the charts that it invokes.

    It keeps the fingerprint of the chart, since nothing else differs.
    """
    area = area_of(chart)
    found = replace(
        chart,
        transitions=tuple(
            t if t.guard is None else replace(t, guard=_counted(t.guard, area.guards[t.index]))
            for t in chart.transitions
        ),
        invocations=tuple(replace(i, chart=counted(i.chart)) for i in chart.invocations),
    )
    found.__dict__[MEMO] = fingerprint(chart)
    return found


def _counted(guard: Expr, where: Guard) -> Expr:
    """Return a guard with its conditions and itself counted."""
    number = 0

    def watched(expr: Expr) -> Expr:
        nonlocal number
        match expr:
            case Binary(op, left, right) if op in (BinaryOp.AND, BinaryOp.OR):
                first = watched(left)
                return replace(expr, left=first, right=watched(right))
            case Unary(UnaryOp.NOT, operand):
                return replace(expr, operand=watched(operand))
            case _:
                place, number = number, number + 1
                if where.is_noted:
                    return CoveredCondition(expr, 0, 2 * place, place == 0, expr.span)
                return CoveredCondition(expr, where.ways.missed[place], -1, place == 0, expr.span)

    noted = where.bytes - 2 if where.is_noted else 0
    return CoveredGuard(watched(guard), where.counter, noted, guard.span)
