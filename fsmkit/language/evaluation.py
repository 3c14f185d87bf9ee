"""The meaning of expressions: the reference every target is compared with."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, assert_never

from fsmkit.language.arithmetic import compute, wrapped
from fsmkit.language.conversion import rounded, within
from fsmkit.language.environment import ContentError, Environment, RangeFault
from fsmkit.language.statements.tree import Assign, ForEach, If, Local, Return
from fsmkit.language.tree import (
    Apply,
    Binary,
    BinaryOp,
    Call,
    CallFunction,
    Checked,
    Conditional,
    Convert,
    Decided,
    Element,
    EventField,
    EventName,
    EventType,
    Expr,
    Function,
    FunctionBody,
    InState,
    Invalid,
    Literal,
    Location,
    Member,
    Numbers,
    Unary,
    UnaryOp,
    Variable,
    Watched,
)
from fsmkit.language.types import (
    INT64,
    DurationType,
    EnumType,
    FloatType,
    IntType,
    Overflow,
    RecordType,
    Type,
    Value,
)
from fsmkit.language.walk import root


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
        case CallFunction(function, arguments):
            return call(function, [evaluate(a, env) for a in arguments], env)
        case Checked(operand, _, otherwise=otherwise):
            return _checked(expr, evaluate(operand, env), otherwise)
        case EventType():
            return env.event_type()
        case EventName():
            return env.event_name()
        case Invalid(reason):
            raise ContentError(reason)
        case Watched(operand) | Decided(operand):
            return evaluate(operand, env)
        case _:
            assert_never(expr)


def _checked(expr: Checked, value: Value, otherwise: Literal | None) -> Value:
    if isinstance(expr.type, EnumType):
        if value in expr.type.numbers:
            return value
        reason = f"{value} is the number of no member of `{expr.type.name}`"
    else:
        number = _number(value)
        if math.isfinite(number) and int(number) in INT64:
            return int(number)
        reason = f"{value} has no whole part within int64"
    if otherwise is None:
        raise ContentError(reason)
    return otherwise.value


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


# --- functions of the chart -----------------------------------------------------------------------


@dataclass(slots=True)
class _Frame:
    """The machine as the body of a function sees it: with the variables of the body."""

    outer: Environment
    values: dict[str, Value]

    def variable(self, name: str) -> Value:
        return self.values[name] if name in self.values else self.outer.variable(name)

    def event_field(self, name: str) -> Value:
        return self.outer.event_field(name)

    def event_name(self) -> str:
        return self.outer.event_name()

    def event_type(self) -> str:
        return self.outer.event_type()

    def is_in(self, state: int) -> bool:
        return self.outer.is_in(state)

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        return self.outer.call(operation, arguments)

    def range_error(self) -> None:
        self.outer.range_error()


def call(function: FunctionBody, arguments: list[Value], env: Environment) -> Value:
    """Return the result of a function of the chart."""
    names = (parameter.name for parameter in function.parameters)
    frame = _Frame(env, dict(zip(names, arguments, strict=True)))
    result = _run(function.body, frame)
    assert result is not None, function.name  # noqa: S101  (every way returns)
    return result


def _run(body: tuple[Any, ...], frame: _Frame) -> Value | None:
    """Execute statements; return the value that they return, None where they go on."""
    for statement in body:
        match statement:
            case Local(place, value) if value is not None:
                frame.values[place.name] = evaluate(value, frame)
            case Assign(location, value):
                new, name = evaluate(value, frame), root(location).name
                frame.values[name] = store(frame.variable(name), location, new, frame)
            case If(branches):
                for branch in branches:
                    if branch.condition is None or evaluate(branch.condition, frame):
                        result = _run(branch.body, frame)
                        if result is not None:
                            return result
                        break
            case ForEach():
                for item, index in rounds(statement, frame):
                    frame.values[statement.item.name] = item
                    if statement.index is not None:
                        frame.values[statement.index.name] = index
                    result = _run(statement.body, frame)
                    if result is not None:
                        return result
            case Return(value):
                return evaluate(value, frame)
            case _:
                raise AssertionError(statement)
    return None


def rounds_of(loop: ForEach[Any, Any, Any]) -> int:
    """Return how often the body of a loop is executed."""
    array = loop.array
    return len(array.numbers) if isinstance(array, Numbers) else int(array.type.length)


def rounds(loop: ForEach[Any, Any, Any], env: Environment) -> Iterator[tuple[Value, int]]:
    """Yield what a loop assigns in each round: an element of a copy of the array, its position."""
    array = loop.array
    if isinstance(array, Numbers):
        yield from zip(array.numbers, range(len(array.numbers)), strict=True)
    else:
        values = _elements(evaluate(array, env))
        yield from zip(values, range(len(values)), strict=True)
