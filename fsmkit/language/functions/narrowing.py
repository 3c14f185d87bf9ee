"""Ranges of integer expressions, narrowed by the tests around them.

``0 if i == 7 else i + 1`` lies within 0..7 for ``i`` of 0..7: where ``i + 1`` is evaluated, ``i``
is not 7. Comparisons of a variable with a constant narrow it, also combined by ``and`` and ``not``.
"""

from __future__ import annotations

from collections.abc import Mapping

from fsmkit.language import tree
from fsmkit.language.arithmetic import exact, interval
from fsmkit.language.conversion import integer_bounds
from fsmkit.language.types import IntType, Overflow

Range = tuple[int, int]
Known = Mapping[str, Range]
"""Ranges of variables, by name, where they are narrower than their types."""

DENIED = {
    tree.BinaryOp.EQ: tree.BinaryOp.NE,
    tree.BinaryOp.NE: tree.BinaryOp.EQ,
    tree.BinaryOp.LT: tree.BinaryOp.GE,
    tree.BinaryOp.GE: tree.BinaryOp.LT,
    tree.BinaryOp.GT: tree.BinaryOp.LE,
    tree.BinaryOp.LE: tree.BinaryOp.GT,
}
MIRRORED = {
    tree.BinaryOp.LT: tree.BinaryOp.GT,
    tree.BinaryOp.GT: tree.BinaryOp.LT,
    tree.BinaryOp.LE: tree.BinaryOp.GE,
    tree.BinaryOp.GE: tree.BinaryOp.LE,
}


def narrow_range(expr: tree.Expr, known: Known | None = None) -> Range:
    """Return the least and the greatest value of an integer expression."""
    known = known or {}
    own = integer_bounds(expr.type)
    assert own is not None, expr  # noqa: S101  (an integer)
    found = _infer_range(expr, known)
    if found is None:
        return own
    is_within = own[0] <= found[0] and found[1] <= own[1]
    is_wrapping = isinstance(expr.type, IntType) and expr.type.overflow is Overflow.WRAP
    if is_wrapping and not is_within:
        return own
    return max(own[0], found[0]), min(own[1], found[1])


def _infer_range(expr: tree.Expr, known: Known) -> Range | None:
    match expr:
        case tree.Literal(value) if isinstance(value, int):
            return int(value), int(value)
        case tree.Variable(name):
            return known.get(name)
        case tree.Unary(tree.UnaryOp.NEGATE, operand):
            lo, hi = narrow_range(operand, known)
            return -hi, -lo
        case tree.Binary(op, left, right) if isinstance(left.type, IntType):
            if not isinstance(right.type, IntType) or not isinstance(expr.type, IntType):
                return None
            one, other = narrow_range(left, known), narrow_range(right, known)
            result = interval(op, exact(*one), exact(*other))
            return None if result is None else (result.lo, result.hi)
        case tree.Conditional(test, then, otherwise):
            first = narrow_range(then, assume(test, known, holds=True))
            second = narrow_range(otherwise, assume(test, known, holds=False))
            return min(first[0], second[0]), max(first[1], second[1])
        case tree.Apply(tree.Function.MIN | tree.Function.MAX as function, arguments):
            ranges = [narrow_range(argument, known) for argument in arguments]
            pick = min if function is tree.Function.MIN else max
            return pick(r[0] for r in ranges), pick(r[1] for r in ranges)
        case tree.Convert(operand) if isinstance(operand.type, IntType):
            return narrow_range(operand, known)
        case _:
            return None


def assume(test: tree.Expr, known: Known, *, holds: bool) -> Known:
    """Return the ranges where a test holds, or where it does not."""
    match test:
        case tree.Unary(tree.UnaryOp.NOT, operand):
            return assume(operand, known, holds=not holds)
        case tree.Binary(tree.BinaryOp.AND, left, right) if holds:
            return assume(right, assume(left, known, holds=True), holds=True)
        case tree.Binary(tree.BinaryOp.OR, left, right) if not holds:
            return assume(right, assume(left, known, holds=False), holds=False)
        case tree.Binary(op, tree.Variable() as variable, tree.Literal(value)) if op in DENIED:
            return _narrow_by_comparison(variable, op if holds else DENIED[op], value, known)
        case tree.Binary(op, tree.Literal(value), tree.Variable() as variable) if op in DENIED:
            seen = MIRRORED.get(op, op)
            return _narrow_by_comparison(variable, seen if holds else DENIED[seen], value, known)
        case _:
            return known


def _narrow_by_comparison(
    variable: tree.Variable, op: tree.BinaryOp, value: object, known: Known
) -> Known:
    span = known.get(variable.name) or integer_bounds(variable.type)
    if span is None or not isinstance(variable.type, IntType) or not isinstance(value, int):
        return known
    lo, hi = span
    match op:
        case tree.BinaryOp.EQ:
            lo, hi = max(lo, value), min(hi, value)
        case tree.BinaryOp.NE:
            lo, hi = lo + (lo == value), hi - (hi == value)
        case tree.BinaryOp.LT:
            hi = min(hi, value - 1)
        case tree.BinaryOp.LE:
            hi = min(hi, value)
        case tree.BinaryOp.GT:
            lo = max(lo, value + 1)
        case _:
            lo = max(lo, value)
    if lo > hi:  # never evaluated
        return known
    return {**known, variable.name: (lo, hi)}
