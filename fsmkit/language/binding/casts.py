"""Explicit conversions: ``int(e)``, ``ms(d)``, ``Fault(n)``, ``Percent(x)``, ``bool(n)``."""

# mypy: disable-error-code="func-returns-value"
# (`return context.report(...)` reports and returns None)

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from fsmkit.diagnostics import Severity
from fsmkit.language import types
from fsmkit.language.arithmetic import exact
from fsmkit.language.conversion import bounds, convert, default_value, integer_bounds
from fsmkit.language.folding import fold
from fsmkit.language.operators import describe_type, integers
from fsmkit.language.scope import Scope
from fsmkit.language.syntax import CallNode
from fsmkit.language.tree import Binary, BinaryOp, Checked, Conditional, Convert, Expr, Literal

if TYPE_CHECKING:
    from fsmkit.language.binding.binder import Binder

NUMBERS: dict[str, types.Type] = {
    **types.MACHINE_INTEGERS,
    "float32": types.FLOAT32,
    "float64": types.FLOAT64,
}
"""Number types by name. Each name is also a conversion function."""


def is_conversion(scope: Scope, name: str) -> bool:
    """Return whether a call of `name` converts; declared names take precedence."""
    return name in ("int", "ms", "bool") or name in NUMBERS or name in scope.types


def bind_conversion(binder: Binder, node: CallNode, name: str) -> Expr | None:
    """Type a conversion."""
    known = binder.context.scope.types.get(name) or NUMBERS.get(name)
    most = 2 if isinstance(known, types.EnumType) else 1
    if not 1 <= len(node.arguments) <= most:
        takes = "a number, and a member for others" if most == 2 else "one value"
        return binder.context.report(
            "wrong-arguments",
            f"`{name}` takes {takes}, not {len(node.arguments)} arguments",
            binder.span(node),
        )
    operand = binder.value(node.arguments[0])
    if operand is None:
        return None
    if name == "ms":
        return _milliseconds(binder, node, operand)
    if name == "int":
        return _integer(binder, node, operand)
    if name == "bool":
        return _truth(binder, node, operand)
    if isinstance(known, types.EnumType):
        return _member(binder, node, operand, known)
    if isinstance(known, types.IntType | types.FloatType):
        return _nearest(binder, node, operand, known, name)
    message = f"`{name}` is not a conversion: it is neither a number type nor an enumeration"
    return binder.context.report("type-mismatch", message, binder.span(node))


def _reject(binder: Binder, node: CallNode, operand: Expr, accepted: str) -> None:
    name = binder.text.value[node.callee.start : node.callee.end]
    binder.context.report(
        "type-mismatch",
        f"`{name}` converts {accepted}, not {describe_type(operand.type)}",
        operand.span,
        "write `int(...)` for the number of a member or of a duration"
        if isinstance(operand.type, types.EnumType | types.DurationType | types.BoolType)
        else None,
    )


def _integer(binder: Binder, node: CallNode, operand: Expr) -> Expr | None:
    """Type ``int(e)``: 0 or 1 for a bool, the number of a member, the ticks of a duration."""
    span = binder.span(node)
    match operand.type:
        case types.IntType():
            return replace(operand, span=span)
        case types.BoolType():
            one, zero = (Literal(n, exact(n, n), span) for n in (1, 0))
            return Conditional(operand, one, zero, exact(0, 1), span)
        case types.FloatType():
            return Checked(operand, types.INT64, span)
        case types.EnumType() | types.DurationType():
            return _number(operand, node, binder)
        case _:
            return _reject(binder, node, operand, "a number, a bool, a member or a duration")


def _number(operand: Expr, node: CallNode, binder: Binder) -> Expr:
    span = integer_bounds(operand.type)
    assert span is not None  # noqa: S101  (of members and durations)
    return Convert(operand, types.IntType(*span, types.Overflow.NEAREST), binder.span(node), "int")


def _milliseconds(binder: Binder, node: CallNode, operand: Expr) -> Expr | None:
    """Type ``ms(d)``: whole milliseconds, rounded down."""
    if not isinstance(operand.type, types.DurationType):
        return _reject(binder, node, operand, "a duration")
    tick, span = binder.context.scope.tick, binder.span(node)
    found: Expr | None = _number(operand, node, binder)
    for op, factor in ((BinaryOp.MUL, tick), (BinaryOp.DIV, 1000)):
        if found is not None and tick != 1000:
            literal = Literal(factor, exact(factor, factor), span)
            found = integers(binder.context, op, found, literal, span)
    return found


def _truth(binder: Binder, node: CallNode, operand: Expr) -> Expr | None:
    """Type ``bool(n)``: true if the number is not 0."""
    match operand.type:
        case types.BoolType():
            return operand
        case types.IntType() | types.FloatType():
            zero = default_value(
                types.FLOAT64 if isinstance(operand.type, types.FloatType) else exact(0, 0)
            )
            type_ = types.FLOAT64 if isinstance(operand.type, types.FloatType) else exact(0, 0)
            span = binder.span(node)
            return Binary(BinaryOp.NE, operand, Literal(zero, type_, span), types.BOOL, span)
        case _:
            return _reject(binder, node, operand, "a number")


def _member(binder: Binder, node: CallNode, operand: Expr, type_: types.EnumType) -> Expr | None:
    """Type ``Fault(n)`` or ``Fault(n, member)``; the member is the result for all other numbers."""
    span = binder.span(node)
    if isinstance(operand.type, types.EnumType) and operand.type == type_:
        return operand
    if not isinstance(operand.type, types.IntType):
        return _reject(binder, node, operand, "a whole number")
    otherwise = None
    if len(node.arguments) == 2:
        second = binder.value(node.arguments[1], type_)
        if second is None:
            return None
        folded = fold(second)
        if not isinstance(folded, Literal) or folded.type != type_:
            return binder.context.report(
                "type-mismatch",
                f"the second argument is not a member of `{type_.name}`",
                second.span,
                f"write such as `{type_.name}.{type_.members[0]}`",
            )
        otherwise = folded
    lo, hi = type_.bounds
    if otherwise is None and (operand.type.hi < lo or operand.type.lo > hi):
        is_literal = isinstance(operand, Literal)
        binder.context.report(
            "value-out-of-range",
            f"{describe_type(operand.type)} is never the number of a member of `{type_.name}`",
            operand.span,
            f"the numbers are {', '.join(map(str, type_.numbers[:8]))}",
            Severity.ERROR if is_literal else Severity.WARNING,
        )
        if is_literal:
            return None
    return Checked(operand, type_, span, otherwise)


def _nearest(
    binder: Binder, node: CallNode, operand: Expr, type_: types.IntType | types.FloatType, name: str
) -> Expr | None:
    """Type ``Percent(x)``: convert as storing does, without ``error.range``."""
    if not isinstance(operand.type, types.IntType | types.FloatType):
        return _reject(binder, node, operand, "a number")
    if isinstance(type_, types.IntType):
        lo, hi, overflow = bounds(type_)
        is_wrapping = overflow is types.Overflow.WRAP
        type_ = type_ if is_wrapping else types.IntType(lo, hi, types.Overflow.NEAREST)
    found = replace(convert(operand, type_), span=binder.span(node))
    return replace(found, name=name) if isinstance(found, Convert) else found
