"""Type executable content: from statements as written to those of a Chart."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import assert_never

from fsmkit.chart.passes.context import Context, warn_not_evaluable
from fsmkit.chart.passes.type_events import failed_send, type_cancel, type_raise, type_send
from fsmkit.chart.statements import (
    Assign,
    Block,
    Branch,
    CallOperation,
    Fail,
    ForEach,
    If,
    Log,
    Reply,
    Statement,
)
from fsmkit.diagnostics import Findings, Severity, Text
from fsmkit.language import (
    BOOL,
    ArrayType,
    Expr,
    IntType,
    Invalid,
    Literal,
    Scope,
    Type,
    Variable,
    type_call,
    type_expression,
    type_location,
    type_truth,
    type_update,
)
from fsmkit.language.constants import is_list, split_list
from fsmkit.language.statements import tree as doc


def type_block(block: doc.Block, context: Context) -> Block:
    """Return a handler, typed."""
    return tuple(s for written in block for s in type_statement(written, context))


def type_statement(written: doc.WrittenStatement, context: Context) -> tuple[Statement, ...]:
    """Return what a statement becomes; nothing where it is wrong and the dialect strict."""
    if not context.lenient:
        return _typed(written, context)
    attempt = Findings()
    typed = _typed(written, replace(context, findings=attempt))
    errors = [d for d in attempt if d.severity is Severity.ERROR]
    if not errors:
        context.findings.extend(attempt)
        return typed
    reason = errors[0].message
    span = errors[0].primary.span if errors[0].primary is not None else written.span
    warn_not_evaluable(reason, span, context.findings)
    if isinstance(written, doc.DocSend):
        return failed_send(reason, written, context)
    return (Fail(reason, written.span),)


def type_condition(text: Text, context: Context) -> Expr | None:
    """Return a condition; in a lenient dialect one that cannot be evaluated is `Invalid`."""
    return _lenient(type_truth, text, BOOL, context)


def type_value(text: Text, type_: Type, context: Context) -> Expr | None:
    """Return an expression; in a lenient dialect one that cannot be evaluated is `Invalid`."""

    def typed(text: Text, scope: Scope, findings: Findings) -> Expr | None:
        return type_expression(text, scope, findings, type_)

    return _lenient(typed, text, type_, context)


def _lenient(
    read: Callable[[Text, Scope, Findings], Expr | None], text: Text, type_: Type, context: Context
) -> Expr | None:
    if not context.lenient:
        return read(text, context.scope, context.findings)
    attempt = Findings()
    typed = read(text, context.scope, attempt)
    if typed is not None and not attempt.has_errors:
        context.findings.extend(attempt)
        return typed
    reason = next((d.message for d in attempt), "it has no meaning")
    warn_not_evaluable(reason, text.span, context.findings)
    return Invalid(reason, type_, text.span)


def _typed(written: doc.WrittenStatement, context: Context) -> tuple[Statement, ...]:
    findings = context.findings
    match written:
        case doc.Assign():
            return _assign(written, context)
        case doc.Raise():
            return type_raise(written, context)
        case doc.DocSend():
            return type_send(written, context)
        case doc.DocCancel():
            return type_cancel(written, context)
        case doc.Log(label, values, span):
            logged = tuple(v for text in values for v in _logged(text, context))
            return (Log("" if label is None else label.value, logged, span),)
        case doc.If():
            return (_if(written, context),)
        case doc.ForEach():
            return _for_each(written, context)
        case doc.Reply():
            return _reply(written, context)
        case doc.CallOperation(call, span):
            operation = type_call(call, context.scope, findings)
            return () if operation is None else (CallOperation(operation, span),)
        case doc.Super(span):
            findings.add(
                "super-without-base",
                "`super` stands for the base's content, and there is none here",
                span,
                help="remove `super`; only a derived chart has something to call so",
            )
            return ()
        case doc.Fail(reason, span):
            findings.add("unreadable-content", reason, span, help="mend it, or remove it")
            return ()
        case _:
            assert_never(written)


def _logged(text: Text, context: Context) -> tuple[Expr, ...]:
    """Return the values of a log; what has a meaning but no type is left out with a warning.

    A log has no influence on the machine, so that to leave out ``'x is ' + x`` changes less than
    ``error.execution``, which it would not be in ECMAScript.
    """
    if not context.lenient:
        value = type_expression(text, context.scope, context.findings)
        return () if value is None else (value,)
    if is_list(text):
        return tuple(v for part in split_list(text) for v in _logged(part, context))
    attempt = Findings()
    value = type_expression(text, context.scope, attempt)
    if attempt.has_errors and all(d.rule.name == "outside-language" for d in attempt):
        context.findings.add(
            "value-not-logged",
            f"this is not logged: {next(iter(attempt)).message}",
            text,
            help="log the parts one by one: a label and values",
        )
        return ()
    context.findings.extend(attempt)
    return () if value is None else (value,)


def _assign(written: doc.Assign[Text, Text], context: Context) -> tuple[Statement, ...]:
    location = type_location(written.location, context.scope, context.findings)
    if location is None:
        return ()
    scope, findings = context.scope, context.findings
    if written.operator:
        typed = type_update(location, written.operator, written.value, scope, findings)
    else:
        typed = type_expression(written.value, scope, findings, location.type)
    return () if typed is None else (Assign(location, typed, written.span),)


def _if(written: doc.If[Text, doc.WrittenStatement], context: Context) -> If[Expr, Statement]:
    branches: list[Branch[Expr, Statement]] = []
    for branch in written.branches:
        condition: Expr | None = None
        if branch.condition is not None:
            condition = type_condition(branch.condition, context)
            if condition is None:
                condition = Literal(False, BOOL, branch.condition.span)
        branches.append(Branch(condition, type_block(branch.body, context)))
    return If(tuple(branches), written.span)


def _for_each(
    written: doc.ForEach[Text, doc.WrittenStatement], context: Context
) -> tuple[Statement, ...]:
    array = type_expression(written.array, context.scope, context.findings)
    if array is None:
        return ()
    if not isinstance(array, Variable) or not isinstance(array.type, ArrayType):
        context.findings.add(
            "loop-variable-type",
            f"`{written.array}` is no array but {array.type}",
            written.array,
            help="iterate over a variable of a type such as `uint8[4]`",
        )
        return ()
    item = _variable(written.item, context)
    index = None if written.index is None else _variable(written.index, context)
    body = type_block(written.body, context)
    if item is None or (index is None and written.index is not None):
        return ()
    _check_loop(written, array.type, item, index, context)
    return (ForEach(array, item, index, body, written.span),)


def _check_loop(
    written: doc.ForEach[Text, doc.WrittenStatement],
    array: ArrayType,
    item: Variable,
    index: Variable | None,
    context: Context,
) -> None:
    if item.type != array.element:
        context.findings.add(
            "loop-variable-type",
            f"`{item.name}` is {item.type} and the elements are {array.element}",
            written.item,
            help=f"declare `{item.name}` as {array.element}",
        )
    last = array.length - 1
    if index is not None and not (
        isinstance(index.type, IntType) and 0 in index.type and last in index.type
    ):
        context.findings.add(
            "loop-variable-type",
            f"`{index.name}` is {index.type} and does not hold the positions 0..{last}",
            written.index,
            help=f"declare `{index.name}` as 0..{last}",
        )


def _variable(text: Text, context: Context) -> Variable | None:
    location = type_location(text, context.scope, context.findings)
    if location is None or isinstance(location, Variable):
        return location
    context.findings.add(
        "not-a-variable",
        f"`{text}` is part of a variable; a whole one is wanted here",
        text,
        help="name a variable",
    )
    return None


def _reply(written: doc.Reply[Text], context: Context) -> tuple[Statement, ...]:
    kinds = list(dict.fromkeys(context.replies))
    if len(kinds) != 1:
        what = (
            "no event that can be at hand here is declared with an answer"
            if not kinds
            else "the events that can be at hand here want answers of different types"
        )
        context.findings.add(
            "reply-without-query",
            f"`reply` has nothing to answer: {what}",
            written.span,
            help="declare the event as `query() -> 0..3`, and reply in a transition on it",
        )
        return ()
    value = type_expression(written.value, context.scope, context.findings, kinds[0])
    return () if value is None else (Reply(value, written.span),)
