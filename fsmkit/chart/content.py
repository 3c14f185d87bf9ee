"""Visit the content of a Chart: blocks, statements, expressions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import assert_never

from fsmkit.chart.chart import Chart
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
from fsmkit.language import (
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


def blocks(chart: Chart) -> Iterator[Block]:
    """Return every handler: of the script, the states, the transitions, the events."""
    yield chart.script
    for state in chart.states:
        yield from state.on_entry
        yield from state.on_exit
        yield from state.invokes
    for event in chart.events:
        if event.finalize:
            yield event.finalize
    for transition in chart.transitions:
        yield transition.content


def statements(block: Block) -> Iterator[Statement]:
    """Return the statements of a handler, those inside of others too."""
    for statement in block:
        yield statement
        match statement:
            case If(branches):
                for branch in branches:
                    yield from statements(branch.body)
            case ForEach(body=body):
                yield from statements(body)
            case _:
                pass


def all_statements(chart: Chart) -> Iterator[Statement]:
    """Return every statement of a chart."""
    for block in blocks(chart):
        yield from statements(block)


def conditions(chart: Chart) -> Iterator[Expr]:
    """Return every expression outside of content: guards and invariants."""
    for transition in chart.transitions:
        if transition.guard is not None:
            yield transition.guard
    for state in chart.states:
        if state.invariant is not None:
            yield state.invariant


def values(statement: Statement) -> tuple[Expr, ...]:
    """Return the expressions a statement evaluates itself, its bodies left aside.

    The variable that an assignment writes is not among them, but the indices in its location are.
    """
    match statement:
        case Assign(location, value):
            return (value, *_indices(location))
        case Raise(arguments=arguments) | Invoke(arguments=arguments):
            return arguments
        case Send(arguments=arguments, delay=delay):
            return arguments if delay is None else (*arguments, delay)
        case Log(values=logged):
            return logged
        case If(branches):
            return tuple(b.condition for b in branches if b.condition is not None)
        case ForEach(array=array):
            return (array,)
        case Reply(value):
            return (value,)
        case CallOperation(call):
            return (call,)
        case Cancel() | Fail():
            return ()
        case _:
            assert_never(statement)


def _indices(location: Expr) -> tuple[Expr, ...]:
    match location:
        case Element(array, index):
            return (index, *_indices(array))
        case Member(record):
            return _indices(record)
        case _:
            return ()


def subexpressions(expr: Expr) -> Iterator[Expr]:
    """Return an expression and all its parts."""
    yield expr
    for part in parts(expr):
        yield from subexpressions(part)


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
