"""Constant folding: expressions are evaluated at compile time if nobody can observe it."""

from __future__ import annotations

from dataclasses import replace

from fsmkit.language import tree
from fsmkit.language.conversion import can_convert, convert
from fsmkit.language.environment import ContentError, RangeFault
from fsmkit.language.evaluation import evaluate
from fsmkit.language.types import IntType, Overflow, Type, Value
from fsmkit.language.walk import map_parts, parts

MOST_STATEMENTS = 20_000
"""At most this many statements of functions are executed at compile time."""


class _NotConstant(Exception):  # noqa: N818  (never leaves this module)
    """The evaluation read the machine, or would have an effect."""


class _NoMachine:
    """An environment without a machine."""

    def variable(self, name: str) -> Value:
        raise _NotConstant(name)

    def event_field(self, name: str) -> Value:
        raise _NotConstant(name)

    def event_name(self) -> str:
        raise _NotConstant

    def event_type(self) -> str:
        raise _NotConstant

    def is_in(self, state: int) -> bool:
        raise _NotConstant(state)

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:  # noqa: ARG002
        raise _NotConstant(operation)

    def range_error(self) -> None:
        raise _NotConstant


def fold(expr: tree.Expr) -> tree.Expr:
    """Return the expression with its constant parts evaluated.

    An evaluation that would raise ``error.execution`` or ``error.range`` stays, and so does every
    call, index and division with an observable effect.
    """
    match expr:
        case tree.CallFunction(function) if function.cost > MOST_STATEMENTS:
            return map_parts(expr, fold)
        case tree.Unary() | tree.Member() | tree.Apply() | tree.CallFunction() | tree.Checked():
            return _compute(map_parts(expr, fold))
        case tree.Binary():
            folded = map_parts(expr, fold)
            assert isinstance(folded, tree.Binary)  # noqa: S101
            return _binary(folded)
        case tree.Conditional(test, then, otherwise):
            folded = fold(test)
            if isinstance(folded, tree.Literal):
                return fold(then if folded.value else otherwise)
            return map_parts(expr, lambda part: folded if part is test else fold(part))
        case tree.Convert(operand, type_):
            inner = fold(operand)
            # an operand folded to a constant may provably fit now
            is_same = inner is operand and not isinstance(inner, tree.Literal)
            if is_same:
                return _compute(expr)
            is_number = inner.type is not None and not can_convert(inner.type, type_)
            is_number = is_number and isinstance(type_, IntType)
            return _compute(replace(expr, operand=inner) if is_number else convert(inner, type_))
        case _:
            return map_parts(expr, fold)


def fold_location(location: tree.Location) -> tree.Location:
    """Fold the index of the left side of an assignment."""
    folded = fold(location)
    assert isinstance(folded, tree.Variable | tree.Element | tree.Member)  # noqa: S101
    return folded


def _binary(expr: tree.Binary) -> tree.Expr:
    if isinstance(expr.left, tree.Literal):
        match expr.op, expr.left.value:
            case (tree.BinaryOp.AND, True) | (tree.BinaryOp.OR, False):
                return expr.right
            case (tree.BinaryOp.AND, False) | (tree.BinaryOp.OR, True):
                return replace(expr.left, span=expr.span)
    if isinstance(expr.right, tree.Literal):
        match expr.op, expr.right.value:
            case (tree.BinaryOp.AND, True) | (tree.BinaryOp.OR, False):
                return expr.left
    return _compute(expr)


def _compute(expr: tree.Expr) -> tree.Expr:
    if isinstance(expr, tree.Literal) or expr.type is None:
        return expr
    if not all(isinstance(part, tree.Literal) for part in parts(expr)):
        return expr
    try:
        value = evaluate(expr, _NoMachine())
    except (ContentError, RangeFault, _NotConstant):
        return expr
    return tree.Literal(value, _narrow(value, expr.type), expr.span)


def _narrow(value: Value, type_: Type) -> Type:
    """Return the type of a result; an exact interval narrows to the value."""
    if (
        isinstance(type_, IntType)
        and isinstance(value, int)
        and type_.overflow in (Overflow.SATURATE, Overflow.NEAREST)
    ):
        return IntType(value, value)
    return type_
