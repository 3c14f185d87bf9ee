"""Evaluation at compile time: constants and start values."""

from __future__ import annotations

import math
from dataclasses import replace

from fsmkit.diagnostics import Findings, Severity, Text
from fsmkit.diagnostics.split_text import split_outside
from fsmkit.language import (
    FLOAT64,
    INT32,
    INT64,
    ArrayType,
    Expr,
    FloatType,
    IntType,
    Literal,
    Scope,
    Type,
    Value,
    default_value,
    fold,
    type_expression,
)
from fsmkit.language.conversion import fill_array

LARGEST_FLOAT32 = (2 - 2**-23) * 2.0**127


def constant_value(text: Text, scope: Scope, findings: Findings) -> Literal | None:
    """Return the value of a constant expression, in its most exact type."""
    typed = type_expression(text, scope, findings)
    return None if typed is None else _literal(typed, text, findings)


def start_value(text: Text, type_: Type | None, scope: Scope, findings: Findings) -> Literal | None:
    """Return a start value of `type_`, or of an inferred type.

    ``[a, b]`` lists the elements of an array; a single value fills one.
    """
    if isinstance(type_, ArrayType) or (type_ is None and is_list(text)):
        return _array_value(text, type_, scope, findings)
    attempt = Findings()
    _check_range(text, type_, scope, attempt)
    typed = None if attempt.has_errors else type_expression(text, scope, attempt, type_)
    findings.extend(attempt)
    if typed is None or attempt.has_errors:
        return None
    found = _literal(typed, text, findings)
    if found is None or type_ is not None:
        return found
    general = general_type(found.type)
    return Literal(_in_type(found.value, general), general, text.span)


def _check_range(text: Text, type_: Type | None, scope: Scope, findings: Findings) -> None:
    """Report a start value outside its type, even if storing would wrap it.

    It is an error, but a warning in the lenient dialects, because real files contain such values.
    """
    if not isinstance(type_, IntType | FloatType):
        return
    typed = type_expression(text, scope, Findings())
    found = None if typed is None else fold(typed)
    value = found.value if isinstance(found, Literal) else None
    if not isinstance(value, int | float) or isinstance(value, bool):
        return
    if isinstance(type_, FloatType):
        is_within = type_.bits == 64 or abs(value) <= LARGEST_FLOAT32
        advice = "declare it as `float64`"
    else:
        is_within = math.isfinite(value) and type_.lo <= int(value) <= type_.hi
        advice = f"keep it within {type_.lo}..{type_.hi}, or widen the range"
    if not is_within:
        findings.add(
            "value-out-of-range",
            f"the start value {value} is not within `{type_}`",
            text,
            help=advice,
            severity=Severity.ERROR if scope.dialect == "fsmkit" else Severity.WARNING,
        )


def _array_value(
    text: Text, type_: ArrayType | None, scope: Scope, findings: Findings
) -> Literal | None:
    element = None if type_ is None else type_.element
    if type_ is not None and not is_list(text):
        value = start_value(text, element, scope, findings)
        return (
            None
            if value is None
            else Literal(fill_array(value.value, type_.length), type_, text.span)
        )
    parts = split_list(text)
    values = [start_value(part, element, scope, findings) for part in parts]
    found = [value for value in values if value is not None]
    if len(found) < len(parts):
        return None
    if type_ is None:
        if not found:
            findings.add(
                "missing-type",
                "the type of an empty list is unknown",
                text,
                help="declare the type of the array and fill it",
            )
            return None
        joined: Type | None = found[0].type
        for value in found[1:]:
            joined = None if joined is None else join_types(joined, value.type)
        if joined is None:
            findings.add(
                "mixed-array",
                "the elements of an array have one type",
                text,
                help="keep values of different types in variables of their own",
            )
            return None
        type_ = ArrayType(joined, len(found))
    if len(found) != type_.length:
        findings.add(
            "wrong-array-length",
            f"{len(found)} values for the {type_.length} elements of {type_}",
            text,
            help=f"list {type_.length} values, or one value without brackets to fill it",
        )
        return None
    element = type_.element
    return Literal(tuple(_in_type(v.value, element) for v in found), type_, text.span)


def _literal(typed: Expr, text: Text, findings: Findings) -> Literal | None:
    folded = fold(typed)
    if isinstance(folded, Literal):
        return replace(folded, span=text.span)
    findings.add(
        "not-known-when-compiling",
        f"`{text}` is not known when compiling",
        text,
        help="use literals and named constants only",
    )
    return None


def general_type(type_: Type) -> Type:
    """Return the type of a variable that starts with a value of `type_`."""
    if isinstance(type_, IntType):
        return INT32 if type_.lo in INT32 and type_.hi in INT32 else INT64
    if isinstance(type_, FloatType):
        return FLOAT64
    return type_


def join_types(first: Type, second: Type) -> Type | None:
    """Return the type of a variable that can hold values of both types, or None."""
    if first == second:
        return first
    numbers = (IntType, FloatType)
    if not (isinstance(first, numbers) and isinstance(second, numbers)):
        return None
    if isinstance(first, FloatType) or isinstance(second, FloatType):
        return FLOAT64
    return general_type(IntType(min(first.lo, second.lo), max(first.hi, second.hi)))


def _in_type(value: Value, type_: Type) -> Value:
    """Return an integer as a float if the type requires one."""
    is_float = isinstance(default_value(type_), float)
    return float(value) if is_float and isinstance(value, int) else value


def is_list(text: Text) -> bool:
    """Return whether a text is a list in brackets."""
    stripped = text.value.strip()
    return stripped.startswith("[") and stripped.endswith("]")


def split_list(text: Text) -> tuple[Text, ...]:
    """Return the parts of ``[a, b, c]``, split at commas outside brackets and quotes."""
    inner = text.strip()
    inner = inner.part(1, len(inner.value) - 1)
    parts = tuple(part.strip() for part in split_outside(inner, ","))
    return parts if len(parts) > 1 or parts[0].value else ()
