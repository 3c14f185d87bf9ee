"""The meaning of expressions: the reference every target is compared with."""

from __future__ import annotations

import math
from typing import assert_never

from fsmkit.language.arithmetic import compute, wrapped
from fsmkit.language.conversion import rounded, within
from fsmkit.language.environment import ContentError, Environment, RangeFault
from fsmkit.language.tree import (
    Apply,
    Binary,
    BinaryOp,
    Call,
    Conditional,
    Convert,
    Element,
    EventField,
    EventName,
    EventType,
    Expr,
    Function,
    InState,
    Invalid,
    Literal,
    Location,
    Member,
    Unary,
    UnaryOp,
    Variable,
)
from fsmkit.language.types import (
    DurationType,
    FloatType,
    IntType,
    Overflow,
    RecordType,
    Type,
    Value,
)


def evaluate(expr: Expr, env: Environment) -> Value:
    """Return the value of an expression.

    Operands are evaluated from left to right. Raises `ContentError` for a division of integers
    by zero and an index out of range, `RangeFault` where a type's overflow is ``fault``.
    """
    match expr:
        case Literal(value):
            return value
        case Variable(name):
            return env.variable(name)
        case Binary():
            return _binary(expr, env)
        case Convert(operand, type_):
            return converted(evaluate(operand, env), type_, env)
        case Unary(op, operand, type_):
            return _unary(op, evaluate(operand, env), type_)
        case Conditional(test, then, otherwise):
            return evaluate(then if evaluate(test, env) else otherwise, env)
        case EventField(name):
            return env.event_field(name)
        case InState(state):
            return env.is_in(state)
        case Element(array):
            values = _elements(env.variable(array.name))
            return values[position(expr, len(values), env)]
        case Member(record, name):
            return _elements(evaluate(record, env))[field_position(record.type, name)]
        case Apply(function, arguments, type_):
            return _apply(function, [evaluate(a, env) for a in arguments], type_)
        case Call(operation, arguments):
            result = env.call(operation, tuple(evaluate(a, env) for a in arguments))
            return False if result is None else result
        case EventType():
            return env.event_type()
        case EventName():
            return env.event_name()
        case Invalid(reason):
            raise ContentError(reason)
        case _:
            assert_never(expr)


def converted(value: Value, type_: Type, env: Environment) -> Value:
    """Return a value as storing it in a variable of the type changes it."""
    match type_:
        case FloatType(bits):
            return rounded(_number(value), bits)
        case IntType() | DurationType():
            number, is_outside = within(_plain(value), type_)
            if is_outside:
                if isinstance(type_, IntType) and type_.overflow is Overflow.FAULT:
                    raise RangeFault(f"{value} is outside {type_}")
                env.range_error()
            return number
        case _:
            return value


def store(old_root_value: Value, location: Location, value: Value, env: Environment) -> Value:
    """Return the new value of the whole variable that a location is part of.

    ``value`` has the location's type already. Raises `ContentError` for an index out of range.
    """
    match location:
        case Variable():
            return value
        case Element():
            values = _elements(old_root_value)
            at = position(location, len(values), env)
            return (*values[:at], value, *values[at + 1 :])
        case Member(record, name):
            assert isinstance(record, Variable | Element | Member)  # noqa: S101
            values = _elements(_part(old_root_value, record, env))
            at = field_position(record.type, name)
            changed = (*values[:at], value, *values[at + 1 :])
            return store(old_root_value, record, changed, env)
        case _:
            assert_never(location)


def _part(root: Value, location: Location, env: Environment) -> Value:
    match location:
        case Variable():
            return root
        case Element():
            values = _elements(root)
            return values[position(location, len(values), env)]
        case Member(record, name):
            assert isinstance(record, Variable | Element | Member)  # noqa: S101
            return _elements(_part(root, record, env))[field_position(record.type, name)]
        case _:
            assert_never(location)


def position(element: Element, length: int, env: Environment) -> int:
    """Return the checked index of an element."""
    index = evaluate(element.index, env)
    if not isinstance(index, int) or not 0 <= index < length:
        raise ContentError(f"index {index} is outside `{element.array.name}`, 0..{length - 1}")
    return index


def field_position(type_: Type | None, name: str) -> int:
    """Return where in the tuple of a record its field stands."""
    assert isinstance(type_, RecordType)  # noqa: S101
    return next(i for i, field in enumerate(type_.fields) if field.name == name)


def _unary(op: UnaryOp, value: Value, type_: Type) -> Value:
    match op:
        case UnaryOp.NOT:
            return not value
        case UnaryOp.NEGATE:
            return _reduced(-_plain(value), type_)
        case UnaryOp.INVERT:
            return _reduced(~_integer(value), type_)
        case _:
            assert_never(op)


def _reduced(value: float, type_: Type) -> float:
    if isinstance(type_, IntType) and type_.overflow is Overflow.WRAP:
        return wrapped(_integer(value), type_)
    return value


def _binary(expr: Binary, env: Environment) -> Value:
    op, left = expr.op, evaluate(expr.left, env)
    if op is BinaryOp.AND:
        return bool(left) and bool(evaluate(expr.right, env))
    if op is BinaryOp.OR:
        return bool(left) or bool(evaluate(expr.right, env))
    right = evaluate(expr.right, env)
    match op:
        case BinaryOp.EQ:
            return left == right
        case BinaryOp.NE:
            return left != right
        case BinaryOp.LT:
            return _plain(left) < _plain(right)
        case BinaryOp.LE:
            return _plain(left) <= _plain(right)
        case BinaryOp.GT:
            return _plain(left) > _plain(right)
        case BinaryOp.GE:
            return _plain(left) >= _plain(right)
    if isinstance(expr.type, FloatType):
        return _float(op, _number(left), _number(right))
    assert isinstance(expr.type, IntType)  # noqa: S101
    if op in (BinaryOp.DIV, BinaryOp.REM) and right == 0:
        raise ContentError("division by zero")
    return compute(op, _integer(left), _integer(right), expr.type)


def _float(op: BinaryOp, a: float, b: float) -> float:
    """Compute as IEEE 754 binary64 does, where Python raises instead."""
    match op:
        case BinaryOp.ADD:
            return a + b
        case BinaryOp.SUB:
            return a - b
        case BinaryOp.MUL:
            return a * b
        case BinaryOp.DIV:
            if b != 0.0:
                return a / b
            if a == 0.0 or math.isnan(a):
                return math.nan
            return math.copysign(math.inf, math.copysign(1.0, a) * math.copysign(1.0, b))
        case _:
            raise ValueError(op)


def _apply(function: Function, values: list[Value], type_: Type) -> Value:
    numbers = [_plain(value) for value in values]
    match function:
        # min(a, b) is (b < a) ? b : a, which says what NaN and -0.0 do; Python's are the same
        case Function.MIN:
            return min(numbers)
        case Function.MAX:
            return max(numbers)
        case Function.ABS:
            return _reduced(abs(numbers[0]), type_)
        case _:
            assert_never(function)


def _plain(value: Value) -> float:
    assert isinstance(value, int | float)  # noqa: S101
    return value


def _integer(value: Value) -> int:
    assert isinstance(value, int)  # noqa: S101
    return value


def _number(value: Value) -> float:
    assert isinstance(value, int | float)  # noqa: S101
    return float(value)


def _elements(value: Value) -> tuple[Value, ...]:
    assert isinstance(value, tuple)  # noqa: S101
    return value
