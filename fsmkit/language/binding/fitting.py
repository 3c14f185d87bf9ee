"""Conversion of expressions to the expected type, or rejection with advice."""

# mypy: disable-error-code="func-returns-value"
# (`return context.report(...)` reports and returns None)

from __future__ import annotations

from fsmkit.diagnostics import Severity
from fsmkit.language import tree, types
from fsmkit.language.arithmetic import exact
from fsmkit.language.conversion import bounds, can_convert, convert, fill_array, truncate
from fsmkit.language.durations import duration_of
from fsmkit.language.folding import fold
from fsmkit.language.format import format_expression
from fsmkit.language.names import Context
from fsmkit.language.operators import comparison_advice, describe_type


def has_value(context: Context, expr: tree.Expr) -> bool:
    """Report a call of an operation that returns nothing; True for all other expressions."""
    if expr.type is not None:
        return True
    assert isinstance(expr, tree.Call)  # noqa: S101
    context.report(
        "no-result",
        f"`{expr.operation}` returns nothing",
        expr.span,
        f"declare its result: `{expr.operation}(...) -> bool`",
    )
    return False


def fit(context: Context, expr: tree.Expr, expected: types.Type) -> tree.Expr | None:
    """Return an expression converted to the expected type, or None after reporting a mismatch."""
    if not has_value(context, expr):
        return None
    source = expr.type
    assert source is not None  # noqa: S101
    if isinstance(expected, types.ArrayType):
        return _fit_array(context, expr, source, expected)
    if (
        isinstance(expected, types.DurationType)
        and isinstance(expr, tree.Literal)
        and context.is_ecmascript
    ):
        return _duration_literal(context, expr)
    if not can_convert(source, expected):
        return context.report(
            "type-mismatch",
            f"{describe_type(source)} where {describe_type(expected)} is expected",
            expr.span,
            _conversion_advice(source, expected, expr),
        )
    if isinstance(expected, types.IntType):
        if context.is_ecmascript and isinstance(source, types.FloatType) and not _is_whole(expr):
            return _truncation(context, expr, expected)
        if not _may_fit(context, expr, expected):
            return None
    return convert(expr, expected)


def _may_fit(context: Context, expr: tree.Expr, expected: types.IntType) -> bool:
    """Report a value that is sure to be outside a type that does not wrap; False for a literal."""
    source = expr.type
    lo, hi, overflow = bounds(expected)
    if overflow is types.Overflow.WRAP or not isinstance(source, types.IntType):
        return True
    if source.lo <= hi and source.hi >= lo:
        return True
    is_literal = isinstance(expr, tree.Literal)
    context.report(
        "value-out-of-range",
        f"{describe_type(source)} is never within `{expected}`",
        expr.span,
        f"keep it within {lo}..{hi}, or widen the range",
        Severity.ERROR if is_literal else Severity.WARNING,
    )
    return not is_literal


def _fit_array(
    context: Context, expr: tree.Expr, source: types.Type, expected: types.ArrayType
) -> tree.Expr | None:
    if source == expected:
        return expr
    if isinstance(expr, tree.Literal) and not isinstance(source, types.ArrayType):
        item = _constant(context, expr, expected.element)
        if item is None:
            return None
        return tree.Literal(fill_array(item.value, expected.length), expected, expr.span)
    if isinstance(expr, tree.Literal) and isinstance(source, types.ArrayType):
        assert isinstance(expr.value, tuple)  # noqa: S101
        if source.length != expected.length:
            message = f"{source.length} elements where `{expected}` is expected"
            advice = f"give {expected.length}, or one value for all"
            return context.report("type-mismatch", message, expr.span, advice)
        values = []
        for value in expr.value:
            part = tree.Literal(value, _own_type(value, source.element), expr.span)
            item = _constant(context, part, expected.element)
            if item is None:
                return None
            values.append(item.value)
        return tree.Literal(tuple(values), expected, expr.span)
    return context.report(
        "type-mismatch",
        f"{describe_type(source)} where {describe_type(expected)} is expected",
        expr.span,
    )


def _constant(context: Context, expr: tree.Literal, type_: types.Type) -> tree.Literal | None:
    """Return a constant as a value of a type, reporting one that storing would change."""
    before = len(context.findings)
    fitted = fit(context, expr, type_)
    folded = None if fitted is None else fold(fitted)
    if isinstance(folded, tree.Literal):
        return folded
    if len(context.findings) == before:
        message = f"{format_expression(expr)} is not a value of `{type_}`"
        context.report("type-mismatch", message, expr.span)
    return None


def _own_type(value: types.Value, type_: types.Type) -> types.Type:
    """Return the type of an element of a constant array, as if it stood alone."""
    return (
        exact(value, value)
        if isinstance(type_, types.IntType) and isinstance(value, int)
        else type_
    )


def _duration_literal(context: Context, expr: tree.Literal) -> tree.Expr | None:
    """Read a constant of ECMAScript as a delay: a string with a unit, or milliseconds."""
    if expr.type == types.DURATION:
        return expr
    ticks = None
    if expr.type == types.SYMBOL or isinstance(expr.type, types.IntType | types.FloatType):
        ticks = duration_of(context, str(expr.value), expr.span)
    else:
        context.report("type-mismatch", f"{describe_type(expr.type)} is not a duration", expr.span)
    return None if ticks is None else tree.Literal(ticks, types.DURATION, expr.span)


def _conversion_advice(source: types.Type, expected: types.Type, expr: tree.Expr) -> str | None:
    match source, expected:
        case (types.IntType(), types.BoolType()) if isinstance(
            expr, tree.Literal
        ) and expr.value in (0, 1):
            return f"write `{str(bool(expr.value)).lower()}`"
        case (_, types.EnumType(name, members)):
            return f"write a member, such as `{name}.{members[0]}`" if members else None
        case (types.IntType() | types.FloatType(), types.DurationType()):
            return "give the number a unit, such as `500ms`"
        case (types.IntType() | types.FloatType(), types.BoolType()):
            return "write a comparison, such as `!= 0`"
        case (types.BoolType(), types.IntType() | types.FloatType()):
            return "write `1 if ... else 0`"
        case (types.DurationType(), types.IntType() | types.FloatType()):
            return "divide it by a duration, such as `/ 1ms`, to get a number"
        case (types.EnumType(), types.BoolType()):
            return comparison_advice(source)
        case (types.EnumType(), types.IntType() | types.FloatType()):
            return "write its number: `int(...)`"
        case (
            types.SymbolType(),
            types.IntType() | types.FloatType() | types.BoolType() | types.DurationType(),
        ):
            return "write the value without quotes"
        case (_, types.RecordType(_, fields)) if fields:
            return f"assign its fields one by one, such as `{fields[0].name}`"
        case (types.ArrayType(), _):
            return "take an element: `[0]`"
        case _:
            return f"give it a value of {describe_type(expected)}"


def _is_whole(expr: tree.Expr) -> bool:
    """Return whether a constant is a whole number, so that an integer stores it exactly."""
    if not isinstance(expr, tree.Literal) or not isinstance(expr.value, float):
        return False
    return abs(expr.value) < 2**53 and expr.value == truncate(expr.value, 0, 0)


def _truncation(context: Context, expr: tree.Expr, expected: types.IntType) -> None:
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


def _divides_somewhere(expr: tree.Expr) -> bool:
    match expr:
        case tree.Binary(op, left, right):
            return op is tree.BinaryOp.DIV or _divides_somewhere(left) or _divides_somewhere(right)
        case tree.Convert(operand):
            return _divides_somewhere(operand)
        case _:
            return False
