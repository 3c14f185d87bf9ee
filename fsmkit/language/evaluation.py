"""The meaning of expressions: the reference for every target."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, assert_never

from fsmkit.language import tree, types
from fsmkit.language.arithmetic import compute, wrapped
from fsmkit.language.conversion import bring_within, round_float
from fsmkit.language.environment import ContentError, Environment, RangeFault
from fsmkit.language.statements.tree import Assign, ForEach, If, Local, Return
from fsmkit.language.walk import root


def evaluate(expr: tree.Expr, env: Environment) -> types.Value:
    """Return the value of an expression.

    Operands are evaluated from left to right. Raises `ContentError` for a division of integers by
    zero and an index out of range, `RangeFault` where a type's overflow is ``fault``.
    """
    match expr:
        case tree.Literal(value):
            return value
        case tree.Variable(name):
            return env.variable(name)
        case tree.Binary():
            return _binary(expr, env)
        case tree.Convert(operand, type_):
            return convert_value(evaluate(operand, env), type_, env)
        case tree.Unary(op, operand, type_):
            return _unary(op, evaluate(operand, env), type_)
        case tree.Conditional(test, then, otherwise):
            return evaluate(then if evaluate(test, env) else otherwise, env)
        case tree.EventField(name):
            return env.event_field(name)
        case tree.InState(state):
            return env.is_in(state)
        case tree.Element(array):
            values = _elements(env.variable(array.name))
            return values[checked_index(expr, len(values), env)]
        case tree.Member(record, name):
            return _elements(evaluate(record, env))[field_position(record.type, name)]
        case tree.Apply(function, arguments, type_):
            return _apply(function, [evaluate(a, env) for a in arguments], type_)
        case tree.Call(operation, arguments):
            result = env.call(operation, tuple(evaluate(a, env) for a in arguments))
            return False if result is None else result
        case tree.CallFunction(function, arguments):
            return call(function, [evaluate(a, env) for a in arguments], env)
        case tree.Checked(operand, _, otherwise=otherwise):
            return _checked(expr, evaluate(operand, env), otherwise)
        case tree.EventType():
            return env.event_type()
        case tree.EventName():
            return env.event_name()
        case tree.Invalid(reason):
            raise ContentError(reason)
        case tree.CoveredCondition(operand) | tree.CoveredGuard(operand):
            return evaluate(operand, env)
        case _:
            assert_never(expr)


def _checked(expr: tree.Checked, value: types.Value, otherwise: tree.Literal | None) -> types.Value:
    if isinstance(expr.type, types.EnumType):
        if value in expr.type.numbers:
            return value
        reason = f"{value} is the number of no member of `{expr.type.name}`"
    else:
        number = _number(value)
        if math.isfinite(number) and int(number) in types.INT64:
            return int(number)
        reason = f"{value} has no whole part within int64"
    if otherwise is None:
        raise ContentError(reason)
    return otherwise.value


def convert_value(value: types.Value, type_: types.Type, env: Environment) -> types.Value:
    """Return a value after storing it in a variable of `type_`."""
    match type_:
        case types.FloatType(bits):
            return round_float(_number(value), bits)
        case types.IntType() | types.DurationType():
            number, is_outside = bring_within(_plain(value), type_)
            if is_outside:
                if isinstance(type_, types.IntType) and type_.overflow is types.Overflow.FAULT:
                    raise RangeFault(f"{value} is outside {type_}")
                env.range_error()
            return number
        case _:
            return value


def store(
    old_root_value: types.Value, location: tree.Location, value: types.Value, env: Environment
) -> types.Value:
    """Return the new value of the whole variable after assigning a part of it.

    ``value`` already has the location's type. Raises `ContentError` for an index out of range.
    """
    match location:
        case tree.Variable():
            return value
        case tree.Element():
            values = _elements(old_root_value)
            at = checked_index(location, len(values), env)
            return (*values[:at], value, *values[at + 1 :])
        case tree.Member(record, name):
            assert isinstance(record, tree.Variable | tree.Element | tree.Member)  # noqa: S101
            values = _elements(_part(old_root_value, record, env))
            at = field_position(record.type, name)
            changed = (*values[:at], value, *values[at + 1 :])
            return store(old_root_value, record, changed, env)
        case _:
            assert_never(location)


def _part(root: types.Value, location: tree.Location, env: Environment) -> types.Value:
    match location:
        case tree.Variable():
            return root
        case tree.Element():
            values = _elements(root)
            return values[checked_index(location, len(values), env)]
        case tree.Member(record, name):
            assert isinstance(record, tree.Variable | tree.Element | tree.Member)  # noqa: S101
            return _elements(_part(root, record, env))[field_position(record.type, name)]
        case _:
            assert_never(location)


def checked_index(element: tree.Element, length: int, env: Environment) -> int:
    """Return the checked index of an element."""
    index = evaluate(element.index, env)
    if not isinstance(index, int) or not 0 <= index < length:
        raise ContentError(f"index {index} is outside `{element.array.name}`, 0..{length - 1}")
    return index


def field_position(type_: types.Type | None, name: str) -> int:
    """Return the position of a field in the tuple of its record."""
    assert isinstance(type_, types.RecordType)  # noqa: S101
    return next(i for i, field in enumerate(type_.fields) if field.name == name)


def _unary(op: tree.UnaryOp, value: types.Value, type_: types.Type) -> types.Value:
    match op:
        case tree.UnaryOp.NOT:
            return not value
        case tree.UnaryOp.NEGATE:
            return _reduce_precision(-_plain(value), type_)
        case tree.UnaryOp.INVERT:
            return _reduce_precision(~_integer(value), type_)
        case _:
            assert_never(op)


def _reduce_precision(value: float, type_: types.Type) -> float:
    if isinstance(type_, types.IntType) and type_.overflow is types.Overflow.WRAP:
        return wrapped(_integer(value), type_)
    return value


def _binary(expr: tree.Binary, env: Environment) -> types.Value:
    op, left = expr.op, evaluate(expr.left, env)
    if op is tree.BinaryOp.AND:
        return bool(left) and bool(evaluate(expr.right, env))
    if op is tree.BinaryOp.OR:
        return bool(left) or bool(evaluate(expr.right, env))
    right = evaluate(expr.right, env)
    match op:
        case tree.BinaryOp.EQ:
            return left == right
        case tree.BinaryOp.NE:
            return left != right
        case tree.BinaryOp.LT:
            return _plain(left) < _plain(right)
        case tree.BinaryOp.LE:
            return _plain(left) <= _plain(right)
        case tree.BinaryOp.GT:
            return _plain(left) > _plain(right)
        case tree.BinaryOp.GE:
            return _plain(left) >= _plain(right)
    if isinstance(expr.type, types.FloatType):
        return _float(op, _number(left), _number(right))
    assert isinstance(expr.type, types.IntType)  # noqa: S101
    if op in (tree.BinaryOp.DIV, tree.BinaryOp.REM) and right == 0:
        raise ContentError("division by zero")
    return compute(op, _integer(left), _integer(right), expr.type)


def _float(op: tree.BinaryOp, a: float, b: float) -> float:
    """Compute as IEEE 754 binary64 does, also where Python raises."""
    match op:
        case tree.BinaryOp.ADD:
            return a + b
        case tree.BinaryOp.SUB:
            return a - b
        case tree.BinaryOp.MUL:
            return a * b
        case tree.BinaryOp.DIV:
            if b != 0.0:
                return a / b
            if a == 0.0 or math.isnan(a):
                return math.nan
            return math.copysign(math.inf, math.copysign(1.0, a) * math.copysign(1.0, b))
        case _:
            raise ValueError(op)


def _apply(function: tree.Function, values: list[types.Value], type_: types.Type) -> types.Value:
    numbers = [_plain(value) for value in values]
    match function:
        # min(a, b) is (b < a) ? b : a, which defines NaN and -0.0; Python's agree
        case tree.Function.MIN:
            return min(numbers)
        case tree.Function.MAX:
            return max(numbers)
        case tree.Function.ABS:
            return _reduce_precision(abs(numbers[0]), type_)
        case _:
            assert_never(function)


def _plain(value: types.Value) -> float:
    assert isinstance(value, int | float)  # noqa: S101
    return value


def _integer(value: types.Value) -> int:
    assert isinstance(value, int)  # noqa: S101
    return value


def _number(value: types.Value) -> float:
    assert isinstance(value, int | float)  # noqa: S101
    return float(value)


def _elements(value: types.Value) -> tuple[types.Value, ...]:
    assert isinstance(value, tuple)  # noqa: S101
    return value


# --- functions of the chart -----------------------------------------------------------------------


@dataclass(slots=True)
class _Frame:
    """The machine as the body of a function sees it: with local variables."""

    outer: Environment
    values: dict[str, types.Value]

    def variable(self, name: str) -> types.Value:
        return self.values[name] if name in self.values else self.outer.variable(name)

    def event_field(self, name: str) -> types.Value:
        return self.outer.event_field(name)

    def event_name(self) -> str:
        return self.outer.event_name()

    def event_type(self) -> str:
        return self.outer.event_type()

    def is_in(self, state: int) -> bool:
        return self.outer.is_in(state)

    def call(self, operation: str, arguments: tuple[types.Value, ...]) -> types.Value | None:
        return self.outer.call(operation, arguments)

    def range_error(self) -> None:
        self.outer.range_error()


def call(
    function: tree.FunctionBody, arguments: list[types.Value], env: Environment
) -> types.Value:
    """Return the result of a function of the chart."""
    names = (parameter.name for parameter in function.parameters)
    frame = _Frame(env, dict(zip(names, arguments, strict=True)))
    result = _run(function.body, frame)
    assert result is not None, function.name  # noqa: S101  (every path returns)
    return result


def _run(body: tuple[Any, ...], frame: _Frame) -> types.Value | None:
    """Execute statements; return the value that they return, or None if none does."""
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
                for item, index in iterate(statement, frame):
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


def iteration_count(loop: ForEach[Any, Any, Any]) -> int:
    """Return the number of iterations of a loop."""
    array = loop.array
    return len(array.numbers) if isinstance(array, tree.Numbers) else int(array.type.length)


def iterate(loop: ForEach[Any, Any, Any], env: Environment) -> Iterator[tuple[types.Value, int]]:
    """Yield the element and the position of each iteration, over a copy of the array."""
    array = loop.array
    if isinstance(array, tree.Numbers):
        yield from zip(array.numbers, range(len(array.numbers)), strict=True)
    else:
        values = _elements(evaluate(array, env))
        yield from zip(values, range(len(values)), strict=True)
