"""What evaluating an expression or a statement may do besides its task."""

from __future__ import annotations

from typing import assert_never

from fsmkit.chart.statements import (
    Assign,
    Block,
    CallOperation,
    Cancel,
    Fail,
    ForEach,
    If,
    Invoke,
    Log,
    Raise,
    Reply,
    Send,
    Statement,
)
from fsmkit.codegen.c.expressions.types import interval
from fsmkit.language import (
    Apply,
    ArrayType,
    Binary,
    BinaryOp,
    Call,
    Conditional,
    Convert,
    DurationType,
    Element,
    Expr,
    FloatType,
    InState,
    IntType,
    Invalid,
    Literal,
    Member,
    Overflow,
    Storage,
    Unary,
    Variable,
)


def is_never_zero(expr: Expr) -> bool:
    """Whether a divisor is provably not 0 and not -1 of a value that could overflow."""
    span = interval(expr.type)
    if isinstance(expr, Literal):
        return expr.value not in (0, -1)
    return not span.lo <= 0 <= span.hi and not span.lo <= -1 <= span.hi


def parts(expr: Expr) -> tuple[Expr, ...]:
    """Return the operands of a node."""
    match expr:
        case Unary(_, operand) | Convert(operand):
            return (operand,)
        case Binary(_, left, right):
            return (left, right)
        case Conditional(test, then, otherwise):
            return (test, then, otherwise)
        case Element(array, index):
            return (array, index)
        case Member(record):
            return (record,)
        case Apply(_, arguments) | Call(_, arguments):
            return arguments
        case _:
            return ()


def can_fail(expr: Expr) -> bool:
    """Whether evaluating may end in an error of content or in a fault."""
    match expr:
        case Binary(BinaryOp.DIV | BinaryOp.REM, _, right, type_):
            own = not isinstance(type_, FloatType) and not is_never_zero(right)
        case Element(array, index):
            assert isinstance(array.type, ArrayType)  # noqa: S101
            span = interval(index.type)
            own = not 0 <= span.lo <= span.hi < array.type.length
        case Convert(type=IntType(overflow=Overflow.FAULT)) | Invalid():
            own = True
        case _:
            own = False
    return own or any(map(can_fail, parts(expr)))


def has_effect(expr: Expr) -> bool:
    """Whether evaluating calls the host or may raise ``error.range``."""
    match expr:
        case Call() | Convert(type=IntType(overflow=Overflow.SATURATE) | DurationType()):
            return True
        case _:
            return any(map(has_effect, parts(expr)))


def needs_order(left: Expr, right: Expr) -> bool:
    """Whether it can be told in which order two operands are evaluated."""

    def matters(expr: Expr) -> bool:
        return has_effect(expr) or can_fail(expr)

    return (has_effect(left) and matters(right)) or (matters(left) and has_effect(right))


def reads_input(expr: Expr) -> bool:
    """Whether the value depends on an input."""
    if isinstance(expr, Variable):
        return expr.storage is Storage.INPUT
    return any(map(reads_input, parts(expr)))


def observes(block: Block) -> bool:
    """Whether it can be told in the midst of a block which states are active.

    By ``In()``, and by the host, which content may call.
    """
    return not all(
        isinstance(statement, Assign)
        and not _asks(statement.location)
        and not _asks(statement.value)
        for statement in block
    )


def _asks(expr: Expr) -> bool:
    return (
        isinstance(expr, InState)
        or has_effect(expr)
        or can_fail(expr)
        or any(map(_asks, parts(expr)))
    )


def fails(statement: Statement) -> bool:
    """Whether a statement can end its block."""
    match statement:
        case Fail():
            return True
        case Assign(location, value):
            return can_fail(location) or can_fail(value)
        case Raise(_, arguments):
            return any(map(can_fail, arguments))
        case Send(_, arguments, delay=delay):
            negative = delay is not None and not isinstance(delay, Literal)
            return negative or any(map(can_fail, arguments))
        case Log(_, values):
            return any(map(can_fail, values))
        case If(branches):
            return any(
                (b.condition is not None and can_fail(b.condition)) or any(map(fails, b.body))
                for b in branches
            )
        case ForEach(body=body):
            return any(map(fails, body))
        case Reply(value):
            return can_fail(value)
        case CallOperation(call):
            return can_fail(call)
        case Cancel():
            return False
        case Invoke(_, arguments):
            return any(map(can_fail, arguments))
        case _:
            assert_never(statement)
