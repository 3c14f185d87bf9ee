"""Numbers and arrays of constants."""

# mypy: disable-error-code="func-returns-value"
# (`return context.report(...)` reports and returns None)

from __future__ import annotations

import re
from math import isinf
from typing import TYPE_CHECKING

from fsmkit.diagnostics import Span
from fsmkit.language.arithmetic import exact, representable
from fsmkit.language.conversion import convert
from fsmkit.language.names import Context
from fsmkit.language.operators import common_type, describe_type
from fsmkit.language.syntax import ArrayNode, NumberNode
from fsmkit.language.tree import Expr, Literal
from fsmkit.language.types import FLOAT64, ArrayType, FloatType, Type

if TYPE_CHECKING:
    from fsmkit.language.binding.binder import Binder

OCTAL = re.compile(r"0\d+")


def bind_number(context: Context, node: NumberNode, span: Span) -> Expr | None:
    """Type a number; report one that does not fit 64 bits or that looks octal."""
    digits = node.digits.lower()
    if len(digits) > 400:
        message = "the number has more than 400 digits"
        return context.report("integer-too-wide", message, span)
    if not digits.startswith(("0x", "0b", "0o")):
        if any(c in digits for c in ".e"):
            if isinf(float(digits)):
                message = f"`{digits}` is beyond the greatest floating-point number"
                return context.report("expression-syntax", message, span)
            return Literal(float(digits), FLOAT64, span)
        if OCTAL.fullmatch(digits) and digits.strip("0"):
            return context.report(
                "expression-syntax",
                f"`{digits}` looks octal, but is decimal",
                span,
                f"write `{digits.lstrip('0')}`, or `0o{digits.lstrip('0')}` for octal",
            )
    value = int(digits, 10 if digits.isdigit() else 0)
    type_ = exact(value, value)
    if not representable(type_):
        advice = "write a float, such as `1e30`"
        message = f"`{digits}` does not fit 64 bits"
        return context.report("integer-too-wide", message, span, advice)
    return Literal(value, type_, span)


def bind_array(binder: Binder, node: ArrayNode, hint: Type | None) -> Expr | None:
    """Type an array of constants: standalone, or as a value of the array type ``hint``."""
    context = binder.context
    wanted = hint.element if isinstance(hint, ArrayType) else None
    type_: Type | None = None
    values = []
    for each in node.items:
        item = binder.value(each, wanted)
        if item is None:
            return None
        if not isinstance(item, Literal):
            advice = "declare an array variable, and assign its elements"
            message = "the elements of an array literal must be constants"
            return context.report("not-known-when-compiling", message, item.span, advice)
        values.append(item)
        type_ = item.type if type_ is None else common_type(type_, item.type)
        if type_ is None:
            message = f"{describe_type(item.type)} among elements of another type"
            return context.report("type-mismatch", message, item.span)
    if type_ is None:
        message = "an array needs at least one element"
        return context.report("type-mismatch", message, binder.span(node))
    if isinstance(type_, FloatType):
        values = [v for v in (convert(v, type_) for v in values) if isinstance(v, Literal)]
    array = ArrayType(type_, len(values))
    return Literal(tuple(v.value for v in values), array, binder.span(node))
