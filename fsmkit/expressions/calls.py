"""Calls: ``In``, the functions of the language, and the operations of the host."""

# mypy: disable-error-code="func-returns-value"
# (`return context.report(...)` reports and gives up)

from __future__ import annotations

from typing import TYPE_CHECKING

from fsmkit.expressions.arithmetic import exact
from fsmkit.expressions.names import suggestion
from fsmkit.expressions.operators import described, type_apply, type_binary
from fsmkit.expressions.scope import Signature
from fsmkit.expressions.syntax import CallNode, MemberNode, NameNode, StringNode
from fsmkit.expressions.tree import (
    Binary,
    BinaryOp,
    Call,
    EventField,
    Expr,
    Function,
    InState,
    Literal,
    Variable,
)
from fsmkit.expressions.types import ArrayType, IntType

if TYPE_CHECKING:
    from fsmkit.expressions.binding import Binder

BUILT_IN = ("In", "len", *(function.value for function in Function))


def bind_call(binder: Binder, node: CallNode) -> Expr | None:
    """Type a call."""
    scope = binder.context.scope
    match node.callee:
        case NameNode(name=name) if name in scope.operations:
            return _operation(binder, node, name, scope.operations[name])
        case NameNode(name="In"):
            return _in_state(binder, node)
        case NameNode(name="len"):
            return _length(binder, node)
        case NameNode(name="min" | "max" | "abs" as name):
            return _apply(binder, node, Function(name))
        case MemberNode(base=NameNode(name="Math"), name="min" | "max" | "abs" as name):
            return _apply(binder, node, Function(name))
        case MemberNode(base=NameNode(name="Math"), name="trunc" | "floor" as name):
            return _whole_quotient(binder, node, name)
        case MemberNode(base=NameNode(name="Math"), name="pow"):
            return _power(binder, node)
        case NameNode(name=name):
            known = (*scope.operations, *BUILT_IN)
            declare = f"declare it under `operations`: `{name}(...)`"
            return binder.context.report(
                "unknown-name",
                f"unknown operation `{name}`",
                binder.span(node.callee),
                suggestion(name, known, declare),
            )
        case _:
            return binder.context.report(
                "outside-language",
                f"`{binder.text.value[node.callee.start : node.callee.end]}` cannot be called",
                binder.span(node.callee),
                "declare an operation and call it",
            )


def _operation(binder: Binder, node: CallNode, name: str, signature: Signature) -> Expr | None:
    from fsmkit.expressions.typing import fit

    wanted = signature.parameters
    if len(wanted) != len(node.arguments):
        names = ", ".join(f"{p.name} {p.type}" for p in wanted)
        return binder.context.report(
            "wrong-arguments",
            f"`{name}` takes {len(wanted)} arguments, not {len(node.arguments)}",
            binder.span(node),
            f"it is declared as `{name}({names})`",
        )
    arguments = []
    for argument, parameter in zip(node.arguments, wanted, strict=True):
        expr = binder.value(argument, parameter.type)
        fitted = None if expr is None else fit(binder.context, expr, parameter.type)
        if fitted is not None:
            arguments.append(fitted)
    if len(arguments) < len(wanted):
        return None
    return Call(name, tuple(arguments), signature.result, binder.span(node))


def _in_state(binder: Binder, node: CallNode) -> Expr | None:
    states = binder.context.scope.states
    if len(node.arguments) != 1:
        message = f"`In` takes one state, not {len(node.arguments)}"
        return binder.context.report("wrong-arguments", message, binder.span(node))
    argument = node.arguments[0]
    # an id may hold `.` and `-`, which are operators anywhere else
    written = binder.text.value[argument.start : argument.end].strip()
    state = argument.value if isinstance(argument, StringNode) else written
    if state in states:
        return InState(states[state], state, binder.span(node))
    return binder.context.report(
        "unknown-name",
        f"unknown state `{state}`",
        binder.span(argument),
        suggestion(state, states, "name a state of this chart"),
    )


def _length(binder: Binder, node: CallNode) -> Expr | None:
    argument = binder.value(node.arguments[0]) if len(node.arguments) == 1 else None
    if argument is None and len(node.arguments) == 1:
        return None
    type_ = None if argument is None else argument.type
    if not isinstance(type_, ArrayType):
        message = "`len` takes one array"
        return binder.context.report("wrong-arguments", message, binder.span(node))
    return Literal(type_.length, exact(type_.length, type_.length), binder.span(node))


def _apply(binder: Binder, node: CallNode, function: Function) -> Expr | None:
    arguments = []
    for each in node.arguments:
        argument = binder.value(each)
        if argument is None:
            return None
        arguments.append(argument)
    return type_apply(binder.context, function, tuple(arguments), binder.span(node))


def _whole_quotient(binder: Binder, node: CallNode, name: str) -> Expr | None:
    """Type ``Math.trunc(a / b)``, and ``Math.floor(a / b)`` where nothing is negative."""
    quotient = binder.quotient(node.arguments[0]) if len(node.arguments) == 1 else None
    if isinstance(quotient, Binary) and (name == "trunc" or _is_never_negative(quotient)):
        return quotient
    if quotient is None and len(node.arguments) == 1:
        argument = binder.value(node.arguments[0])
        if argument is None or isinstance(argument.type, IntType):
            return argument
        what = described(argument.type)
    else:
        what = "a quotient that may be negative"
    return binder.context.report(
        "outside-language",
        f"`Math.{name}` of {what} is outside the language",
        binder.span(node),
        "declare an operation",
    )


def _is_never_negative(quotient: Binary) -> bool:
    return all(
        isinstance(side.type, IntType) and side.type.lo >= 0
        for side in (quotient.left, quotient.right)
    )


MOST_FACTORS = 8
"""The greatest exponent for which a power is written as a product."""


def _power(binder: Binder, node: CallNode) -> Expr | None:
    """Type ``Math.pow(x, 3)`` as ``x * x * x``: an integer stays one, as with ``*``."""
    values = [binder.value(argument) for argument in node.arguments]
    if any(value is None for value in values):
        return None
    match values:
        case [(Variable() | Literal() | EventField()) as base, Literal(value=int(exponent))] if (
            1 <= exponent <= MOST_FACTORS
        ):
            product: Expr | None = base
            for _ in range(exponent - 1):
                if product is not None:
                    span = binder.span(node)
                    product = type_binary(binder.context, BinaryOp.MUL, product, base, span)
            return product
        case _:
            return binder.context.report(
                "outside-language",
                "this power is outside the language",
                binder.span(node),
                f"raise a variable to a constant of 1 to {MOST_FACTORS}, or declare an operation",
            )
