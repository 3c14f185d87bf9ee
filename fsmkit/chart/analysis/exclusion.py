"""Facts about conditions from their form alone: exclusion of two, and constant results."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import combinations
from typing import Any

import fsmkit.language as lang
from fsmkit.chart.analysis.effects import can_fail
from fsmkit.chart.analysis.ranges import Range, raw_range, within
from fsmkit.chart.chart import Chart
from fsmkit.chart.structure import can_be_together
from fsmkit.language.conversion import integer_bounds
from fsmkit.language.walk import calls

HOLDS: Mapping[lang.BinaryOp, Callable[[Any, Any], bool]] = {
    lang.BinaryOp.EQ: operator.eq,
    lang.BinaryOp.NE: operator.ne,
    lang.BinaryOp.LT: operator.lt,
    lang.BinaryOp.LE: operator.le,
    lang.BinaryOp.GT: operator.gt,
    lang.BinaryOp.GE: operator.ge,
}
"""Comparisons."""
NEGATED = {
    lang.BinaryOp.EQ: lang.BinaryOp.NE,
    lang.BinaryOp.NE: lang.BinaryOp.EQ,
    lang.BinaryOp.LT: lang.BinaryOp.GE,
    lang.BinaryOp.GE: lang.BinaryOp.LT,
    lang.BinaryOp.GT: lang.BinaryOp.LE,
    lang.BinaryOp.LE: lang.BinaryOp.GT,
}
MIRRORED = {
    lang.BinaryOp.EQ: lang.BinaryOp.EQ,
    lang.BinaryOp.NE: lang.BinaryOp.NE,
    lang.BinaryOp.LT: lang.BinaryOp.GT,
    lang.BinaryOp.GT: lang.BinaryOp.LT,
    lang.BinaryOp.LE: lang.BinaryOp.GE,
    lang.BinaryOp.GE: lang.BinaryOp.LE,
}
MOST_SYMBOLS = 1 << 16
"""Strings of a chart, at most: symbols are numbered."""
MOST_CASES = 64
"""A condition with more alternatives is not looked into."""

Fact = tuple[lang.Expr, bool]
"""An atomic condition and whether it holds."""
Cases = Sequence[tuple[Fact, ...]]
"""Conjunctions, of which one holds."""


def are_exclusive(chart: Chart, first: lang.Expr, second: lang.Expr) -> bool:
    """Whether no valuation satisfies both. False if the form does not prove it.

    An operation of the host is taken to answer alike both times.
    """
    return _exclude(chart, cases(first, holds=True), cases(second, holds=True))


def implies(chart: Chart, first: lang.Expr, second: lang.Expr) -> bool:
    """Whether the second holds whenever the first does. False if the form does not prove it."""
    return _exclude(chart, cases(first, holds=True), cases(second, holds=False))


def can_hold_together(chart: Chart, facts: Iterable[Fact]) -> bool:
    """Whether nothing in their form excludes that conditions hold, or do not, at once.

    False, too, where they have more than `MOST_CASES` alternatives.
    """
    conjunctions: list[tuple[Fact, ...]] = [()]
    for expr, holds in facts:
        more = cases(expr, holds=holds)
        if len(conjunctions) * len(more) > MOST_CASES:
            return False
        conjunctions = [
            (*one, *other)
            for one in conjunctions
            for other in more
            if not _is_contradictory(chart, other) and not _contradict(chart, one, other)
        ]
    return any(map(_fits, conjunctions))


def _fits(facts: Sequence[Fact]) -> bool:
    """Whether all comparisons of a conjunction can hold, given the ranges of their operands.

    A comparison with a constant narrows every occurrence of its other operand. A comparison that
    does not hold may have failed, so it narrows nothing.
    """
    known: dict[lang.Expr, Range] = {}
    compared: list[tuple[lang.Expr, lang.BinaryOp, lang.Expr]] = []
    for expr, holds in facts:
        if (
            not isinstance(expr, lang.Binary)
            or expr.op not in NEGATED
            or (not holds and can_fail(expr))
        ):
            continue
        compared.append((expr.left, expr.op if holds else NEGATED[expr.op], expr.right))

    def lies(expr: lang.Expr) -> Range | None:
        own, found = _discrete(expr.type), raw_range(expr, lies)
        between = own if own is None or found is None or not within(found, own) else found
        narrow = known.get(expr)
        if between is None or narrow is None:
            return between
        return max(between[0], narrow[0]), min(between[1], narrow[1])

    mirrored = [(right, MIRRORED[op], left) for left, op, right in compared]
    for subject, op, bound in (*compared, *mirrored):
        between = lies(subject)
        if between is not None and isinstance(bound, lang.Literal) and type(bound.value) is int:
            known[subject] = _narrowed(between, op, bound.value)
    ranges = ((lies(left), op, lies(right)) for left, op, right in compared)
    return all(a is None or b is None or _possible(a, op, b) for a, op, b in ranges)


def _narrowed(between: Range, op: lang.BinaryOp, bound: int) -> Range:
    lo, hi = between
    match op:
        case lang.BinaryOp.EQ:
            return max(lo, bound), min(hi, bound)
        case lang.BinaryOp.LT | lang.BinaryOp.LE:
            return lo, min(hi, bound - (op is lang.BinaryOp.LT))
        case lang.BinaryOp.GT | lang.BinaryOp.GE:
            return max(lo, bound + (op is lang.BinaryOp.GT)), hi
        case _:
            return lo + (lo == bound), hi - (hi == bound)


def _possible(a: Range, op: lang.BinaryOp, b: Range) -> bool:
    """Whether a comparison can hold of values in two ranges, of which one may be empty."""
    if a[0] > a[1] or b[0] > b[1]:
        return False
    match op:
        case lang.BinaryOp.EQ:
            return a[0] <= b[1] and b[0] <= a[1]
        case lang.BinaryOp.NE:
            return a != b or a[0] != a[1]
        case lang.BinaryOp.LT | lang.BinaryOp.LE:
            return HOLDS[op](a[0], b[1])
        case _:
            return HOLDS[op](a[1], b[0])


def _exclude(chart: Chart, ones: Cases, others: Cases) -> bool:
    if len(ones) * len(others) > MOST_CASES**2:
        return False
    return exclude(chart, _possible_cases(chart, ones), _possible_cases(chart, others))


def exclude(chart: Chart, ones: Cases, others: Cases) -> bool:
    """Return whether each of `possible_cases` contradicts each one of the others."""
    if len(ones) * len(others) > MOST_CASES**2:
        return False
    return all(_contradict(chart, one, other) for one in ones for other in others)


def possible_cases(chart: Chart, expr: lang.Expr, *, holds: bool) -> Cases:
    """Return the `cases` of a condition that do not contradict themselves."""
    return _possible_cases(chart, cases(expr, holds=holds))


def _possible_cases(chart: Chart, found: Cases) -> Cases:
    return [one for one in found if not _is_contradictory(chart, one)]


def cases(expr: lang.Expr, *, holds: bool) -> list[tuple[Fact, ...]]:
    """Return the disjunctive normal form: the condition is one of the cases, each a conjunction."""
    match expr:
        case lang.Literal(bool(value)):
            return [()] if value is holds else []
        case lang.Unary(lang.UnaryOp.NOT, operand):
            return cases(operand, holds=not holds)
        case lang.Binary(lang.BinaryOp.AND | lang.BinaryOp.OR as op, left, right):
            lefts, rights = cases(left, holds=holds), cases(right, holds=holds)
            if (op is lang.BinaryOp.OR) is holds:
                return lefts + rights
            if len(lefts) * len(rights) > MOST_CASES:
                return [((expr, holds),)]
            return [(*a, *b) for a in lefts for b in rights]
        case _:
            return [((expr, holds),)]


def _is_contradictory(chart: Chart, facts: tuple[Fact, ...]) -> bool:
    return any(_opposed(chart, one, other) for one, other in combinations(facts, 2))


def _contradict(chart: Chart, ones: tuple[Fact, ...], others: tuple[Fact, ...]) -> bool:
    """Whether two conjunctions, neither of which contradicts itself, exclude each other."""
    return any(_opposed(chart, one, other) for one in ones for other in others)


def _opposed(chart: Chart, one: Fact, other: Fact) -> bool:
    (left, left_holds), (right, right_holds) = one, other
    if left == right:
        return left_holds is not right_holds
    if isinstance(left, lang.InState) and isinstance(right, lang.InState):
        return left_holds and right_holds and not can_be_together(chart, left.state, right.state)
    first, second = _comparison(left, holds=left_holds), _comparison(right, holds=right_holds)
    return first is not None and second is not None and _are_disjoint(first, second)


Comparison = tuple[lang.Expr, lang.BinaryOp, lang.Literal]


def _comparison(expr: lang.Expr, *, holds: bool) -> Comparison | None:
    """Return a comparison with a constant, the constant to the right."""
    match expr:
        case lang.Binary(op, subject, lang.Literal() as constant) if op in NEGATED:
            pass
        case lang.Binary(op, lang.Literal() as constant, subject) if op in NEGATED:
            op = MIRRORED[op]
        case _:
            return None
    return subject, op if holds else NEGATED[op], constant


def _are_disjoint(first: Comparison, second: Comparison) -> bool:
    """Return whether no value satisfies both of two comparisons of one subject."""
    (subject, op, bound), (other, other_op, other_bound) = first, second
    if subject != other:
        return False
    a, b = bound.value, other_bound.value
    if op is lang.BinaryOp.EQ or other_op is lang.BinaryOp.EQ:
        if op is not lang.BinaryOp.EQ:
            op, other_op, a, b = other_op, op, b, a
        return not _satisfies(a, other_op, b)
    if not isinstance(a, int | float) or not isinstance(b, int | float):
        return False
    below, above = (lang.BinaryOp.LT, lang.BinaryOp.LE), (lang.BinaryOp.GT, lang.BinaryOp.GE)
    if op in above and other_op in below:
        op, other_op, a, b = other_op, op, b, a
    if not (op in below and other_op in above):
        return False
    touches = op is lang.BinaryOp.LE and other_op is lang.BinaryOp.GE
    return a < b or (a == b and not touches)


def _satisfies(value: object, op: lang.BinaryOp, bound: object) -> bool:
    is_order = op not in (lang.BinaryOp.EQ, lang.BinaryOp.NE)
    if is_order and not (isinstance(value, int | float) and isinstance(bound, int | float)):
        return True
    return HOLDS[op](value, bound)


def outcome(expr: lang.Binary) -> bool | None:
    """Return the value of a comparison that the types of its operands decide, or None.

    The operands must have no effects and no failures, because they are no longer evaluated.
    """
    if expr.op not in HOLDS:
        return None
    a, b = _discrete(expr.left.type), _discrete(expr.right.type)
    if a is None or b is None:
        return None
    if expr.left == expr.right and not calls(expr.left):
        return HOLDS[expr.op](0, 0)
    if a[1] < b[0] or (a[1] == b[0] and expr.op in (lang.BinaryOp.LE, lang.BinaryOp.GT)):
        return HOLDS[expr.op](0, 1)
    if a[0] > b[1] or (a[0] == b[1] and expr.op in (lang.BinaryOp.GE, lang.BinaryOp.LT)):
        return HOLDS[expr.op](1, 0)
    return None


def joint_outcome(expr: lang.Binary) -> bool | None:
    """Return the constant value of ``x < 2 && x > 5`` or ``x > 2 || x < 5``, or None."""
    left, right = _comparison(expr.left, holds=True), _comparison(expr.right, holds=True)
    if left is None or right is None or left[0] != right[0]:
        return None
    (subject, op1, one), (_, op2, other) = left, right
    c1, c2 = one.value, other.value
    if not isinstance(subject, lang.Variable) or _discrete(subject.type) is None:
        return None
    if not isinstance(c1, int) or not isinstance(c2, int):
        return None
    tried = [c + d for c in (c1, c2) for d in (-1, 0, 1)]  # between these nothing changes
    results = [(HOLDS[op1](x, c1), HOLDS[op2](x, c2)) for x in tried]
    if expr.op is lang.BinaryOp.AND and not any(a and b for a, b in results):
        return False
    if expr.op is lang.BinaryOp.OR and all(a or b for a, b in results):
        return True
    return None


def _discrete(type_: lang.Type | None) -> tuple[int, int] | None:
    """Return the bounds of a type whose values are single numbers, except for `bool`."""
    if isinstance(type_, lang.SymbolType):
        return 0, MOST_SYMBOLS - 1
    return None if isinstance(type_, lang.BoolType) else integer_bounds(type_)
