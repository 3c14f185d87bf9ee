"""Values as generators print them: what the types and ranges of operands decide, decided once.

The typed tree leaves four decisions open: whether a test always ends alike, whether a result has
to be wrapped around, how a conversion changes its operand, and whether a shift count is reduced.
Whether an index or a divisor needs a check is in `chart.analysis.effects`.
"""

from __future__ import annotations

from dataclasses import dataclass

import fsmkit.language as lang
from fsmkit.chart.analysis.exclusion import joint_outcome, outcome
from fsmkit.chart.analysis.ranges import Range, raw_range, within
from fsmkit.chart.forms import by_form
from fsmkit.language.arithmetic import width
from fsmkit.language.conversion import bounds, integer_bounds


@by_form
def lowered(expr: lang.Expr) -> lang.Expr:
    """Return an expression in which what is constant is computed."""
    return lang.fold(expr)


def known_outcome(expr: lang.Binary) -> bool | None:
    """Return the outcome of a test that always ends alike, None if it depends or is no test.

    Operands that can fail or have effects must be evaluated nevertheless.
    """
    if expr.op in (lang.BinaryOp.AND, lang.BinaryOp.OR):
        return joint_outcome(expr)
    return outcome(expr)


def wrapping_bounds(expr: lang.Expr) -> Range | None:
    """Return the bounds to which an operator's result wraps; None where it cannot leave them."""
    type_ = expr.type
    if not isinstance(type_, lang.IntType) or type_.overflow is not lang.Overflow.WRAP:
        return None
    raw, own = raw_range(expr), (type_.lo, type_.hi)
    return None if raw is not None and within(raw, own) else own


@dataclass(frozen=True, slots=True)
class Bounding:
    """The conversion of a number to ``lo..hi``; ``truncates``: from a floating-point number.

    A floating-point number never wraps: beyond the bounds it becomes the nearest one.
    """

    lo: int
    hi: int
    overflow: lang.Overflow
    truncates: bool


def bounding(expr: lang.Convert) -> Bounding | None:
    """Return the bounding of a conversion to an integer or a duration, or None if it has none."""
    source = expr.operand.type
    if not isinstance(expr.type, lang.IntType | lang.DurationType):
        return None
    lo, hi, overflow = bounds(expr.type)
    truncates = isinstance(source, lang.FloatType)
    if overflow is lang.Overflow.NEAREST and not truncates:
        inner = integer_bounds(source)
        if inner is not None and within(inner, (lo, hi)):
            return None
    if truncates and overflow is lang.Overflow.WRAP:
        overflow = lang.Overflow.NEAREST
    return Bounding(lo, hi, overflow, truncates)


def count_width(expr: lang.Binary) -> int | None:
    """Return the width by which a shift count is reduced; None where it is below it."""
    assert isinstance(expr.type, lang.IntType)  # noqa: S101  (typed so)
    bits, count = width(expr.type), integer_bounds(expr.right.type)
    return None if count is not None and within(count, (0, bits - 1)) else bits
