"""Between which values an expression lies: where a result cannot leave its type, nothing wraps."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from fsmkit.language import (
    LONGEST_DURATION,
    Binary,
    BinaryOp,
    BoolType,
    DurationType,
    EnumType,
    Expr,
    IntType,
    Literal,
    Type,
    Unary,
    UnaryOp,
)

Interval = tuple[int, int]


def of_type(type_: Type | None) -> Interval | None:
    """Return what values of a type lie between, None if they are no whole numbers."""
    match type_:
        case IntType(lo, hi):
            return lo, hi
        case BoolType():
            return 0, 1
        case EnumType(_, members):
            return 0, len(members) - 1
        case DurationType():
            return 0, LONGEST_DURATION
        case _:
            return None


def of(expr: Expr) -> Interval | None:
    """Return what the value of an expression lies between, after it is reduced to its type."""
    own = of_type(expr.type)
    if isinstance(expr, Literal) and isinstance(expr.value, int):
        return int(expr.value), int(expr.value)
    found = exact(expr)
    if own is None or found is None or not within(found, own):
        return own
    return found


def exact(expr: Expr) -> Interval | None:
    """Return what a sum, a product or the like lies between before it is reduced to its type."""
    match expr:
        case Unary(op=UnaryOp.NEGATE | UnaryOp.INVERT):
            operand = of(expr.operand)
            less = 1 if expr.op is UnaryOp.INVERT else 0
            return None if operand is None else (-operand[1] - less, -operand[0] - less)
        case Binary() if expr.op in RULES:
            left, right = of(expr.left), of(expr.right)
            return None if left is None or right is None else RULES[expr.op](left, right)
        case _:
            return None


def within(inner: Interval, outer: Interval) -> bool:
    """Whether an interval lies in another."""
    return outer[0] <= inner[0] and inner[1] <= outer[1]


def _product(a: Interval, b: Interval) -> Interval:
    corners = [x * y for x in a for y in b]
    return min(corners), max(corners)


def _and(a: Interval, b: Interval) -> Interval:
    """Of two numbers, the result is no greater than one that is not negative."""
    if a[0] >= 0 or b[0] >= 0:
        return 0, min(side[1] for side in (a, b) if side[0] >= 0)
    return _or(a, b)


def _or(a: Interval, b: Interval) -> Interval:
    width = max(abs(part).bit_length() for part in (*a, *b))
    return (0 if a[0] >= 0 and b[0] >= 0 else -(1 << width)), (1 << width) - 1


RULES: Mapping[BinaryOp, Callable[[Interval, Interval], Interval]] = {
    BinaryOp.ADD: lambda a, b: (a[0] + b[0], a[1] + b[1]),
    BinaryOp.SUB: lambda a, b: (a[0] - b[1], a[1] - b[0]),
    BinaryOp.MUL: _product,
    BinaryOp.BIT_AND: _and,
    BinaryOp.BIT_OR: _or,
    BinaryOp.BIT_XOR: _or,
    BinaryOp.SHIFT_RIGHT: lambda a, _: (min(a[0], 0), max(a[1], -1)),
}
