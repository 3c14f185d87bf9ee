"""Analyse expressions before they are printed: bounds, and whether they can fail."""

from __future__ import annotations

from dataclasses import replace
from functools import reduce

import fsmkit.language as lang
from fsmkit.chart.analysis.ranges import raw_range
from fsmkit.diagnostics import Span, fail
from fsmkit.language.arithmetic import exact
from fsmkit.language.conversion import bounds, integer_bounds
from fsmkit.language.walk import parts, subexpressions

LEAST, GREATEST = -(2**31), 2**31 - 1
"""The numbers that UPPAAL computes with (docs.uppaal.org, Types)."""


def unsupported(message: str, place: Span | None, way_out: str) -> Exception:
    """Return the error for an unsupported feature."""
    return fail("not-in-uppaal", message, place, help=way_out)


def require_small(lo: int, hi: int, place: Span | None) -> None:
    """Reject numbers beyond 32 bits."""
    if lo < LEAST or hi > GREATEST:
        raise unsupported(
            f"a value here can lie in {lo}..{hi}: UPPAAL computes with 32 bits",
            place,
            "declare narrower ranges, such as `0..1000`",
        )


# --- bounds ---------------------------------------------------------------------------------------


def range_of(expr: lang.Expr) -> tuple[int, int]:
    """Return bounds of the values of an expression, before it wraps around.

    Rejects values without bounds within 32 bits.
    """
    found = raw_range(expr, range_of)
    if found is None and isinstance(expr, lang.Binary):
        raise unsupported("this has no bounds", expr.span, "use a narrower range")
    found = found or range_of_type(expr.type, expr.span)
    require_small(*found, expr.span)
    return found


def range_of_type(type_: lang.Type | None, place: Span | None) -> tuple[int, int]:
    """Return the minimum and maximum of a scalar type; symbols are numbered elsewhere."""
    if isinstance(type_, lang.ArrayType):
        type_ = type_.element
    found = (0, GREATEST) if isinstance(type_, lang.SymbolType) else integer_bounds(type_)
    if found is None:
        raise unsupported(
            f"a value of type `{type_}` is not supported",
            place,
            "use whole numbers, truth values or enumerations, in small units",
        )
    require_small(*found, place)
    return found


# --- what can fail --------------------------------------------------------------------------------


def safety(expr: lang.Expr) -> lang.Expr | None:
    """Return the exact condition under which evaluation raises no content error; None: always."""
    own: lang.Expr | None = None
    match expr:
        case lang.Invalid():
            return lang.Literal(False, lang.BOOL, expr.span)
        case lang.Binary(lang.BinaryOp.AND | lang.BinaryOp.OR as op, left, right):
            then = safety(right)
            if then is not None:
                skipped = negation(left) if op is lang.BinaryOp.AND else left
                then = lang.Binary(lang.BinaryOp.OR, skipped, then, lang.BOOL, skipped.span)
            return both(safety(left), then)
        case lang.Conditional(test, then, otherwise):
            one, other = safety(then), safety(otherwise)
            if one is not None or other is not None:
                true = lang.Literal(True, lang.BOOL, expr.span)
                own = lang.Conditional(test, one or true, other or true, lang.BOOL, expr.span)
            return both(safety(test), own)
        case lang.Binary(lang.BinaryOp.DIV | lang.BinaryOp.REM, _, right):
            lo, hi = range_of(right)
            if lo <= 0 <= hi:
                zero = lang.Literal(0, exact(0, 0), expr.span)
                own = lang.Binary(lang.BinaryOp.NE, right, zero, lang.BOOL, expr.span)
        case lang.Element(array, index):
            assert isinstance(array.type, lang.ArrayType)  # noqa: S101  (typed so)
            own = _between(index, 0, array.type.length - 1)
    return both(reduce(both, map(safety, parts(expr)), None), own)


def range_condition(expr: lang.Expr) -> lang.Expr | None:
    """Return the condition under which no value leaves a faulting range; None: always."""
    if isinstance(expr, lang.Element | lang.Member | lang.Call):
        return None
    own = None
    match expr:
        case lang.Convert(operand, lang.IntType(lo, hi, lang.Overflow.FAULT)):
            own = _between(operand, lo, hi)
    return both(reduce(both, map(range_condition, parts(expr)), None), own)


def saturating_conversions(expr: lang.Expr) -> list[lang.Convert]:
    """Return the conversions that may limit a value to its range."""
    return [
        part for part in subexpressions(expr) if isinstance(part, lang.Convert) and _leaves(part)
    ]


def _leaves(convert: lang.Convert) -> bool:
    if not isinstance(convert.type, lang.IntType | lang.DurationType):
        return False
    lo, hi, overflow = bounds(convert.type)
    least, greatest = range_of(convert.operand)
    return overflow is lang.Overflow.SATURATE and not lo <= least <= greatest <= hi


def conversion_condition(convert: lang.Convert) -> lang.Expr | None:
    """Return the condition under which a value lies in the range of its conversion."""
    assert isinstance(convert.type, lang.IntType | lang.DurationType)  # noqa: S101  (one that saturates)
    lo, hi, _ = bounds(convert.type)
    return _between(convert.operand, lo, hi)


def _between(expr: lang.Expr, lo: int, hi: int) -> lang.Expr | None:
    least, greatest = range_of(expr)
    found: lang.Expr | None = None
    for is_sure, op, bound in (
        (least >= lo, lang.BinaryOp.GE, lo),
        (greatest <= hi, lang.BinaryOp.LE, hi),
    ):
        if not is_sure:
            limit = lang.Literal(bound, exact(bound, bound), expr.span)
            found = both(found, lang.Binary(op, expr, limit, lang.BOOL, expr.span))
    return found


def both(one: lang.Expr | None, other: lang.Expr | None) -> lang.Expr | None:
    """Return a conjunction; None is true."""
    if one is None or other is None:
        return other if one is None else one
    return lang.Binary(lang.BinaryOp.AND, one, other, lang.BOOL, one.span)


def negation(expr: lang.Expr) -> lang.Expr:
    """Return the negation of a condition."""
    opposite = {
        lang.BinaryOp.EQ: lang.BinaryOp.NE,
        lang.BinaryOp.NE: lang.BinaryOp.EQ,
        lang.BinaryOp.LT: lang.BinaryOp.GE,
        lang.BinaryOp.GE: lang.BinaryOp.LT,
        lang.BinaryOp.GT: lang.BinaryOp.LE,
        lang.BinaryOp.LE: lang.BinaryOp.GT,
    }
    match expr:
        case lang.Unary(lang.UnaryOp.NOT, operand):
            return operand
        case lang.Binary(op) if op in opposite:
            return replace(expr, op=opposite[op])
        case _:
            return lang.Unary(lang.UnaryOp.NOT, expr, lang.BOOL, expr.span)
