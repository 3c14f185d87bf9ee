"""From text to the typed tree: names bound, every node given its type and place."""

# mypy: disable-error-code="func-returns-value"
# (`return context.report(...)` reports and gives up)

from __future__ import annotations

import re
from collections.abc import Set as AbstractSet
from dataclasses import replace

from fsmkit.diagnostics import Findings, Severity, Text
from fsmkit.diagnostics.fixes import instead
from fsmkit.language.arithmetic import exact
from fsmkit.language.binding import Binder
from fsmkit.language.conversion import bounds, can_convert, convert, filled, whole
from fsmkit.language.durations import duration_of
from fsmkit.language.ecmascript import truth
from fsmkit.language.folding import fold
from fsmkit.language.format import spell
from fsmkit.language.names import Context
from fsmkit.language.operators import compared, described, type_binary
from fsmkit.language.placing import detached, placed
from fsmkit.language.scope import Scope
from fsmkit.language.syntax import CallNode, MemberNode, NameNode, Node, SyntaxFault, changed, parse
from fsmkit.language.tree import (
    Binary,
    BinaryOp,
    Call,
    Convert,
    Element,
    EventField,
    Expr,
    Literal,
    Location,
    Member,
    Storage,
    Variable,
)
from fsmkit.language.types import (
    BOOL,
    DURATION,
    SYMBOL,
    ArrayType,
    BoolType,
    DurationType,
    EnumType,
    FloatType,
    IntType,
    Overflow,
    RecordType,
    SymbolType,
    Type,
    Value,
)


def type_expression(
    text: Text,
    scope: Scope,
    findings: Findings,
    expected: Type | None = None,
    *,
    hint: Type | None = None,
) -> Expr | None:
    """Read and type an expression; with ``expected`` it is converted to exactly that type.

    With ``hint`` only a bare member of an enumeration is one of that type.

    None where something is wrong: then there is at least one finding, with its place.
    """
    context = Context(scope, findings)
    try:
        expr = _bound(text, context, expected or hint)
        if expr is None or expected is None:
            return expr if expr is None or _has_value(context, expr) else None
        return fit(context, expr, expected)
    except RecursionError:  # the tree is bounded, what stands above this call is not
        return context.report("expression-too-deep", "the expression nests too deeply", text)


def type_truth(text: Text, scope: Scope, findings: Findings) -> Expr | None:
    """Read and type a condition: in ECMAScript every value counts as true or false (SCXML B.2)."""
    context = Context(scope, findings)
    if not context.is_ecmascript:
        return type_expression(text, scope, findings, BOOL)
    expr = type_expression(text, scope, findings)
    return None if expr is None else fit(context, truth(expr), BOOL)


def type_location(text: Text, scope: Scope, findings: Findings) -> Location | None:
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
    root: Expr = expr
    while isinstance(root, Member | Element):
        root = root.record if isinstance(root, Member) else root.array
    if not isinstance(root, Variable) or not isinstance(expr, Variable | Element | Member):
        what = "the payload of an event" if isinstance(root, EventField) else "this"
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
    if root.storage is Storage.INPUT:
        return context.report(
            "assigned-input",
            f"`{root.name}` is an input: only the host writes it",
            text,
            "declare it under `data` or `outputs`",
        )
    return expr


def type_call(text: Text, scope: Scope, findings: Findings) -> Call | None:
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
    expr = Binder(context, text).bind(node, None)
    if expr is None or isinstance(expr, Call):
        return expr
    return context.report(
        "statement-syntax", "only an operation can be called for its effect", text
    )


def type_update(
    location: Location, operator: str, value: Text, scope: Scope, findings: Findings
) -> Expr | None:
    """Type the value of ``location operator= value``, converted to the location's type."""
    context = Context(scope, findings)
    right = _bound(value, context, location.type)
    if right is None or not _has_value(context, right):
        return None
    result = type_binary(context, BinaryOp(operator), location, right, value.span)
    return None if result is None else fit(context, result, location.type)


def _bound(
    text: Text, context: Context, hint: Type | None = None, *, is_location: bool = False
) -> Expr | None:
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


def _bound_here(text: Text, context: Context, hint: Type | None, is_location: bool) -> Expr | None:
    node = _parsed(text, context, is_location=is_location)
    return None if node is None else Binder(context, text).bind(node, hint)


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
        fixes = instead(span, "==") if is_equals else ()
        return context.report(fault.rule, fault.message, span, fault.advice, fixes=fixes)


def _has_value(context: Context, expr: Expr) -> bool:
    if expr.type is not None:
        return True
    assert isinstance(expr, Call)  # noqa: S101
    context.report(
        "no-result",
        f"`{expr.operation}` returns nothing",
        expr.span,
        f"declare its result: `{expr.operation}(...) -> bool`",
    )
    return False


def fit(context: Context, expr: Expr, expected: Type) -> Expr | None:
    """Return an expression converted to the type that is expected where it stands."""
    if not _has_value(context, expr):
        return None
    source = expr.type
    assert source is not None  # noqa: S101
    if isinstance(expected, ArrayType):
        return _fit_array(context, expr, source, expected)
    if isinstance(expected, DurationType) and isinstance(expr, Literal) and context.is_ecmascript:
        return _duration_literal(context, expr)
    if not can_convert(source, expected):
        return context.report(
            "type-mismatch",
            f"{described(source)} where {described(expected)} is expected",
            expr.span,
            _way_out(source, expected, expr),
        )
    if isinstance(expected, IntType):
        if context.is_ecmascript and isinstance(source, FloatType) and not _is_whole(expr):
            return _truncation(context, expr, expected)
        if not _may_fit(context, expr, expected):
            return None
    return convert(expr, expected)


def _may_fit(context: Context, expr: Expr, expected: IntType) -> bool:
    """Report a value that is sure to be outside a type that does not wrap; False for a literal."""
    source = expr.type
    lo, hi, overflow = bounds(expected)
    if overflow is Overflow.WRAP or not isinstance(source, IntType):
        return True
    if source.lo <= hi and source.hi >= lo:
        return True
    is_literal = isinstance(expr, Literal)
    context.report(
        "value-out-of-range",
        f"{described(source)} is never within `{expected}`",
        expr.span,
        f"keep it within {lo}..{hi}, or widen the range",
        Severity.ERROR if is_literal else Severity.WARNING,
    )
    return not is_literal


def _fit_array(context: Context, expr: Expr, source: Type, expected: ArrayType) -> Expr | None:
    if source == expected:
        return expr
    if isinstance(expr, Literal) and not isinstance(source, ArrayType):
        item = _constant(context, expr, expected.element)
        if item is None:
            return None
        return Literal(filled(item.value, expected.length), expected, expr.span)
    if isinstance(expr, Literal) and isinstance(source, ArrayType):
        assert isinstance(expr.value, tuple)  # noqa: S101
        if source.length != expected.length:
            message = f"{source.length} elements where `{expected}` is expected"
            advice = f"give {expected.length}, or one value for all"
            return context.report("type-mismatch", message, expr.span, advice)
        values = []
        for value in expr.value:
            part = Literal(value, _own_type(value, source.element), expr.span)
            item = _constant(context, part, expected.element)
            if item is None:
                return None
            values.append(item.value)
        return Literal(tuple(values), expected, expr.span)
    return context.report(
        "type-mismatch", f"{described(source)} where {described(expected)} is expected", expr.span
    )


def _constant(context: Context, expr: Literal, type_: Type) -> Literal | None:
    """Return a constant as a value of a type, reporting one that storing would change."""
    before = len(context.findings)
    fitted = fit(context, expr, type_)
    folded = None if fitted is None else fold(fitted)
    if isinstance(folded, Literal):
        return folded
    if len(context.findings) == before:
        message = f"{spell(expr)} is no value of `{type_}`"
        context.report("type-mismatch", message, expr.span)
    return None


def _own_type(value: Value, type_: Type) -> Type:
    """Return the type of an element of a constant array, as if it stood alone."""
    return exact(value, value) if isinstance(type_, IntType) and isinstance(value, int) else type_


def _duration_literal(context: Context, expr: Literal) -> Expr | None:
    """Read a constant of ECMAScript as a delay: a string with a unit, or milliseconds."""
    if expr.type == DURATION:
        return expr
    ticks = None
    if expr.type == SYMBOL or isinstance(expr.type, IntType | FloatType):
        ticks = duration_of(context, str(expr.value), expr.span)
    else:
        context.report("type-mismatch", f"{described(expr.type)} is no duration", expr.span)
    return None if ticks is None else Literal(ticks, DURATION, expr.span)


def _way_out(source: Type, expected: Type, expr: Expr) -> str | None:
    match source, expected:
        case (IntType(), BoolType()) if isinstance(expr, Literal) and expr.value in (0, 1):
            return f"write `{str(bool(expr.value)).lower()}`"
        case (_, EnumType(name, members)):
            return f"write a member, such as `{name}.{members[0]}`" if members else None
        case (IntType() | FloatType(), DurationType()):
            return "give the number a unit, such as `500ms`"
        case (IntType() | FloatType(), BoolType()):
            return "write the comparison that is meant, such as `!= 0`"
        case (BoolType(), IntType() | FloatType()):
            return "write `1 if ... else 0`"
        case (DurationType(), IntType() | FloatType()):
            return "divide it by a duration, such as `/ 1ms`, to get a number"
        case (EnumType(), BoolType()):
            return compared(source)
        case (EnumType(), IntType() | FloatType()):
            return "write its number: `int(...)`"
        case (SymbolType(), IntType() | FloatType() | BoolType() | DurationType()):
            return "write the value without quotes"
        case (_, RecordType(_, fields)) if fields:
            return f"assign its fields one by one, such as `{fields[0].name}`"
        case (ArrayType(), _):
            return "take an element: `[0]`"
        case _:
            return f"give it a value of {described(expected)}"


def _is_whole(expr: Expr) -> bool:
    """Whether a constant is a whole number, so that storing it as an integer loses nothing."""
    if not isinstance(expr, Literal) or not isinstance(expr.value, float):
        return False
    return abs(expr.value) < 2**53 and expr.value == whole(expr.value, 0, 0)


def _truncation(context: Context, expr: Expr, expected: IntType) -> None:
    if _divides_somewhere(expr):
        message = f"the quotient may not be whole, as `{expected}` must be"
    else:
        message = f"the number may not be whole, as `{expected}` must be"
    context.report(
        "inexact-division",
        message,
        expr.span,
        "use a float, write `Math.trunc(...)`, or declare an operation",
    )


def _divides_somewhere(expr: Expr) -> bool:
    match expr:
        case Binary(op, left, right):
            return op is BinaryOp.DIV or _divides_somewhere(left) or _divides_somewhere(right)
        case Convert(operand):
            return _divides_somewhere(operand)
        case _:
            return False


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
