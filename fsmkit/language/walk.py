"""Visit or change every part of an expression."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import assert_never

from fsmkit.language.tree import (
    Apply,
    Binary,
    Call,
    Conditional,
    Convert,
    Element,
    EventField,
    EventName,
    Expr,
    InState,
    Invalid,
    Literal,
    Member,
    Unary,
    Variable,
)


def parts(expr: Expr) -> tuple[Expr, ...]:
    """Return the direct parts of an expression."""
    match expr:
        case Literal() | Variable() | EventField() | EventName() | InState() | Invalid():
            return ()
        case Unary(operand=operand) | Convert(operand=operand):
            return (operand,)
        case Binary(left=left, right=right):
            return (left, right)
        case Conditional(test, then, otherwise):
            return (test, then, otherwise)
        case Element(array, index):
            return (array, index)
        case Member(record):
            return (record,)
        case Apply(arguments=arguments) | Call(arguments=arguments):
            return arguments
        case _:
            assert_never(expr)


def subexpressions(expr: Expr) -> Iterator[Expr]:
    """Return an expression and all its parts."""
    yield expr
    for part in parts(expr):
        yield from subexpressions(part)


def calls(expr: Expr) -> bool:
    """Whether evaluating calls an operation of the host."""
    return any(isinstance(part, Call) for part in subexpressions(expr))


def root(location: Expr) -> Variable:
    """Return the variable that a location is, or is a part of."""
    while not isinstance(location, Variable):
        assert isinstance(location, Element | Member)  # noqa: S101
        location = location.array if isinstance(location, Element) else location.record
    return location


def with_parts(expr: Expr, change: Callable[[Expr], Expr]) -> Expr:
    """Return an expression each direct part of which is changed; arrays stay the variables."""
    match expr:
        case Literal() | Variable() | EventField() | EventName() | InState() | Invalid():
            return expr
        case Unary(_, operand) | Convert(operand):
            return replace(expr, operand=change(operand))
        case Binary(_, left, right):
            return replace(expr, left=change(left), right=change(right))
        case Conditional(test, then, otherwise):
            return replace(expr, test=change(test), then=change(then), otherwise=change(otherwise))
        case Element(_, index):
            return replace(expr, index=change(index))
        case Member(record):
            return replace(expr, record=change(record))
        case Apply(_, arguments) | Call(_, arguments):
            return replace(expr, arguments=tuple(map(change, arguments)))
        case _:
            assert_never(expr)


def rebuilt(expr: Expr, change: Callable[[Expr], Expr | None]) -> Expr:
    """Return an expression in which what ``change`` gives stands for the nodes it gives it for."""
    changed = change(expr)
    if changed is not None:
        return changed
    return with_parts(expr, lambda part: rebuilt(part, change))
