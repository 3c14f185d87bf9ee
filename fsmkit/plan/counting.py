"""Charts that count what tests reach of them: what is counted, and where in an area of bytes.

An area holds a byte for each state, then for each transition, then two for each guard (how often it
was false, true), each of which stops at 255; then, from a whole byte on, for each guard of two
conditions and more a bit for each way through it, or, where it has very many, two for each
condition (it was false, it was true).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from fsmkit.analysis.decisions import MOST_CONDITIONS, Outcomes, Ways, shape_of, ways_of
from fsmkit.chart.chart import Chart
from fsmkit.language import Binary, BinaryOp, Decided, Expr, Unary, UnaryOp, Watched
from fsmkit.plan.fingerprint import MEMO, fingerprint

FULL = 255
"""Where a counter stops."""


@dataclass(frozen=True, slots=True)
class Guard:
    """Where a guard is counted."""

    counter: int
    """The byte of how often it was false; the next one: true."""
    first: int
    """The first of its bits, counted from the beginning of the area."""
    outcomes: tuple[Outcomes, ...]
    """What each bit stands for; nothing where there is one condition."""
    missed: tuple[int, ...]
    """By condition; empty where no ways are kept."""

    @property
    def bits(self) -> int:
        """How many bits it has."""
        return len(self.outcomes)


@dataclass(frozen=True, slots=True)
class Area:
    """Where all of a chart is counted."""

    first_transition: int
    guards: Mapping[int, Guard]
    """By transition."""
    size: int
    """In bytes."""

    @property
    def noted(self) -> int:
        """The bytes that the conditions of one guard note at most, where no ways are kept."""
        many = (g.bits for g in self.guards.values() if g.bits and not g.missed)
        return max(((bits + 7) // 8 for bits in many), default=0)


def area_of(chart: Chart) -> Area:
    """Return where a chart, without those that it invokes, is counted; `counted` or not."""
    transitions = len(chart.states)
    counter = transitions + len(chart.transitions)
    guarded = [t for t in chart.transitions if t.guard is not None]
    first = 8 * (counter + 2 * len(guarded))
    guards: dict[int, Guard] = {}
    for transition in guarded:
        assert transition.guard is not None  # noqa: S101
        ways = _ways(transition.guard)
        if not ways.missed and ways.outcomes:
            first = (first + 7) // 8 * 8  # whole bytes, which are copied at once
        guards[transition.index] = Guard(counter, first, ways.outcomes, ways.missed)
        counter += 2
        first += len(ways.outcomes)
        if not ways.missed:
            first = (first + 7) // 8 * 8
    return Area(transitions, guards, (first + 7) // 8)


def _ways(guard: Expr) -> Ways:
    shape, conditions = shape_of(guard.operand if isinstance(guard, Decided) else guard)
    count = len(conditions)
    if count == 1:
        return Ways((), ())
    if count <= MOST_CONDITIONS:
        return ways_of(shape, count)
    nothing: Outcomes = (None,) * count
    each = (
        (*nothing[:place], value, *nothing[place + 1 :])
        for place in range(count)
        for value in (False, True)
    )
    return Ways((), tuple(each))


def counted(chart: Chart) -> Chart:
    """Return a chart whose guards are counted, and those of the charts that it invokes.

    It keeps the fingerprint of the chart: nothing else is different.
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
                if not where.bits:
                    return expr
                if where.missed:
                    return Watched(expr, where.missed[place], -1, place == 0, expr.span)
                return Watched(expr, 0, 2 * place, place == 0, expr.span)

    inside = watched(guard)
    is_noted = bool(where.bits) and not where.missed
    bits = (where.bits + 7) // 8 * 8 if is_noted else where.bits
    return Decided(inside, where.counter, where.first, bits, is_noted, guard.span)
