"""Values brought into types: what storing does, and where it does nothing."""

from __future__ import annotations

import math
import struct
from dataclasses import replace
from functools import lru_cache
from typing import assert_never

from fsmkit.language import types
from fsmkit.language.arithmetic import wrapped
from fsmkit.language.tree import Convert, Expr, Literal


def can_convert(source: types.Type, target: types.Type) -> bool:
    """Whether a value of one type can be stored in another, perhaps changed."""
    match target:
        case types.IntType():
            return isinstance(source, types.IntType | types.FloatType)
        case types.FloatType():
            return isinstance(source, types.IntType | types.FloatType)
        case types.DurationType():
            return isinstance(source, types.DurationType)
        case _:
            return source == target


def fits(source: types.Type, target: types.Type) -> bool:
    """Whether every value of one type is, unchanged, a value of another."""
    match source, target:
        case types.IntType(), types.IntType():
            return target.lo <= source.lo and source.hi <= target.hi
        case types.FloatType(), types.FloatType():
            return source.bits <= target.bits
        case _:
            return source == target


def bounds(type_: types.IntType | types.DurationType) -> tuple[int, int, types.Overflow]:
    """Return least and greatest value of what is counted in whole numbers, and its overflow."""
    if isinstance(type_, types.DurationType):
        return 0, types.LONGEST_DURATION, types.Overflow.SATURATE
    return type_.lo, type_.hi, type_.overflow


def of_type(type_: types.Type | None) -> tuple[int, int] | None:
    """Return the least and the greatest integer that stand for values; None where none do."""
    match type_:
        case types.IntType() | types.DurationType():
            return bounds(type_)[:2]
        case types.BoolType():
            return 0, 1
        case types.EnumType():
            return type_.bounds
        case _:
            return None


def rounded(value: float, bits: int) -> float:
    """Return the nearest value of a floating-point type."""
    if bits == 64 or math.isinf(value) or math.isnan(value):
        return value
    try:
        return float(struct.unpack("f", struct.pack("f", value))[0])
    except OverflowError:  # beyond the greatest finite one, by half a step at least
        return math.copysign(math.inf, value)


def whole(value: float, lo: int, hi: int) -> int:
    """Truncate toward zero; NaN gives 0. Infinities lie beyond every bound."""
    if math.isnan(value):
        return 0
    if math.isinf(value):
        return hi + 1 if value > 0 else lo - 1
    return int(value)


def within(value: float, type_: types.IntType | types.DurationType) -> tuple[int, bool]:
    """Bring a number into a type; also return whether it lay outside and the type does not wrap.

    A float is never wrapped around: beyond the bounds it gives the nearest, as nothing is sure
    about its low digits. That is not an error where the type wraps.
    """
    lo, hi, overflow = bounds(type_)
    number = value if isinstance(value, int) else whole(value, lo, hi)
    if lo <= number <= hi:
        return number, False
    if overflow is types.Overflow.WRAP and isinstance(value, int):
        return wrapped(number, types.IntType(lo, hi)), False
    return min(max(number, lo), hi), overflow not in (types.Overflow.WRAP, types.Overflow.NEAREST)


def convert(expr: Expr, type_: types.Type) -> Expr:
    """Return the expression as a value of a type, wrapped in `Convert` unless it provably fits.

    A literal that fits becomes a literal of that type; one constant fills an array. The types
    must allow it (`can_convert`, or whole numbers to a duration).
    """
    source = expr.type
    if isinstance(expr, Literal):
        folded = _literal(expr, type_)
        if folded is not None:
            return folded
    if source is None or not (
        can_convert(source, type_)
        or (isinstance(source, types.IntType) and isinstance(type_, types.DurationType))
    ):
        raise ValueError(f"{source} cannot become {type_}")
    return expr if fits(source, type_) else Convert(expr, type_, expr.span)


def _literal(expr: Literal, type_: types.Type) -> Literal | None:
    """Return a literal in another type, None where that changes it and must be seen."""
    value = expr.value
    match expr.type, type_:
        case (types.IntType() | types.FloatType(), types.FloatType(bits)) if isinstance(
            value, int | float
        ):
            return Literal(rounded(float(value), bits), type_, expr.span)
        case (types.IntType(), types.IntType() | types.DurationType()) if isinstance(value, int):
            lo, hi, _ = bounds(type_)
            return replace(expr, type=type_) if lo <= value <= hi else None
        case (types.FloatType(), types.IntType(lo, hi)) if isinstance(value, float):
            number = whole(value, lo, hi)
            return Literal(number, type_, expr.span) if lo <= number <= hi else None
        case (types.ArrayType(element, length), types.ArrayType(wanted, size)) if length == size:
            assert isinstance(value, tuple)  # noqa: S101
            items = [_literal(Literal(v, element, expr.span), wanted) for v in value]
            found = [item.value for item in items if item is not None]
            return Literal(tuple(found), type_, expr.span) if len(found) == size else None
        case _:
            return expr if expr.type == type_ else None


def filled(value: types.Value, length: int) -> tuple[types.Value, ...]:
    """Return the value of an array all elements of which are the same.

    Machines of one system that share a long array have the same tuple, not each one of its own.
    """
    return _filled(value, length) if type(value) in WHOLE else (value,) * length


WHOLE = frozenset({bool, int})
"""Classes of which equal values are the same: not floats, of which 0.0 and -0.0 are equal."""


@lru_cache(maxsize=64, typed=True)
def _filled(value: types.Value, length: int) -> tuple[types.Value, ...]:
    return (value,) * length


def default_value(type_: types.Type) -> types.Value:
    """Return the value of a variable that declares no start value.

    The one nearest to 0, of an enumeration its first member.
    """
    match type_:
        case types.BoolType():
            return False
        case types.IntType(lo, hi):
            return min(max(0, lo), hi)
        case types.FloatType():
            return 0.0
        case types.EnumType(numbers=numbers):
            return numbers[0] if numbers else 0
        case types.DurationType():
            return 0
        case types.SymbolType():
            return ""
        case types.ArrayType(element, length):
            return filled(default_value(element), length)
        case types.RecordType(_, fields):
            return tuple(default_value(field.type) for field in fields)
        case _:
            assert_never(type_)
