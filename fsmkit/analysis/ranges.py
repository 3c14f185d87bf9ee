"""The least and the greatest value of an expression, where `min` and `max` bound it."""

from __future__ import annotations

from fsmkit.language import Apply, Conditional, Convert, Expr, Function, IntType, Literal


def range_of(expr: Expr) -> tuple[int, int] | None:
    """Return bounds of the values of an integer expression; None for any other."""
    match expr:
        case Literal(value) if isinstance(value, int):
            return int(value), int(value)
        case Apply(Function.MIN | Function.MAX as function, arguments):
            each = [range_of(argument) for argument in arguments]
            known = [bounds for bounds in each if bounds is not None]
            if len(known) < len(each):
                return _of_type(expr)
            choose = min if function is Function.MIN else max
            return choose(lo for lo, _ in known), choose(hi for _, hi in known)
        case Conditional(_, then, otherwise):
            one, other = range_of(then), range_of(otherwise)
            if one is None or other is None:
                return _of_type(expr)
            return min(one[0], other[0]), max(one[1], other[1])
        case Convert(operand):
            inner, outer = range_of(operand), _of_type(expr)
            if inner is None or outer is None:
                return outer
            fits = outer[0] <= inner[0] and inner[1] <= outer[1]
            return inner if fits else outer
        case _:
            return _of_type(expr)


def _of_type(expr: Expr) -> tuple[int, int] | None:
    return (expr.type.lo, expr.type.hi) if isinstance(expr.type, IntType) else None
