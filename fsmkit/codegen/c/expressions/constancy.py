"""Comparisons whose outcome is known when compiling: C compilers warn of them, rightly."""

from __future__ import annotations

import operator
from collections.abc import Callable

from fsmkit.codegen.c.expressions.types import interval
from fsmkit.language import (
    Apply,
    ArrayType,
    Binary,
    BinaryOp,
    BoolType,
    Call,
    Conditional,
    Convert,
    Element,
    Expr,
    FloatType,
    Literal,
    Member,
    RecordType,
    Type,
    Unary,
    Variable,
)

HOLDS: dict[BinaryOp, Callable[[int, int], bool]] = {
    BinaryOp.EQ: operator.eq,
    BinaryOp.NE: operator.ne,
    BinaryOp.LT: operator.lt,
    BinaryOp.LE: operator.le,
    BinaryOp.GT: operator.gt,
    BinaryOp.GE: operator.ge,
}
FLIPPED = {
    BinaryOp.LT: BinaryOp.GT,
    BinaryOp.LE: BinaryOp.GE,
    BinaryOp.GT: BinaryOp.LT,
    BinaryOp.GE: BinaryOp.LE,
}


def outcome(expr: Binary) -> bool | None:
    """Return what a comparison gives by the bounds of its operands; None if it depends.

    The operands must be free of effects, and of failure: they are not evaluated then.
    """
    if expr.op not in HOLDS or not _is_discrete(expr.left.type):
        return None
    if not _is_discrete(expr.right.type):
        return None
    if expr.left == expr.right and not _calls(expr.left):
        return HOLDS[expr.op](0, 0)
    a, b = interval(expr.left.type), interval(expr.right.type)
    if a.hi < b.lo:
        return HOLDS[expr.op](0, 1)
    if a.lo > b.hi:
        return HOLDS[expr.op](1, 0)
    if a.hi == b.lo and expr.op in (BinaryOp.LE, BinaryOp.GT):
        return expr.op is BinaryOp.LE
    if a.lo == b.hi and expr.op in (BinaryOp.GE, BinaryOp.LT):
        return expr.op is BinaryOp.GE
    return None


def joint_outcome(expr: Binary) -> bool | None:
    """Return what ``x < 2 && x > 5`` or ``x > 2 || x < 5`` gives; None if it depends."""
    left, right = _against_constant(expr.left), _against_constant(expr.right)
    if left is None or right is None or left[0] != right[0]:
        return None
    (_, op1, c1), (_, op2, c2) = left, right
    tried = [c + d for c in (c1, c2) for d in (-1, 0, 1)]  # between these nothing changes
    results = [(HOLDS[op1](x, c1), HOLDS[op2](x, c2)) for x in tried]
    if expr.op is BinaryOp.AND and not any(a and b for a, b in results):
        return False
    if expr.op is BinaryOp.OR and all(a or b for a, b in results):
        return True
    return None


def _against_constant(expr: Expr) -> tuple[Variable, BinaryOp, int] | None:
    match expr:
        case Binary(op, Variable() as variable, Literal(value)) if op in HOLDS:
            pass
        case Binary(op, Literal(value), Variable() as variable) if op in HOLDS:
            op = FLIPPED.get(op, op)
        case _:
            return None
    if not isinstance(value, int) or not _is_discrete(variable.type):
        return None
    return variable, op, value


def _is_discrete(type_: Type | None) -> bool:
    return type_ is not None and not isinstance(
        type_, FloatType | BoolType | ArrayType | RecordType
    )


def _calls(expr: Expr) -> bool:
    match expr:
        case Call():
            return True
        case Unary(_, operand) | Convert(operand):
            return _calls(operand)
        case Binary(_, left, right):
            return _calls(left) or _calls(right)
        case Conditional(test, then, otherwise):
            return any(map(_calls, (test, then, otherwise)))
        case Element(array, index):
            return _calls(index) or _calls(array)
        case Member(record):
            return _calls(record)
        case Apply(_, arguments):
            return any(map(_calls, arguments))
        case _:
            return False
