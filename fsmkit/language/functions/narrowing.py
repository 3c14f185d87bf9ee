"""Between which values an integer expression lies, with what the tests around it say.

``0 if i == 7 else i + 1`` lies within 0..7 for ``i`` of 0..7: where ``i + 1`` is evaluated, ``i``
is not 7. Comparisons of a variable with a constant narrow it, and what ``and`` and ``not`` make of
these; all else says nothing.
"""

from __future__ import annotations

from collections.abc import Mapping

from fsmkit.language import tree
from fsmkit.language.arithmetic import exact, interval
from fsmkit.language.conversion import of_type
from fsmkit.language.types import IntType, Overflow

Range = tuple[int, int]
Known = Mapping[str, Range]
"""What is known of variables beyond their types, by name."""

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


def narrowed(expr: tree.Expr, known: Known | None = None) -> Range:
    """Return the least and the greatest value of an integer expression."""
    known = known or {}
    own = of_type(expr.type)
    assert own is not None, expr  # noqa: S101  (an integer)
    found = _found(expr, known)
    if found is None:
        return own
    is_within = own[0] <= found[0] and found[1] <= own[1]
    is_wrapping = isinstance(expr.type, IntType) and expr.type.overflow is Overflow.WRAP
    if is_wrapping and not is_within:
        return own
    return max(own[0], found[0]), min(own[1], found[1])


def _found(expr: tree.Expr, known: Known) -> Range | None:
    match expr:
        case tree.Literal(value) if isinstance(value, int):
            return int(value), int(value)
        case tree.Variable(name):
            return known.get(name)
        case tree.Unary(tree.UnaryOp.NEGATE, operand):
            lo, hi = narrowed(operand, known)
            return -hi, -lo
        case tree.Binary(op, left, right) if isinstance(left.type, IntType):
            if not isinstance(right.type, IntType) or not isinstance(expr.type, IntType):
                return None
            one, other = narrowed(left, known), narrowed(right, known)
            result = interval(op, exact(*one), exact(*other))
            return None if result is None else (result.lo, result.hi)
        case tree.Conditional(test, then, otherwise):
            first = narrowed(then, assumed(test, known, holds=True))
            second = narrowed(otherwise, assumed(test, known, holds=False))
            return min(first[0], second[0]), max(first[1], second[1])
        case tree.Apply(tree.Function.MIN | tree.Function.MAX as function, arguments):
            ranges = [narrowed(argument, known) for argument in arguments]
            pick = min if function is tree.Function.MIN else max
            return pick(r[0] for r in ranges), pick(r[1] for r in ranges)
        case tree.Convert(operand) if isinstance(operand.type, IntType):
            return narrowed(operand, known)
        case _:
            return None


def assumed(test: tree.Expr, known: Known, *, holds: bool) -> Known:
    """Return what is known where a test holds, or where it does not."""
    match test:
        case tree.Unary(tree.UnaryOp.NOT, operand):
            return assumed(operand, known, holds=not holds)
        case tree.Binary(tree.BinaryOp.AND, left, right) if holds:
            return assumed(right, assumed(left, known, holds=True), holds=True)
        case tree.Binary(tree.BinaryOp.OR, left, right) if not holds:
            return assumed(right, assumed(left, known, holds=False), holds=False)
        case tree.Binary(op, tree.Variable() as variable, tree.Literal(value)) if op in DENIED:
            return _compared(variable, op if holds else DENIED[op], value, known)
        case tree.Binary(op, tree.Literal(value), tree.Variable() as variable) if op in DENIED:
            seen = MIRRORED.get(op, op)
            return _compared(variable, seen if holds else DENIED[seen], value, known)
        case _:
            return known


def _compared(variable: tree.Variable, op: tree.BinaryOp, value: object, known: Known) -> Known:
    span = known.get(variable.name) or of_type(variable.type)
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
