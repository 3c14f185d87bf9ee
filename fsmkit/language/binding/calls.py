"""Calls: ``In``, the functions of the language, and the operations of the host."""

# mypy: disable-error-code="func-returns-value"
# (`return context.report(...)` reports and returns None)

from __future__ import annotations

from typing import TYPE_CHECKING

from fsmkit.diagnostics import Severity
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.language.arithmetic import exact
from fsmkit.language.binding.casts import bind_conversion, is_conversion
from fsmkit.language.binding.fitting import fit
from fsmkit.language.binding.mathematics import MATH, apply, bind_math
from fsmkit.language.copied_names import dotted
from fsmkit.language.scope import Signature
from fsmkit.language.syntax import CallNode, MemberNode, NameNode, StringNode
from fsmkit.language.tree import Call, CallFunction, Expr, Function, FunctionBody, InState, Literal
from fsmkit.language.types import BOOL, ArrayType, Field

if TYPE_CHECKING:
    from fsmkit.language.binding.binder import Binder

BUILT_IN = ("In", "len", *(function.value for function in Function))


def bind_call(binder: Binder, node: CallNode) -> Expr | None:
    """Type a call."""
    scope = binder.context.scope
    match node.callee:
        case NameNode(name=name) if name in scope.operations:
            return _operation(binder, node, name, scope.operations[name])
        case NameNode(name=name) if name in scope.functions:
            return _function(binder, node, scope.functions[name])
        case NameNode(name="In"):
            return _in_state(binder, node)
        case NameNode(name="len"):
            return _length(binder, node)
        case NameNode(name="min" | "max" | "abs" as name):
            return apply(binder, node, Function(name))
        case MemberNode(base=NameNode(name="Math"), name=name) if name in MATH:
            return bind_math(binder, node, name)
        case NameNode(name=name) if scope.dialect == "fsmkit" and is_conversion(scope, name):
            return bind_conversion(binder, node, name)
        case NameNode(name=name):
            known = (*scope.operations, *scope.functions, *BUILT_IN)
            declare = f"declare it under `operations`: `{name}(...)`"
            if name in scope.events:
                known, declare = (), f"`{name}` is an event: write `send {name}` or `raise {name}`"
            return binder.context.report(
                "unknown-name",
                f"unknown operation `{name}`",
                binder.span(node.callee),
                suggest(name, known, declare),
            )
        case _:
            return binder.context.report(
                "outside-language",
                f"`{binder.text.value[node.callee.start : node.callee.end]}` cannot be called",
                binder.span(node.callee),
                "declare an operation and call it",
            )


def _operation(binder: Binder, node: CallNode, name: str, signature: Signature) -> Expr | None:
    arguments = _fit_arguments(binder, node, name, signature.parameters)
    if arguments is None:
        return None
    return Call(name, arguments, signature.result, binder.span(node))


def _function(binder: Binder, node: CallNode, function: FunctionBody) -> Expr | None:
    parameters = tuple(Field(p.name, p.type) for p in function.parameters)
    arguments = _fit_arguments(binder, node, function.name, parameters)
    if arguments is None:
        return None
    return CallFunction(function, arguments, function.reads, function.result, binder.span(node))


def _fit_arguments(
    binder: Binder, node: CallNode, name: str, parameters: tuple[Field, ...]
) -> tuple[Expr, ...] | None:
    """Return the arguments of a call, converted to the types of the parameters."""
    if len(parameters) != len(node.arguments):
        names = ", ".join(f"{p.name} {p.type}" for p in parameters)
        return binder.context.report(
            "wrong-arguments",
            f"`{name}` takes {len(parameters)} arguments, not {len(node.arguments)}",
            binder.span(node),
            f"it is declared as `{name}({names})`",
        )
    arguments = []
    for argument, parameter in zip(node.arguments, parameters, strict=True):
        expr = binder.value(argument, parameter.type)
        fitted = None if expr is None else fit(binder.context, expr, parameter.type)
        if fitted is not None:
            arguments.append(fitted)
    return tuple(arguments) if len(arguments) == len(parameters) else None


def _in_state(binder: Binder, node: CallNode) -> Expr | None:
    """Type ``In(state)``. It is false for an unknown state and for a history.

    The configuration contains neither (SCXML 5.9.1 and 3.11: a history is a pseudo-state).
    """
    scope = binder.context.scope
    states = scope.states
    if len(node.arguments) != 1:
        message = f"`In` takes one state, not {len(node.arguments)}"
        advice = "write `In(a) or In(b)` for several states"
        return binder.context.report("wrong-arguments", message, binder.span(node), advice)
    argument = node.arguments[0]
    # an id may hold `.` and `-`, which are operators anywhere else
    written = binder.text.value[argument.start : argument.end].strip()
    state = argument.value if isinstance(argument, StringNode) else written
    if state not in states and scope.copies:
        state = dotted(state, scope.constants)
    if state in states:
        return InState(states[state], state, binder.span(node))
    is_loose = scope.dialect != "fsmkit"
    is_history = state in scope.histories
    advice = "name a state of this chart"
    if is_loose or is_history:
        advice = f"it is never active: {advice}"
    binder.context.report(
        "unknown-name",
        f"`{state}` is a history" if is_history else f"unknown state `{state}`",
        binder.span(argument),
        advice if is_history else suggest(state, states, advice),
        Severity.WARNING if is_loose else None,
    )
    return Literal(False, BOOL, binder.span(node)) if is_loose else None


def _length(binder: Binder, node: CallNode) -> Expr | None:
    argument = binder.value(node.arguments[0]) if len(node.arguments) == 1 else None
    if argument is None and len(node.arguments) == 1:
        return None
    type_ = None if argument is None else argument.type
    if not isinstance(type_, ArrayType):
        message, advice = "`len` takes one array", "name a variable of a type such as `0..9[3]`"
        return binder.context.report("wrong-arguments", message, binder.span(node), advice)
    return Literal(type_.length, exact(type_.length, type_.length), binder.span(node))
