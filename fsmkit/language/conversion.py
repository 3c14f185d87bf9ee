"""Conversion of values between types, as storing them does."""

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
    """Return whether a variable of type `target` can store a value of `source`."""
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
    """Return whether every value of `source` is unchanged a value of `target`."""
    match source, target:
        case types.IntType(), types.IntType():
            return target.lo <= source.lo and source.hi <= target.hi
        case types.FloatType(), types.FloatType():
            return source.bits <= target.bits
        case _:
            return source == target


def bounds(type_: types.IntType | types.DurationType) -> tuple[int, int, types.Overflow]:
    """Return the minimum, the maximum and the overflow of a type that counts in whole numbers."""
    if isinstance(type_, types.DurationType):
        return 0, types.LONGEST_DURATION, types.Overflow.SATURATE
    return type_.lo, type_.hi, type_.overflow


def integer_bounds(type_: types.Type | None) -> tuple[int, int] | None:
    """Return the least and greatest integer that represent values of a type.

    Return None if integers do not represent them.
    """
    match type_:
        case types.IntType() | types.DurationType():
            return bounds(type_)[:2]
        case types.BoolType():
            return 0, 1
        case types.EnumType():
            return type_.bounds
        case _:
            return None


def round_float(value: float, bits: int) -> float:
    """Return the nearest value of a floating-point type of `bits` bits."""
    if bits == 64 or math.isinf(value) or math.isnan(value):
        return value
    try:
        return float(struct.unpack("f", struct.pack("f", value))[0])
    except OverflowError:  # beyond the greatest finite one, by half a step at least
        return math.copysign(math.inf, value)


def truncate(value: float, lo: int, hi: int) -> int:
    """Truncate toward zero. NaN gives 0; an infinity gives a number outside the bounds."""
    if math.isnan(value):
        return 0
    if math.isinf(value):
        return hi + 1 if value > 0 else lo - 1
    return int(value)


def bring_within(value: float, type_: types.IntType | types.DurationType) -> tuple[int, bool]:
    """Bring a number into a type. Also return whether it was outside and the type does not wrap.

    A float is never wrapped. Outside the bounds it gives the nearest bound, because its low digits
    are uncertain. If the type wraps, that is not an error.
    """
    lo, hi, overflow = bounds(type_)
    number = value if isinstance(value, int) else truncate(value, lo, hi)
    if lo <= number <= hi:
        return number, False
    if overflow is types.Overflow.WRAP and isinstance(value, int):
        return wrapped(number, types.IntType(lo, hi)), False
    return min(max(number, lo), hi), overflow not in (types.Overflow.WRAP, types.Overflow.NEAREST)


def convert(expr: Expr, type_: types.Type) -> Expr:
    """Return the expression as a value of a type, wrapped in `Convert` unless it provably fits.

    A literal that fits becomes a literal of that type. One constant fills an array. The types must
    permit it (`can_convert`, or whole numbers to a duration).
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
    """Return a literal in another type; None if storing would change its value."""
    value = expr.value
    match expr.type, type_:
        case (types.IntType() | types.FloatType(), types.FloatType(bits)) if isinstance(
            value, int | float
        ):
            return Literal(round_float(float(value), bits), type_, expr.span)
        case (types.IntType(), types.IntType() | types.DurationType()) if isinstance(value, int):
            lo, hi, _ = bounds(type_)
            return replace(expr, type=type_) if lo <= value <= hi else None
        case (types.FloatType(), types.IntType(lo, hi)) if isinstance(value, float):
            number = truncate(value, lo, hi)
            return Literal(number, type_, expr.span) if lo <= number <= hi else None
        case (types.ArrayType(element, length), types.ArrayType(wanted, size)) if length == size:
            assert isinstance(value, tuple)  # noqa: S101
            items = [_literal(Literal(v, element, expr.span), wanted) for v in value]
            found = [item.value for item in items if item is not None]
            return Literal(tuple(found), type_, expr.span) if len(found) == size else None
        case _:
            return expr if expr.type == type_ else None


def fill_array(value: types.Value, length: int) -> tuple[types.Value, ...]:
    """Return the value of an array whose elements are all the same.

    Machines of one system share the tuple of a long array.
    """
    return _fill_array(value, length) if type(value) in WHOLE else (value,) * length


WHOLE = frozenset({bool, int})
"""Classes whose equal values are identical. Floats are not: 0.0 equals -0.0."""


@lru_cache(maxsize=64, typed=True)
def _fill_array(value: types.Value, length: int) -> tuple[types.Value, ...]:
    return (value,) * length


def default_value(type_: types.Type) -> types.Value:
    """Return the default start value: nearest to 0, or the first enumeration member."""
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
            return fill_array(default_value(element), length)
        case types.RecordType(_, fields):
            return tuple(default_value(field.type) for field in fields)
        case _:
            assert_never(type_)
