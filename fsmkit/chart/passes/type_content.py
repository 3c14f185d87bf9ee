"""Type executable content: from statements as written to those of a Chart."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import assert_never

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.chart.passes.context import Context, warn_not_evaluable
from fsmkit.chart.passes.type_events import failed_send, type_cancel, type_raise, type_send
from fsmkit.diagnostics import Findings, Severity, Text
from fsmkit.language.constants import is_list, split_list
from fsmkit.language.functions.local_variables import type_local, type_loop_head
from fsmkit.language.statements import tree as doc
from fsmkit.language.syntax import BinaryNode, SyntaxFault, parse


def type_block(block: doc.Block, context: Context) -> stmt.Block:
    """Return a handler, typed; a local name is known until the end of its block."""
    found: list[stmt.Statement] = []
    for written in block:
        if isinstance(written, doc.Local):
            local, scope = type_local(written, context.scope, context.findings)
            context = replace(context, scope=scope)
            found += [] if local is None else [local]
        else:
            found += type_statement(written, context)
    return tuple(found)


def type_statement(written: doc.WrittenStatement, context: Context) -> tuple[stmt.Statement, ...]:
    """Return the typed statements for a statement; none if it is wrong and the dialect strict."""
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
    warn_not_evaluable(reason, span, context.findings, errors[0].help)
    if isinstance(written, doc.DocSend):
        return failed_send(reason, written, context)
    return (stmt.Fail(reason, written.span),)


def type_condition(text: Text, context: Context) -> lang.Expr | None:
    """Return a condition; in a lenient dialect one that cannot be evaluated is `Invalid`."""
    return _lenient(lang.type_truth, text, lang.BOOL, context)


def type_value(text: Text, type_: lang.Type, context: Context) -> lang.Expr | None:
    """Return an expression; in a lenient dialect one that cannot be evaluated is `Invalid`."""

    def typed(text: Text, scope: lang.Scope, findings: Findings) -> lang.Expr | None:
        return lang.type_expression(text, scope, findings, type_)

    return _lenient(typed, text, type_, context)


def _lenient(
    read: Callable[[Text, lang.Scope, Findings], lang.Expr | None],
    text: Text,
    type_: lang.Type,
    context: Context,
) -> lang.Expr | None:
    if not context.lenient:
        return read(text, context.scope, context.findings)
    attempt = Findings()
    typed = read(text, context.scope, attempt)
    if typed is not None and not attempt.has_errors:
        context.findings.extend(attempt)
        return typed
    first = next(iter(attempt), None)
    reason = "it has no meaning" if first is None else first.message
    warn_not_evaluable(reason, text.span, context.findings, None if first is None else first.help)
    return lang.Invalid(reason, type_, text.span)


def _typed(written: doc.WrittenStatement, context: Context) -> tuple[stmt.Statement, ...]:
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
            return (stmt.Log("" if label is None else label.value, logged, span),)
        case doc.If():
            return (_if(written, context),)
        case doc.ForEach():
            return _foreach(written, context)
        case doc.Reply():
            return _reply(written, context)
        case doc.Return(_, span):
            findings.add(
                "outside-language",
                "`return` ends a function, but this content is not a function",
                span,
                help="assign the result to a variable",
            )
            return ()
        case doc.Local():
            raise AssertionError(written)  # its scope is the block, which types it
        case doc.CallOperation(call, span):
            operation = lang.type_call(call, context.scope, findings)
            return () if operation is None else (stmt.CallOperation(operation, span),)
        case doc.Super(span):
            findings.add(
                "super-without-base",
                "`super` represents the base's content, which is missing here",
                span,
                help="remove `super`: only a derived chart inherits content",
            )
            return ()
        case doc.Fail(reason, span, advice=advice):
            findings.add("unreadable-content", reason, span, help=advice)
            return ()
        case _:
            assert_never(written)


def _logged(text: Text, context: Context) -> tuple[lang.Expr, ...]:
    """Return the values of a log; omit a value without a type, with a warning.

    Each part of a joined string is a separate value.

    A log has no influence on the machine. Omitting ``'x is ' + x`` therefore changes less than
    raising ``error.execution``, which ECMAScript would not raise.
    """
    if not context.lenient:
        value = lang.type_expression(text, context.scope, context.findings)
        return () if value is None else (value,)
    if is_list(text):
        return tuple(v for part in split_list(text) for v in _logged(part, context))
    attempt = Findings()
    value = lang.type_expression(text, context.scope, attempt)
    if attempt.has_errors and all(d.rule.name == "outside-language" for d in attempt):
        parts = _joined(text)
        if parts:
            return tuple(value for part in parts for value in _logged(part, context))
        context.findings.add(
            "value-not-logged",
            f"this is not logged: {next(iter(attempt)).message}",
            text,
            help="log the parts one by one: a label and values",
        )
        return ()
    context.findings.extend(attempt)
    return () if value is None else (value,)


def _joined(text: Text) -> tuple[Text, ...]:
    """Return the two parts that a ``+`` joins; nothing for any other expression."""
    try:
        node = parse(text.value)
    except SyntaxFault:
        return ()
    if not isinstance(node, BinaryNode) or node.op != "+":
        return ()
    return tuple(text.part(part.start, part.end) for part in (node.left, node.right))


def _assign(written: doc.Assign[Text, Text], context: Context) -> tuple[stmt.Statement, ...]:
    location = lang.type_location(written.location, context.scope, context.findings)
    if location is None:
        return ()
    scope, findings = context.scope, context.findings
    if written.operator:
        typed = lang.type_update(location, written.operator, written.value, scope, findings)
    else:
        typed = lang.type_expression(written.value, scope, findings, location.type)
    return (
        ()
        if typed is None
        else (stmt.Assign(location, typed, written.span, sign=written.operator),)
    )


def _if(
    written: doc.If[Text, doc.WrittenStatement], context: Context
) -> stmt.If[lang.Expr, stmt.Statement]:
    branches: list[stmt.Branch[lang.Expr, stmt.Statement]] = []
    for branch in written.branches:
        condition: lang.Expr | None = None
        if branch.condition is not None:
            condition = type_condition(branch.condition, context)
            if condition is None:
                condition = lang.Literal(False, lang.BOOL, branch.condition.span)
        branches.append(stmt.Branch(condition, type_block(branch.body, context)))
    return stmt.If(tuple(branches), written.span)


def _foreach(
    written: doc.ForEach[Text, Text, doc.WrittenStatement], context: Context
) -> tuple[stmt.Statement, ...]:
    head = type_loop_head(written, context.scope, context.findings)
    if head is None:
        return ()
    body = type_block(written.body, replace(context, scope=head.scope))
    return (stmt.ForEach(head.array, head.item, head.index, body, written.span),)


def _reply(written: doc.Reply[Text], context: Context) -> tuple[stmt.Statement, ...]:
    kinds = list(dict.fromkeys(context.replies))
    if len(kinds) != 1:
        what = (
            "no event that can be current here is declared with an answer"
            if not kinds
            else "the events that can be current here have answers of different types"
        )
        context.findings.add(
            "reply-without-query",
            f"`reply` has nothing to answer: {what}",
            written.span,
            help="declare the event as `query() -> 0..3`, and reply in a transition on it",
        )
        return ()
    value = lang.type_expression(written.value, context.scope, context.findings, kinds[0])
    return () if value is None else (stmt.Reply(value, written.span),)
