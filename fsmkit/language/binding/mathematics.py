"""``min``, ``max``, ``abs``, and ``Math`` of ECMAScript where it is exact (ECMA-262, 21.3.2).

With constant arguments, every function below is evaluated at compile time. With variables, only
functions with an exact integer result are supported, so no machine needs a floating-point library.
"""

# mypy: disable-error-code="func-returns-value"
# (`return context.report(...)` reports and returns None)

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fsmkit.language import tree
from fsmkit.language.arithmetic import exact, representable
from fsmkit.language.folding import fold
from fsmkit.language.operators import (
    describe_type,
    type_apply,
    type_binary,
    type_conditional,
    type_unary,
)
from fsmkit.language.syntax import CallNode
from fsmkit.language.types import BOOL, FLOAT64, FloatType, IntType

if TYPE_CHECKING:
    from fsmkit.diagnostics import Span
    from fsmkit.language.binding.binder import Binder
    from fsmkit.language.names import Context

ROUNDING = ("floor", "ceil", "round", "trunc")
MATH = (*ROUNDING, "sign", "pow", *(function.value for function in tree.Function))
"""The supported names of ``Math``."""
MOST_FACTORS = 8
"""The greatest exponent that is expanded to a product."""
LARGEST_EXACT = 2**53
"""A float holds every whole number below it."""


def apply(binder: Binder, node: CallNode, function: tree.Function) -> tree.Expr | None:
    """Type a call of a function of the language."""
    arguments = _arguments(binder, node)
    if arguments is None:
        return None
    return type_apply(binder.context, function, arguments, binder.span(node))


def bind_math(binder: Binder, node: CallNode, name: str) -> tree.Expr | None:
    """Type a call of a function of ``Math``."""
    span = binder.span(node)
    if name in ROUNDING and len(node.arguments) == 1:
        quotient = binder.quotient(node.arguments[0])
        if isinstance(quotient, tree.Binary):
            found = _rounded_quotient(binder, quotient, name, span)
            if found is not None:
                return found
    arguments = _arguments(binder, node)
    if arguments is None:
        return None
    known = _constant(name, arguments, span)
    if known is not None:
        return known
    if name in (function.value for function in tree.Function):
        return type_apply(binder.context, tree.Function(name), arguments, span)
    if name == "pow":
        return _power(binder, arguments, span)
    if len(arguments) == 1 and isinstance(arguments[0].type, IntType):
        return arguments[0] if name in ROUNDING else _sign(binder, arguments[0], span)
    what = describe_type(arguments[0].type) if len(arguments) == 1 else f"{len(arguments)} operands"
    return binder.context.report(
        "outside-language",
        f"`Math.{name}` of {what} is outside the language",
        span,
        "declare an operation",
    )


def _arguments(binder: Binder, node: CallNode) -> tuple[tree.Expr, ...] | None:
    found = [binder.value(argument) for argument in node.arguments]
    values = tuple(value for value in found if value is not None)
    return values if len(values) == len(found) else None


# --- constant arguments ---------------------------------------------------------------------------


def _constant(name: str, arguments: tuple[tree.Expr, ...], span: Span) -> tree.Literal | None:
    """Return the value of a function of constants; None if it is not a finite number."""
    values: list[int | float] = []
    for argument in arguments:
        known = fold(argument)
        if not isinstance(known, tree.Literal) or not isinstance(known.type, IntType | FloatType):
            return None
        assert isinstance(known.value, int | float)  # noqa: S101
        values.append(known.value)
    try:
        value = evaluate(name, values)
    except (ArithmeticError, ValueError):  # NaN in ECMAScript, or infinite
        return None
    if value is None or not math.isfinite(value):
        return None
    is_whole = value == math.trunc(value) and abs(value) < LARGEST_EXACT
    if isinstance(value, float) and not is_whole:
        return tree.Literal(value, FLOAT64, span)
    type_ = exact(int(value), int(value))
    return tree.Literal(int(value), type_, span) if representable(type_) else None


def evaluate(name: str, values: list[int | float]) -> int | float | None:
    """Return the value of a function of ``Math``; None if it takes other operands.

    ``round`` rounds halves up (ECMA-262, 21.3.2.28), unlike Python's.
    """
    match name, values:
        case "floor", [x]:
            return math.floor(x)
        case "ceil", [x]:
            return math.ceil(x)
        case "trunc", [x]:
            return math.trunc(x)
        case "round", [x]:
            below = math.floor(x)
            return below + (x - below >= 0.5)
        case "sign", [x]:
            return (x > 0) - (x < 0)
        case "abs", [x]:
            return abs(x)
        case "min", [_, *_]:
            return min(values)
        case "max", [_, *_]:
            return max(values)
        case "pow", [int(x), int(n)] if n >= 0 and abs(x) ** min(n, 64) < LARGEST_EXACT:
            return x**n if n <= 64 or abs(x) <= 1 else math.pow(x, n)
        case "pow", [x, y]:
            return math.pow(x, y)
        case _:
            return None


# --- arguments known at run time ------------------------------------------------------------------


def _rounded_quotient(
    binder: Binder, quotient: tree.Binary, name: str, span: Span
) -> tree.Expr | None:
    """Type a rounded ``a / b`` of integers: the truncated quotient, plus or minus one where needed.

    The remainder ``r`` has the sign of ``a``. Floor is one less if ``r`` is not 0 and has the other
    sign than ``b``. Ceil is one more if ``r`` is not 0 and has the sign of ``b``. Round adds one to
    the floor if the remainder of the floor is at least half of ``b``. No operand is doubled, so
    nothing overflows.
    """
    left, right = quotient.left, quotient.right
    assert isinstance(left.type, IntType)  # noqa: S101
    assert isinstance(right.type, IntType)  # noqa: S101
    if name == "trunc" or (name == "floor" and min(left.type.lo, right.type.lo) >= 0):
        return quotient
    if _calls(left) or _calls(right):
        return None
    typed = _Typed(binder.context, span)
    zero, one = typed.number(0), typed.number(1)
    rest = typed(tree.BinaryOp.REM, left, right)
    is_inexact = typed(tree.BinaryOp.NE, rest, zero)
    is_negative = typed(tree.BinaryOp.LT, right, zero)
    differs = typed(tree.BinaryOp.NE, typed(tree.BinaryOp.LT, rest, zero), is_negative)
    is_low = typed(tree.BinaryOp.AND, is_inexact, differs)
    if name == "ceil":
        is_high = typed(
            tree.BinaryOp.AND, is_inexact, typed(tree.BinaryOp.EQ, differs, typed.false)
        )
        return typed(tree.BinaryOp.ADD, quotient, typed.chosen(is_high, one, zero))
    if name == "floor":
        return typed(tree.BinaryOp.SUB, quotient, typed.chosen(is_low, one, zero))
    rest = typed.chosen(is_low, typed(tree.BinaryOp.ADD, rest, right), rest)
    other = typed(tree.BinaryOp.SUB, right, rest)
    is_half = typed.chosen(
        is_negative, typed(tree.BinaryOp.LE, rest, other), typed(tree.BinaryOp.GE, rest, other)
    )
    up = typed(tree.BinaryOp.SUB, typed.chosen(is_half, one, zero), typed.chosen(is_low, one, zero))
    return typed(tree.BinaryOp.ADD, quotient, up)


@dataclass(frozen=True, slots=True)
class _Typed:
    """Builds typed expressions at one location. An operand None gives None."""

    context: Context
    span: Span

    def __call__(
        self, op: tree.BinaryOp, left: tree.Expr | None, right: tree.Expr | None
    ) -> tree.Expr | None:
        if left is None or right is None:
            return None
        return type_binary(self.context, op, left, right, self.span)

    def chosen(
        self, test: tree.Expr | None, then: tree.Expr | None, otherwise: tree.Expr | None
    ) -> tree.Expr | None:
        """Return a conditional expression."""
        if test is None or then is None or otherwise is None:
            return None
        return type_conditional(self.context, test, then, otherwise, self.span)

    def number(self, value: int) -> tree.Literal:
        """Return a number literal."""
        return tree.Literal(value, exact(value, value), self.span)

    @property
    def false(self) -> tree.Literal:
        """Return the literal ``false``."""
        return tree.Literal(False, BOOL, self.span)


def _sign(binder: Binder, operand: tree.Expr, span: Span) -> tree.Expr | None:
    """Type ``Math.sign(n)`` of an integer.

    The result evaluates ``n`` twice, so ``n`` must not call.
    """
    if _calls(operand):
        return binder.context.report(
            "outside-language",
            "`Math.sign` of the result of an operation is outside the language",
            span,
            "store it in a variable first",
        )
    zero = tree.Literal(0, exact(0, 0), span)
    one = tree.Literal(1, exact(1, 1), span)
    context = binder.context
    is_low = type_binary(context, tree.BinaryOp.LT, operand, zero, span)
    is_high = type_binary(context, tree.BinaryOp.GT, operand, zero, span)
    minus = type_unary(context, tree.UnaryOp.NEGATE, one, span)
    if is_low is None or is_high is None or minus is None:
        return None
    below = type_conditional(context, is_low, minus, zero, span)
    return None if below is None else type_conditional(context, is_high, one, below, span)


def _calls(expr: tree.Expr) -> bool:
    match expr:
        case tree.Literal() | tree.Variable() | tree.EventField():
            return False
        case tree.Binary(left=left, right=right):
            return _calls(left) or _calls(right)
        case _:
            return True


def _power(binder: Binder, values: tuple[tree.Expr, ...], span: Span) -> tree.Expr | None:
    """Type ``Math.pow(x, 3)`` as ``x * x * x``; an integer stays an integer, as with ``*``."""
    match values:
        case (
            (tree.Variable() | tree.Literal() | tree.EventField()) as base,
            tree.Literal(value=int(exponent)),
        ) if 1 <= exponent <= MOST_FACTORS:
            product: tree.Expr | None = base
            for _ in range(exponent - 1):
                if product is not None:
                    product = type_binary(binder.context, tree.BinaryOp.MUL, product, base, span)
            return product
        case _:
            return binder.context.report(
                "outside-language",
                "this power is outside the language",
                span,
                f"raise a variable to a constant of 1 to {MOST_FACTORS}, or declare an operation",
            )
