"""Typing of the expressions of a chart: values, conditions, locations and calls."""

# mypy: disable-error-code="func-returns-value"
# (`return context.report(...)` reports and returns None)

from __future__ import annotations

import re
from collections.abc import Set as AbstractSet
from dataclasses import replace

from fsmkit.diagnostics import Findings, Text
from fsmkit.diagnostics.fixes import replace_text
from fsmkit.language import tree
from fsmkit.language.binding.ecmascript import truth
from fsmkit.language.binding.expressions import ExpressionBinder
from fsmkit.language.binding.fitting import fit, has_value
from fsmkit.language.names import Context
from fsmkit.language.operators import type_binary
from fsmkit.language.relocation import detach, relocate
from fsmkit.language.scope import Scope
from fsmkit.language.syntax import (
    CallNode,
    MemberNode,
    NameNode,
    Node,
    SyntaxFault,
    map_leaves,
    parse,
)
from fsmkit.language.types import (
    BOOL,
    Type,
)


def type_expression(
    text: Text,
    scope: Scope,
    findings: Findings,
    expected: Type | None = None,
    *,
    hint: Type | None = None,
) -> tree.Expr | None:
    """Read and type an expression; with ``expected``, convert it to exactly that type.

    ``hint`` is the type of a bare enumeration member. Return None after at least one finding.
    """
    context = Context(scope, findings)
    try:
        expr = _bind(text, context, expected or hint)
        if expr is None or expected is None:
            return expr if expr is None or has_value(context, expr) else None
        return fit(context, expr, expected)
    except RecursionError:  # the tree is bounded, the stack of the caller is not
        return context.report("expression-too-deep", "the expression nests too deeply", text)


def type_truth(text: Text, scope: Scope, findings: Findings) -> tree.Expr | None:
    """Read and type a condition: in ECMAScript every value counts as true or false (SCXML B.2)."""
    context = Context(scope, findings)
    if not context.is_ecmascript:
        return type_expression(text, scope, findings, BOOL)
    expr = type_expression(text, scope, findings)
    return None if expr is None else fit(context, truth(expr), BOOL)


def type_location(text: Text, scope: Scope, findings: Findings) -> tree.Location | None:
    """Read and type the left side of an assignment: data or an output, or a part of one."""
    context = Context(scope, findings)
    first = FIRST.match(text.value)
    if first is not None and scope.copies and scope.is_copy(first[1]):
        return context.report(
            "assignment-into-copy",
            f"`{text}` belongs to a copy, and only the copy writes it",
            text,
            "send the copy an event, or bind the variable to one of this chart",
        )
    expr = _bind(text, context, is_location=True)
    if expr is None:
        return None
    root: tree.Expr = expr
    while isinstance(root, tree.Member | tree.Element):
        root = root.record if isinstance(root, tree.Member) else root.array
    if not isinstance(root, tree.Variable) or not isinstance(
        expr, tree.Variable | tree.Element | tree.Member
    ):
        what = "the payload of an event" if isinstance(root, tree.EventField) else "this"
        if text.value in scope.constants:
            what = f"`{text}` is a constant, and"
        return context.report(
            "not-assignable", f"{what} cannot be assigned", text, "assign data or an output"
        )
    if root.name in scope.fixed:
        return context.report(
            "not-assignable",
            f"`{root.name}` cannot be assigned: it names a value",
            text,
            "declare a variable: `var n 0..9 = 0`",
        )
    if root.storage is tree.Storage.INPUT:
        return context.report(
            "assigned-input",
            f"`{root.name}` is an input: only the host writes it",
            text,
            "declare it under `data` or `outputs`",
        )
    return expr


def type_call(text: Text, scope: Scope, findings: Findings) -> tree.Call | None:
    """Read and type a call of an operation for its effect."""
    context = Context(scope, findings)
    node = _parse(text, context)
    if node is None:
        return None
    if not isinstance(node, CallNode):
        return context.report(
            "statement-syntax",
            "this has no effect",
            text,
            "assign it to something, or call an operation",
        )
    expr = ExpressionBinder(context, text).bind(node, None)
    if expr is None or isinstance(expr, tree.Call):
        return expr
    return context.report(
        "statement-syntax", "only an operation can be called for its effect", text
    )


def type_update(
    location: tree.Location, operator: str, value: Text, scope: Scope, findings: Findings
) -> tree.Expr | None:
    """Type the value of ``location operator= value``, converted to the location's type."""
    context = Context(scope, findings)
    right = _bind(value, context, location.type)
    if right is None or not has_value(context, right):
        return None
    result = type_binary(context, tree.BinaryOp(operator), location, right, value.span)
    return None if result is None else fit(context, result, location.type)


def _bind(
    text: Text, context: Context, hint: Type | None = None, *, is_location: bool = False
) -> tree.Expr | None:
    """Read and bind an expression.

    A scope caches the result of each text, which is then relocated.
    """
    scope = context.scope
    if scope.super_guard is not None:  # a guard of another location
        return _bind_uncached(text, context, hint, is_location)
    key = text.value, hint, is_location
    if key not in scope.bound:
        attempt = Findings()
        expr = _bind_uncached(detach(text.value), Context(scope, attempt), hint, is_location)
        scope.bound[key] = expr, tuple(attempt)
    expr, reported = scope.bound[key]
    if reported:
        context.findings.extend(relocate(reported, text))
    return relocate(expr, text)


def _bind_uncached(
    text: Text, context: Context, hint: Type | None, is_location: bool
) -> tree.Expr | None:
    node = _parse(text, context, is_location=is_location)
    return None if node is None else ExpressionBinder(context, text).bind(node, hint)


def _parse(text: Text, context: Context, *, is_location: bool = False) -> Node | None:
    """Read an expression. In ECMAScript, operator words of fsmkit can be names."""
    names: AbstractSet[str] = frozenset()
    if context.is_ecmascript:
        names = OWN_WORDS if is_location else OWN_WORDS & context.scope.variables.keys()
    try:
        return parse_with_names(text.value, names)
    except SyntaxFault as fault:
        span = text.span_of(fault.start, fault.end)
        is_equals = text.value[fault.start : fault.end] == "="
        fixes = replace_text(span, "==") if is_equals else ()
        return context.report(fault.rule, fault.message, span, fault.advice, fixes=fixes)


FIRST = re.compile(r"\s*([^\W\d]\w*)\s*[.\[]")
"""The first of several names."""
OWN_WORDS = frozenset({"and", "or", "not", "True", "False"})
"""Operator words of fsmkit that are names in ECMAScript."""
OWN_WORD = re.compile(
    r"""("(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|(?<![\w$])(?:and|or|not|True|False)(?![\w$]))"""
)
"""One of these words, or a string, in which they are not replaced."""
MASKED = {word: "".join(chr(0xFEE0 + ord(letter)) for letter in word) for word in OWN_WORDS}
"""Replacements of the same length that the grammar always reads as names: full-width letters."""
UNMASKED = {masked: word for word, masked in MASKED.items()}


def parse_with_names(text: str, names: AbstractSet[str]) -> Node:
    """Read an expression in which some of `OWN_WORDS` are names, as ECMAScript permits."""
    own = names & OWN_WORDS
    pieces = OWN_WORD.split(text) if own else [text]
    masked = "".join(MASKED[piece] if piece in own else piece for piece in pieces)
    return parse(text) if masked == text else map_leaves(parse(masked), _unmask)


def _unmask(node: Node) -> Node:
    if isinstance(node, NameNode | MemberNode):
        return replace(node, name=UNMASKED.get(node.name, node.name))
    return node
