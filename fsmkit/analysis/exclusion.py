"""Whether two conditions can hold at once, judged from their form alone."""

from __future__ import annotations

from fsmkit.chart.chart import Chart
from fsmkit.document.document import Kind
from fsmkit.language import Binary, BinaryOp, Expr, InState, Literal, Unary, UnaryOp

NEGATED = {
    BinaryOp.EQ: BinaryOp.NE,
    BinaryOp.NE: BinaryOp.EQ,
    BinaryOp.LT: BinaryOp.GE,
    BinaryOp.GE: BinaryOp.LT,
    BinaryOp.GT: BinaryOp.LE,
    BinaryOp.LE: BinaryOp.GT,
}
MIRRORED = {
    BinaryOp.EQ: BinaryOp.EQ,
    BinaryOp.NE: BinaryOp.NE,
    BinaryOp.LT: BinaryOp.GT,
    BinaryOp.GT: BinaryOp.LT,
    BinaryOp.LE: BinaryOp.GE,
    BinaryOp.GE: BinaryOp.LE,
}
MOST_CASES = 64
"""A condition with more alternatives is not looked into."""

Fact = tuple[Expr, bool]
"""An atomic condition and whether it holds."""


def are_exclusive(chart: Chart, first: Expr, second: Expr) -> bool:
    """Whether no valuation satisfies both. False where the form does not show it.

    An operation of the host is taken to answer alike both times.
    """
    return _exclude(chart, cases(first, holds=True), cases(second, holds=True))


def implies(chart: Chart, first: Expr, second: Expr) -> bool:
    """Whether the second holds whenever the first does. False where the form does not show it."""
    return _exclude(chart, cases(first, holds=True), cases(second, holds=False))


def are_complementary(chart: Chart, first: Expr, second: Expr) -> bool:
    """Whether one of the two always holds: their negations exclude each other."""
    return _exclude(chart, cases(first, holds=False), cases(second, holds=False))


def _exclude(chart: Chart, ones: list[tuple[Fact, ...]], others: list[tuple[Fact, ...]]) -> bool:
    if len(ones) * len(others) > MOST_CASES**2:
        return False
    return all(_contradict(chart, one, other) for one in ones for other in others)


def cases(expr: Expr, *, holds: bool) -> list[tuple[Fact, ...]]:
    """Return the disjunctive normal form: the condition is one of the cases, each a conjunction."""
    match expr:
        case Literal(bool(value)):
            return [()] if value is holds else []
        case Unary(UnaryOp.NOT, operand):
            return cases(operand, holds=not holds)
        case Binary(BinaryOp.AND | BinaryOp.OR as op, left, right):
            lefts, rights = cases(left, holds=holds), cases(right, holds=holds)
            if (op is BinaryOp.OR) is holds:
                return lefts + rights
            if len(lefts) * len(rights) > MOST_CASES:
                return [((expr, holds),)]
            return [(*a, *b) for a in lefts for b in rights]
        case _:
            return [((expr, holds),)]


def _contradict(chart: Chart, one: tuple[Fact, ...], other: tuple[Fact, ...]) -> bool:
    facts = (*one, *other)
    return any(
        _opposed(chart, fact, against) for i, fact in enumerate(facts) for against in facts[:i]
    )


def _opposed(chart: Chart, one: Fact, other: Fact) -> bool:
    (left, left_holds), (right, right_holds) = one, other
    if left == right:
        return left_holds is not right_holds
    if isinstance(left, InState) and isinstance(right, InState):
        return left_holds and right_holds and _never_together(chart, left.state, right.state)
    first, second = _comparison(left, left_holds), _comparison(right, right_holds)
    return first is not None and second is not None and _disjoint(first, second)


Comparison = tuple[Expr, BinaryOp, Literal]


def _comparison(expr: Expr, holds: bool) -> Comparison | None:
    """Return a comparison with a constant, the constant to the right."""
    match expr:
        case Binary(op, subject, Literal() as constant) if op in NEGATED:
            pass
        case Binary(op, Literal() as constant, subject) if op in NEGATED:
            op = MIRRORED[op]
        case _:
            return None
    return subject, op if holds else NEGATED[op], constant


def _disjoint(first: Comparison, second: Comparison) -> bool:
    """Whether no value satisfies both comparisons of one subject."""
    (subject, op, bound), (other, other_op, other_bound) = first, second
    if subject != other:
        return False
    a, b = bound.value, other_bound.value
    if op is BinaryOp.EQ or other_op is BinaryOp.EQ:
        if op is not BinaryOp.EQ:
            op, other_op, a, b = other_op, op, b, a
        return not _satisfies(a, other_op, b)
    if not isinstance(a, int | float) or not isinstance(b, int | float):
        return False
    below, above = (BinaryOp.LT, BinaryOp.LE), (BinaryOp.GT, BinaryOp.GE)
    if op in above and other_op in below:
        op, other_op, a, b = other_op, op, b, a
    if not (op in below and other_op in above):
        return False
    touches = op is BinaryOp.LE and other_op is BinaryOp.GE
    return a < b or (a == b and not touches)


def _satisfies(value: object, op: BinaryOp, bound: object) -> bool:
    if op is BinaryOp.EQ:
        return value == bound
    if op is BinaryOp.NE:
        return value != bound
    if not isinstance(value, int | float) or not isinstance(bound, int | float):
        return True
    match op:
        case BinaryOp.LT:
            return value < bound
        case BinaryOp.LE:
            return value <= bound
        case BinaryOp.GT:
            return value > bound
        case _:
            return value >= bound


def _never_together(chart: Chart, first: int, second: int) -> bool:
    """Whether no configuration holds both states: they part in a compound state."""
    if first == second or chart.is_descendant(first, second) or chart.is_descendant(second, first):
        return False
    meet = next(a for a in chart.ancestors(first) if chart.is_descendant(second, a))
    return chart.states[meet].kind is not Kind.PARALLEL
