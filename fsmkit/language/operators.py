"""Typing rules of operators and functions, one function each."""

# mypy: disable-error-code="func-returns-value"
# (`return context.report(...)` reports and returns None)

from __future__ import annotations

from dataclasses import replace

from fsmkit.diagnostics import Span
from fsmkit.language import tree, types
from fsmkit.language.arithmetic import (
    common_machine,
    exact,
    hull,
    interval,
    quotient,
    representable,
)
from fsmkit.language.conversion import convert
from fsmkit.language.format import format_expression
from fsmkit.language.names import Context

EQUALITY = (tree.BinaryOp.EQ, tree.BinaryOp.NE)
ORDER = (tree.BinaryOp.LT, tree.BinaryOp.LE, tree.BinaryOp.GT, tree.BinaryOp.GE)
LOGIC = (tree.BinaryOp.AND, tree.BinaryOp.OR)
BITS = (tree.BinaryOp.BIT_AND, tree.BinaryOp.BIT_OR, tree.BinaryOp.BIT_XOR)
SHIFTS = (tree.BinaryOp.SHIFT_LEFT, tree.BinaryOp.SHIFT_RIGHT)
TICKS = exact(0, types.LONGEST_DURATION)


def require_bool(context: Context, expr: tree.Expr, what: str) -> bool:
    """Report an expression that is not a truth value; ``what`` names its role in the message."""
    if expr.type == types.BOOL:
        return True
    advice = "compare it with something"
    if isinstance(expr.type, types.IntType | types.FloatType):
        advice = "write a comparison, such as `!= 0`"
    elif isinstance(expr.type, types.EnumType):
        advice = comparison_advice(expr.type)
    context.report(
        "type-mismatch", f"{what} is {describe_type(expr.type)}, not `bool`", expr.span, advice
    )
    return False


def comparison_advice(type_: types.EnumType) -> str:
    """Return the advice to compare with a member of an enumeration."""
    return f"compare it with a member: `== {type_.name}.{type_.members[0]}`"


def describe_type(type_: types.Type | None) -> str:
    """Describe a type, for messages."""
    match type_:
        case None:
            return "nothing"
        case types.IntType(lo, hi) if lo == hi:
            return f"the number {lo}"
        case types.SymbolType():
            return "a symbol"
        case _:
            return f"`{type_}`"


def type_unary(
    context: Context, op: tree.UnaryOp, operand: tree.Expr, span: Span
) -> tree.Expr | None:
    """Type a prefix operator."""
    type_ = operand.type
    if op is tree.UnaryOp.NOT:
        if not require_bool(context, operand, "the operand of `!`"):
            return None
        return tree.Unary(op, operand, types.BOOL, span)
    if isinstance(type_, types.FloatType) and op is tree.UnaryOp.NEGATE:
        if isinstance(operand, tree.Literal) and isinstance(operand.value, float):
            return tree.Literal(-operand.value, types.FLOAT64, span)
        return tree.Unary(op, operand, types.FLOAT64, span)
    if not isinstance(type_, types.IntType):
        message = f"`{op.value}` does not apply to {describe_type(type_)}"
        advice = "apply it to a number"
        if isinstance(type_, types.DurationType):
            advice = "a duration is never negative: remove the sign"
        return context.report("type-mismatch", message, span, advice)
    if (
        op is tree.UnaryOp.NEGATE
        and isinstance(operand, tree.Literal)
        and isinstance(operand.value, int)
    ):
        result = exact(-operand.value, -operand.value)
        literal = tree.Literal(-operand.value, result, span)
        return literal if representable(result) else _too_wide(context, result, span)
    if type_.is_machine:
        machine = common_machine(type_)
        assert machine is not None  # noqa: S101
        return tree.Unary(op, operand, machine, span)
    negated = exact(-type_.hi, -type_.lo)
    result = negated if op is tree.UnaryOp.NEGATE else exact(negated.lo - 1, negated.hi - 1)
    if not representable(result):
        return _too_wide(context, result, span)
    return tree.Unary(op, operand, result, span)


def type_binary(
    context: Context, op: tree.BinaryOp, left: tree.Expr, right: tree.Expr, span: Span
) -> tree.Expr | None:
    """Type an infix operator. Operands of mixed kinds are converted to a common type."""
    a, b = left.type, right.type
    if op in LOGIC:
        operand = f"operand of `{op.value}`"
        is_left = require_bool(context, left, f"the left {operand}")
        is_right = require_bool(context, right, f"the right {operand}")
        return tree.Binary(op, left, right, types.BOOL, span) if is_left and is_right else None
    if op in EQUALITY or op in ORDER:
        return _comparison(context, op, left, right, span)
    if isinstance(a, types.DurationType) or isinstance(b, types.DurationType):
        return _duration_arithmetic(context, op, left, right, span)
    if not isinstance(a, types.IntType | types.FloatType) or not isinstance(
        b, types.IntType | types.FloatType
    ):
        return _report_operands(context, op, left, right, span)
    if isinstance(a, types.FloatType) or isinstance(b, types.FloatType):
        if op not in (tree.BinaryOp.ADD, tree.BinaryOp.SUB, tree.BinaryOp.MUL, tree.BinaryOp.DIV):
            message = f"`{op.value}` does not apply to floating-point numbers"
            return context.report("type-mismatch", message, span, "declare an operation for it")
        return tree.Binary(
            op, convert(left, types.FLOAT64), convert(right, types.FLOAT64), types.FLOAT64, span
        )
    if context.is_ecmascript:
        if op is tree.BinaryOp.DIV and not _divides(left, right):
            # the quotient of ECMAScript is not an integer
            return tree.Binary(
                op, convert(left, types.FLOAT64), convert(right, types.FLOAT64), types.FLOAT64, span
            )
        if op in BITS or op in SHIFTS:
            return _ecmascript_bits(context, op, left, right, span)
    return integers(context, op, left, right, span)


def integers(
    context: Context, op: tree.BinaryOp, left: tree.Expr, right: tree.Expr, span: Span
) -> tree.Expr | None:
    """Type an arithmetic operator of integers, with the meaning of C."""
    a, b = left.type, right.type
    assert isinstance(a, types.IntType)  # noqa: S101
    assert isinstance(b, types.IntType)  # noqa: S101
    if op in (tree.BinaryOp.DIV, tree.BinaryOp.REM) and b.lo == b.hi == 0:
        return context.report(
            "division-by-zero", "the divisor is always 0", right.span, "divide by something else"
        )
    if op in SHIFTS:
        result = None if a.is_machine else interval(op, a, b)
        if result is None or not representable(result):
            result = common_machine(a)
    elif a.is_machine or b.is_machine:
        result = common_machine(a, b)
        if result is None:
            return context.report(
                "integer-too-wide",
                f"no machine integer holds both `{a}` and `{b}`",
                span,
                "store one of them in an `int64` first",
            )
    else:
        result = interval(op, a, b)
    assert result is not None  # noqa: S101
    if not representable(result):
        return _too_wide(context, result, span)
    return tree.Binary(op, left, right, result, span)


def _too_wide(context: Context, type_: types.IntType, span: Span) -> None:
    return context.report(
        "integer-too-wide",
        f"the result lies in {type_.lo}..{type_.hi}, beyond 64 bits",
        span,
        "narrow the ranges of the operands, or use machine integers, which wrap around",
    )


def _comparison(
    context: Context, op: tree.BinaryOp, left: tree.Expr, right: tree.Expr, span: Span
) -> tree.Expr | None:
    match left.type, right.type:
        case (types.IntType(), types.IntType()) | (types.DurationType(), types.DurationType()):
            return tree.Binary(op, left, right, types.BOOL, span)
        case (types.IntType() | types.FloatType(), types.IntType() | types.FloatType()):
            return tree.Binary(
                op, convert(left, types.FLOAT64), convert(right, types.FLOAT64), types.BOOL, span
            )
        case (types.BoolType() | types.EnumType() | types.SymbolType() as a, b) if a == b:
            if op in EQUALITY:
                return tree.Binary(op, left, right, types.BOOL, span)
            return context.report(
                "type-mismatch",
                f"`{op.value}` does not apply to {describe_type(a)}",
                span,
                "only `==` and `!=` do",
            )
    advice = "compare values of one type"
    if isinstance(left.type, types.EnumType) and isinstance(right.type, types.SymbolType):
        advice = f"write a member, such as `{left.type.name}.{left.type.members[0]}`"
    elif isinstance(left.type, types.EnumType) or isinstance(right.type, types.EnumType):
        type_ = left.type if isinstance(left.type, types.EnumType) else right.type
        assert isinstance(type_, types.EnumType)  # noqa: S101
        advice = f"{comparison_advice(type_)}, or its number: `int(...)`"
    elif types.BOOL in (left.type, right.type) and isinstance(left, tree.Literal | tree.Variable):
        advice = "a `bool` is already a condition: write it alone, or `not` before it"
    elif isinstance(left.type, types.DurationType) or isinstance(right.type, types.DurationType):
        advice = "give the number a unit, such as `500ms`"
    elif isinstance(left, tree.Binary) and left.type == types.BOOL:
        advice = "add parentheses"
    return context.report(
        "type-mismatch",
        f"{describe_type(left.type)} cannot be compared with {describe_type(right.type)}",
        span,
        advice,
    )


def _duration_arithmetic(
    context: Context, op: tree.BinaryOp, left: tree.Expr, right: tree.Expr, span: Span
) -> tree.Expr | None:
    """Type arithmetic on durations, in ticks, converted back into the bounds of a duration.

    The sum and the difference of two durations, a multiple and a part of one are durations. The
    quotient of two durations is a number.
    """
    a, b = left.type, right.type
    both = isinstance(a, types.DurationType) and isinstance(b, types.DurationType)
    count = b if isinstance(a, types.DurationType) else a
    match op:
        case tree.BinaryOp.ADD | tree.BinaryOp.SUB | tree.BinaryOp.REM if both:
            is_allowed = True
        case tree.BinaryOp.MUL:
            is_allowed = isinstance(count, types.IntType)
        case tree.BinaryOp.DIV:
            is_allowed = isinstance(a, types.DurationType) and isinstance(
                b, types.DurationType | types.IntType
            )
        case _:
            is_allowed = False
    if not is_allowed:
        return context.report(
            "type-mismatch",
            f"`{op.value}` does not apply to {describe_type(a)} and {describe_type(b)}",
            span,
            "give the number a unit, such as `500ms`" if not both else None,
        )
    if (
        op in (tree.BinaryOp.DIV, tree.BinaryOp.REM)
        and isinstance(right, tree.Literal)
        and right.value == 0
    ):
        return context.report("division-by-zero", "the divisor is always 0", right.span)
    ticks = [type_ if isinstance(type_, types.IntType) else TICKS for type_ in (a, b)]
    exact_ticks = [exact(t.lo, t.hi) for t in ticks]
    result = interval(op, *exact_ticks)
    if result is None or not representable(result):
        return _too_wide(context, result or TICKS, span)
    binary = tree.Binary(op, left, right, result, span)
    return binary if op is tree.BinaryOp.DIV and both else convert(binary, types.DURATION)


def _report_operands(
    context: Context, op: tree.BinaryOp, left: tree.Expr, right: tree.Expr, span: Span
) -> None:
    if op is tree.BinaryOp.ADD and types.SymbolType() in (left.type, right.type):
        return context.report(
            "outside-language",
            "strings cannot be joined",
            span,
            "log or send the parts one by one, or declare an operation",
        )
    advice = None
    if op in (*BITS, *SHIFTS) and types.BOOL in (left.type, right.type):
        advice = "as in C, comparisons bind tighter than `&`, `^` and `|`: put parentheses"
    elif types.BOOL in (left.type, right.type):
        advice = "write `1 if ... else 0` for the `bool`"
    message = (
        f"`{op.value}` does not apply to {describe_type(left.type)} and {describe_type(right.type)}"
    )
    if op in COMBINED and any(isinstance(side.type, types.EnumType) for side in (left, right)):
        message = f"{_kind(left.type)} and {_kind(right.type)} cannot be {COMBINED[op]}"
        member = left if isinstance(left.type, types.EnumType) else right
        advice = f"write its number: `int({format_expression(member)})`, or compare with `==`"
    return context.report("type-mismatch", message, span, advice)


COMBINED = {
    tree.BinaryOp.ADD: "added",
    tree.BinaryOp.SUB: "subtracted",
    tree.BinaryOp.MUL: "multiplied",
    tree.BinaryOp.DIV: "divided",
    tree.BinaryOp.REM: "divided",
}


def _kind(type_: types.Type | None) -> str:
    """Return the kind of a type with its article: "a number", "an `Error`"."""
    if isinstance(type_, types.IntType | types.FloatType):
        return "a number"
    name = str(type_)
    return f"{'an' if name[:1].lower() in 'aeiou' else 'a'} `{name}`"


def _divides(left: tree.Expr, right: tree.Expr) -> bool:
    """Return whether a quotient of integers is certainly whole."""
    match left, right:
        case _, tree.Literal(1 | -1):
            return True
        case tree.Literal(int(a)), tree.Literal(int(b)) if b != 0:
            return quotient(a, b) * b == a
        case _:
            return False


def _ecmascript_bits(
    context: Context, op: tree.BinaryOp, left: tree.Expr, right: tree.Expr, span: Span
) -> tree.Expr | None:
    """Type a bit operator where ECMAScript computes in int32."""
    for operand in (left, right):
        type_ = operand.type
        assert isinstance(type_, types.IntType)  # noqa: S101
        if type_.lo < types.INT32.lo or type_.hi > types.INT32.hi:
            return context.report(
                "type-mismatch",
                f"ECMAScript reduces `{type_}` to 32 bits here",
                operand.span,
                "keep the operands of bit operators within int32",
            )
    if op in BITS:
        return integers(context, op, left, right, span)
    return tree.Binary(op, left, right, types.INT32, span)


def common_type(a: types.Type | None, b: types.Type | None) -> types.Type | None:
    """Return the type of a value that has one type or the other, or None."""
    match a, b:
        case (types.IntType(), types.IntType()):
            if a == b:
                return a
            if a.is_machine or b.is_machine:
                return common_machine(a, b)
            union = hull(a, b)
            return union if representable(union) else None
        case (types.IntType() | types.FloatType(), types.IntType() | types.FloatType()):
            return a if a == b else types.FLOAT64
        case _:
            return a if a == b else None


def type_conditional(
    context: Context, test: tree.Expr, then: tree.Expr, otherwise: tree.Expr, span: Span
) -> tree.Expr | None:
    """Type a choice of two values."""
    is_bool = require_bool(context, test, "the condition")
    type_ = common_type(then.type, otherwise.type)
    if type_ is None:
        return context.report(
            "type-mismatch",
            f"one side is {describe_type(then.type)}, the other {describe_type(otherwise.type)}",
            span,
            "give both sides one type",
        )
    if not is_bool:
        return None
    if isinstance(type_, types.FloatType):
        then, otherwise = convert(then, type_), convert(otherwise, type_)
    return tree.Conditional(test, then, otherwise, type_, span)


def type_apply(
    context: Context, function: tree.Function, arguments: tuple[tree.Expr, ...], span: Span
) -> tree.Expr | None:
    """Type ``min``, ``max`` or ``abs``."""
    name = function.value
    operands = "one operand" if function is tree.Function.ABS else "two or more operands"
    if (len(arguments) == 1) != (function is tree.Function.ABS) or not arguments:
        return context.report(
            "wrong-arguments", f"`{name}` takes {operands}, not {len(arguments)}", span,
            "for instance `abs(n)`, `max(n, 0)`",
        )  # fmt: skip
    type_ = arguments[0].type
    for argument in arguments:
        if not isinstance(argument.type, types.IntType | types.FloatType | types.DurationType):
            message = f"`{name}` does not apply to {describe_type(argument.type)}"
            advice = "give it numbers or durations"
            return context.report("type-mismatch", message, argument.span, advice)
        type_ = _common_operand_type(function, type_, argument.type)
    if type_ is None or (function is tree.Function.ABS and isinstance(type_, types.DurationType)):
        message = f"`{name}` does not apply to operands of these types together"
        return context.report("type-mismatch", message, span, "give all operands one type")
    if isinstance(type_, types.FloatType):
        arguments = tuple(convert(a, types.FLOAT64) for a in arguments)
        return tree.Apply(function, arguments, types.FLOAT64, span)
    if function is tree.Function.ABS and isinstance(type_, types.IntType):
        if type_.is_machine:
            machine = common_machine(type_)
            assert machine is not None  # noqa: S101
            return tree.Apply(function, arguments, machine, span)
        least = 0 if type_.lo <= 0 <= type_.hi else min(abs(type_.lo), abs(type_.hi))
        result = exact(least, max(abs(type_.lo), abs(type_.hi)))
        if not representable(result):
            return _too_wide(context, result, span)
        return tree.Apply(function, arguments, result, span)
    return tree.Apply(function, arguments, type_, span)


def _common_operand_type(
    function: tree.Function, a: types.Type | None, b: types.Type
) -> types.Type | None:
    common = common_type(a, b)
    match a, b, common:
        case (types.IntType(), types.IntType(), types.IntType()) if not (
            a.is_machine or b.is_machine
        ):
            pick = min if function is tree.Function.MIN else max
            return (
                common
                if function is tree.Function.ABS
                else exact(pick(a.lo, b.lo), pick(a.hi, b.hi))
            )
        case _:
            return common


def with_span(expr: tree.Expr, span: Span) -> tree.Expr:
    """Return an expression at another location."""
    return replace(expr, span=span)
