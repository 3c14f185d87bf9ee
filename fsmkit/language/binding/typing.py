"""From text to the typed tree: names bound, every node given its type and place."""

# mypy: disable-error-code="func-returns-value"
# (`return context.report(...)` reports and gives up)

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
from fsmkit.language.placing import detached, placed
from fsmkit.language.scope import Scope
from fsmkit.language.syntax import CallNode, MemberNode, NameNode, Node, SyntaxFault, changed, parse
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
    """Read and type an expression; with ``expected`` it is converted to exactly that type.

    With ``hint`` only a bare member of an enumeration is one of that type.

    None where something is wrong: then there is at least one finding, with its place.
    """
    context = Context(scope, findings)
    try:
        expr = _bound(text, context, expected or hint)
        if expr is None or expected is None:
            return expr if expr is None or has_value(context, expr) else None
        return fit(context, expr, expected)
    except RecursionError:  # the tree is bounded, what stands above this call is not
        return context.report("expression-too-deep", "the expression nests too deeply", text)


def type_truth(text: Text, scope: Scope, findings: Findings) -> tree.Expr | None:
    """Read and type a condition: in ECMAScript every value counts as true or false (SCXML B.2)."""
    context = Context(scope, findings)
    if not context.is_ecmascript:
        return type_expression(text, scope, findings, BOOL)
    expr = type_expression(text, scope, findings)
    return None if expr is None else fit(context, truth(expr), BOOL)


def type_location(text: Text, scope: Scope, findings: Findings) -> tree.Location | None:
    """Read and type what an assignment writes: data or an output, or a part of one."""
    context = Context(scope, findings)
    first = FIRST.match(text.value)
    if first is not None and scope.copies and scope.is_copy(first[1]):
        return context.report(
            "assignment-into-copy",
            f"`{text}` lies in a copy, and only the copy writes it",
            text,
            "send the copy an event, or bind the variable to one of this chart",
        )
    expr = _bound(text, context, is_location=True)
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
    node = _parsed(text, context)
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
    right = _bound(value, context, location.type)
    if right is None or not has_value(context, right):
        return None
    result = type_binary(context, tree.BinaryOp(operator), location, right, value.span)
    return None if result is None else fit(context, result, location.type)


def _bound(
    text: Text, context: Context, hint: Type | None = None, *, is_location: bool = False
) -> tree.Expr | None:
    """Read an expression and look its names up; a scope keeps each, to be placed anew."""
    scope = context.scope
    if scope.super_guard is not None:  # which has places of its own
        return _bound_here(text, context, hint, is_location)
    key = text.value, hint, is_location
    if key not in scope.bound:
        attempt = Findings()
        expr = _bound_here(detached(text.value), Context(scope, attempt), hint, is_location)
        scope.bound[key] = expr, tuple(attempt)
    expr, reported = scope.bound[key]
    if reported:
        context.findings.extend(placed(reported, text))
    return placed(expr, text)


def _bound_here(
    text: Text, context: Context, hint: Type | None, is_location: bool
) -> tree.Expr | None:
    node = _parsed(text, context, is_location=is_location)
    return None if node is None else ExpressionBinder(context, text).bind(node, hint)


def _parsed(text: Text, context: Context, *, is_location: bool = False) -> Node | None:
    """Read an expression; in ECMAScript our words are names in locations, and where declared."""
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
"""Words of this language that are names in ECMAScript."""
OWN_WORD = re.compile(
    r"""("(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|(?<![\w$])(?:and|or|not|True|False)(?![\w$]))"""
)
"""Such a word, or a string, in which none stands."""
MASKED = {word: "".join(chr(0xFEE0 + ord(letter)) for letter in word) for word in OWN_WORDS}
"""Names, as long, that the grammar takes for names everywhere: in letters of full width."""
UNMASKED = {masked: word for word, masked in MASKED.items()}


def parse_with_names(text: str, names: AbstractSet[str]) -> Node:
    """Read an expression in which some of `OWN_WORDS` are names, as in ECMAScript they may be."""
    own = names & OWN_WORDS
    pieces = OWN_WORD.split(text) if own else [text]
    masked = "".join(MASKED[piece] if piece in own else piece for piece in pieces)
    return parse(text) if masked == text else changed(parse(masked), _unmasked)


def _unmasked(node: Node) -> Node:
    if isinstance(node, NameNode | MemberNode):
        return replace(node, name=UNMASKED.get(node.name, node.name))
    return node
