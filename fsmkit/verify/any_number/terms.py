"""Evaluate index expressions for every number of machines at once.

A `Term` is ``position * m + length * n + constant``: ``m`` is the position of a machine in the
middle of its array, ``n`` the number of machines. Comparisons of terms have one result for all
machines far from both ends. `Ends` records how many machines at each end are not far enough.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import fsmkit.language as lang
from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.language import BinaryOp, Function, UnaryOp

COMPARISONS = frozenset(
    (BinaryOp.EQ, BinaryOp.NE, BinaryOp.LT, BinaryOp.LE, BinaryOp.GT, BinaryOp.GE)
)
MOST_WRAPS = 3
"""Times that a remainder subtracts its divisor."""


@dataclass(frozen=True, slots=True)
class Term:
    """A number that depends on the position of a machine and on the number of machines."""

    position: int = 0
    length: int = 0
    constant: int = 0

    @property
    def is_constant(self) -> bool:
        """Whether it is the same number for all machines and lengths."""
        return not self.position and not self.length

    def plus(self, other: Term, factor: int = 1) -> Term:
        """Return this term plus ``factor`` times another."""
        return Term(
            self.position + factor * other.position,
            self.length + factor * other.length,
            self.constant + factor * other.constant,
        )

    def at(self, position: int, length: int) -> int:
        """Return the number for a machine."""
        return self.position * position + self.length * length + self.constant


Known = Term | bool | str
"""A value of an index expression."""


class NotUniformError(Exception):
    """An expression whose value does not follow from the distance of a machine from the ends."""

    def __init__(self, message: str, span: Span) -> None:
        """Store the reason and the location."""
        super().__init__(message)
        self.span = span


@dataclass(slots=True)
class Ends:
    """The machines at each end that differ, as far as the compared terms have shown.

    ``low``: the first so many machines; ``high``: the last so many.
    ``length``: the least number of machines for which all comparisons are valid.
    """

    low: int = 0
    high: int = 0
    length: int = 2

    def sign(self, term: Term, span: Span) -> int:
        """Return the sign of a term, for machines that are in no end. Raises `NotUniformError`."""
        m, n, c = term.position, term.length, term.constant
        if not m and not n:
            return (c > 0) - (c < 0)
        if m < 0 or (m == 0 and n < 0):
            return -self.sign(Term(-m, -n, -c), span)
        if not m:
            self.length = max(self.length, -c // n + 1)
            return 1
        if n >= 0:  # positive if m * position + c is
            self.low = max(self.low, -c // m + 1 if c <= 0 else 0)
            return 1
        if n == -m:  # c - m * (length - position), and the difference is at least 1
            self.high = max(self.high, c // m)
            return -1
        if n < -m:  # less than c - length
            self.length = max(self.length, c)
            return -1
        raise NotUniformError("its value depends on the number of machines", span)

    def is_negative(self, term: Term, span: Span) -> bool:
        """Return whether a term is negative; needs smaller ends than `sign`."""
        if term.position > 0 and term.length >= 0:
            self.low = max(self.low, -(term.constant // term.position))
            return False
        return self.sign(term, span) < 0


def evaluate_term(expression: lang.Expr, variables: Mapping[str, Known], ends: Ends) -> Known:
    """Return the value of an expression. Raises `NotUniformError`."""
    match expression:
        case lang.Literal(value):
            return _literal(value, expression.span)
        case lang.Variable(name) if name in variables:
            return variables[name]
        case lang.Unary(op, operand):
            inner = evaluate_term(operand, variables, ends)
            if op is UnaryOp.NOT and isinstance(inner, bool):
                return not inner
            if op is UnaryOp.NEGATE and isinstance(inner, Term):
                return Term().plus(inner, -1)
        case lang.Binary(op, left, right):
            return _binary(
                op,
                evaluate_term(left, variables, ends),
                evaluate_term(right, variables, ends),
                ends,
                expression.span,
            )
        case lang.Conditional(test, then, otherwise):
            chosen = evaluate_term(test, variables, ends)
            if isinstance(chosen, bool):
                return evaluate_term(then if chosen else otherwise, variables, ends)
        case lang.Apply(Function.MIN | Function.MAX, arguments):
            return _extreme(expression, variables, ends, arguments)
        case _:
            pass
    raise NotUniformError("it is not a sum, a remainder or a comparison", expression.span)


def _literal(value: Any, span: Span) -> Known:
    if isinstance(value, bool | str):
        return value
    if isinstance(value, int):
        return Term(constant=value)
    raise NotUniformError("it is not a whole number", span)


def _binary(op: BinaryOp, left: Known, right: Known, ends: Ends, span: Span) -> Known:
    if isinstance(left, bool) and isinstance(right, bool):
        match op:
            case BinaryOp.AND:
                return left and right
            case BinaryOp.OR:
                return left or right
            case BinaryOp.EQ | BinaryOp.NE:
                return (left == right) == (op is BinaryOp.EQ)
            case _:
                pass
    if isinstance(left, Term) and isinstance(right, Term):
        if op in COMPARISONS:
            return _compared(op, left.plus(right, -1), ends, span)
        match op:
            case BinaryOp.ADD:
                return left.plus(right)
            case BinaryOp.SUB:
                return left.plus(right, -1)
            case BinaryOp.MUL if left.is_constant:
                return Term().plus(right, left.constant)
            case BinaryOp.MUL if right.is_constant:
                return Term().plus(left, right.constant)
            case BinaryOp.REM:
                return _remainder(left, right, ends, span)
            case _:
                pass
    raise NotUniformError(f"`{op.value}` has no common value for all numbers of machines", span)


def _compared(op: BinaryOp, difference: Term, ends: Ends, span: Span) -> bool:
    """Return the result of a comparison of two terms with that difference."""
    match op:
        case BinaryOp.LT | BinaryOp.GE:
            return ends.is_negative(difference, span) == (op is BinaryOp.LT)
        case BinaryOp.GT | BinaryOp.LE:
            opposite = Term().plus(difference, -1)
            return ends.is_negative(opposite, span) == (op is BinaryOp.GT)
        case _:
            return (ends.sign(difference, span) == 0) == (op is BinaryOp.EQ)


def _remainder(value: Term, divisor: Term, ends: Ends, span: Span) -> Term:
    """Return a remainder by the number of machines, or by a number near it."""
    if value.is_constant and divisor.is_constant and divisor.constant > 0 <= value.constant:
        return Term(constant=value.constant % divisor.constant)
    if divisor.position or divisor.length != 1:
        raise NotUniformError("a remainder is only taken by the number of machines", span)
    if ends.is_negative(value, span):
        raise NotUniformError("a remainder of a negative number", span)
    for _ in range(MOST_WRAPS):
        if ends.is_negative(value.plus(divisor, -1), span):
            return value
        value = value.plus(divisor, -1)
    raise NotUniformError("it is many times the number of machines", span)


def _extreme(
    expression: lang.Apply, variables: Mapping[str, Known], ends: Ends, arguments: Any
) -> Known:
    best: Term | None = None
    for argument in arguments:
        value = evaluate_term(argument, variables, ends)
        if not isinstance(value, Term):
            raise NotUniformError("it is not a number", expression.span)
        if best is None:
            best = value
            continue
        sign = ends.sign(value.plus(best, -1), expression.span)
        if sign < 0 if expression.function is Function.MIN else sign > 0:
            best = value
    assert best is not None  # noqa: S101  (it has operands)
    return best


def term_of(text: Text, variables: Mapping[str, Known], ends: Ends) -> Known:
    """Return the value of an expression in its source form. Raises `NotUniformError`."""
    types: dict[str, tuple[lang.Type, lang.Storage]] = {}
    for name, value in variables.items():
        type_: lang.Type = lang.INT32
        if isinstance(value, bool):
            type_ = lang.BOOL
        elif isinstance(value, str):
            type_ = lang.SYMBOL
        types[name] = (type_, lang.Storage.DATA)
    findings = Findings()
    expression = lang.type_expression(text, lang.Scope(variables=types), findings)
    if expression is None or findings.has_errors:
        raise NotUniformError("it uses other names than indices and constants", text.span)
    return evaluate_term(expression, variables, ends)
