"""Ranges of expressions: a result that cannot leave its type needs no wrap-around."""

from __future__ import annotations

from collections.abc import Callable

import fsmkit.language as lang
from fsmkit.language.arithmetic import exact, interval
from fsmkit.language.conversion import integer_bounds

Range = tuple[int, int]
"""The least and the greatest value."""


def range_of(expr: lang.Expr) -> Range | None:
    """Return the bounds of an expression's value, or None if it is not a whole number."""
    own = integer_bounds(expr.type)
    found = raw_range(expr)
    return own if own is None or found is None or not within(found, own) else found


def raw_range(
    expr: lang.Expr, range_of_part: Callable[[lang.Expr], Range | None] = range_of
) -> Range | None:
    """Return the bounds of an expression before the reduction to its type, or None if unknown.

    ``range_of_part`` returns the range of an operand.
    """
    match expr:
        case lang.Literal(value) if isinstance(value, int):
            return int(value), int(value)
        case lang.Unary(lang.UnaryOp.NEGATE, operand) if (
            found := range_of_part(operand)
        ) is not None:
            return -found[1], -found[0]
        case lang.Unary(lang.UnaryOp.INVERT, operand) if (
            found := range_of_part(operand)
        ) is not None:
            return -found[1] - 1, -found[0] - 1
        case lang.Binary(op, left, right) if op in ARITHMETIC:
            one, other = range_of_part(left), range_of_part(right)
            return None if one is None or other is None else _of_operator(op, one, other)
        case lang.Conditional(_, then, otherwise):
            return _joined([range_of_part(then), range_of_part(otherwise)])
        case lang.Apply(function, arguments):
            return _of_function(function, [range_of_part(argument) for argument in arguments])
        case lang.Convert(operand) if (outer := integer_bounds(expr.type)) is not None:
            inner = range_of_part(operand)
            if inner is None or within(inner, outer):
                return inner or outer
            if isinstance(expr.type, lang.IntType) and expr.type.overflow is lang.Overflow.WRAP:
                return outer
            return tuple(min(max(end, outer[0]), outer[1]) for end in inner)  # type: ignore[return-value]
        case _:
            return integer_bounds(expr.type)


def within(inner: Range, outer: Range) -> bool:
    """Whether a range lies in another."""
    return outer[0] <= inner[0] and inner[1] <= outer[1]


ARITHMETIC = frozenset(lang.BinaryOp) - {
    *(lang.BinaryOp.OR, lang.BinaryOp.AND, lang.BinaryOp.EQ, lang.BinaryOp.NE),
    *(lang.BinaryOp.LT, lang.BinaryOp.LE, lang.BinaryOp.GT, lang.BinaryOp.GE),
}


def _of_operator(op: lang.BinaryOp, left: Range, right: Range) -> Range | None:
    found = interval(op, exact(*left), exact(*right))
    if found is None and op is lang.BinaryOp.SHIFT_RIGHT:  # by a count that is reduced to the width
        return min(left[0], 0), max(left[1], -1)
    return None if found is None else (found.lo, found.hi)


def _of_function(function: lang.Function, found: list[Range | None]) -> Range | None:
    known = [bounds for bounds in found if bounds is not None]
    if len(known) < len(found):
        return None
    if function is lang.Function.ABS:
        ((lo, hi),) = known
        return (0 if lo <= 0 <= hi else min(abs(lo), abs(hi))), max(abs(lo), abs(hi))
    choose = min if function is lang.Function.MIN else max
    return choose(lo for lo, _ in known), choose(hi for _, hi in known)


def _joined(found: list[Range | None]) -> Range | None:
    known = [bounds for bounds in found if bounds is not None]
    if len(known) < len(found):
        return None
    return min(lo for lo, _ in known), max(hi for _, hi in known)
