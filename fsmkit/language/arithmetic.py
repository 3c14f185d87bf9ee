"""Integer arithmetic: intervals of exact results, and reduction to machine types."""

from __future__ import annotations

from fsmkit.language.tree import BinaryOp
from fsmkit.language.types import INT32, INT64, UINT32, UINT64, IntType, Overflow

RESULTS = (INT32, UINT32, INT64, UINT64)
"""The result types of arithmetic on machine integers; the first one that is wide enough is used."""


def common_machine(*types: IntType) -> IntType | None:
    """Return the first of int32, uint32, int64, uint64 that contains all types, or None."""
    lo, hi = min(t.lo for t in types), max(t.hi for t in types)
    return next((t for t in RESULTS if t.lo <= lo and hi <= t.hi), None)


def exact(lo: int, hi: int) -> IntType:
    """Return the type of an exact interval."""
    return IntType(lo, hi)


def representable(type_: IntType) -> bool:
    """Return whether all values lie in int64, or all in uint64."""
    return type_.lo <= type_.hi and (
        (INT64.lo <= type_.lo and type_.hi <= INT64.hi) or (type_.lo >= 0 and type_.hi <= UINT64.hi)
    )


def hull(a: IntType, b: IntType) -> IntType:
    """Return the smallest interval that contains both intervals."""
    return exact(min(a.lo, b.lo), max(a.hi, b.hi))


def wrapped(value: int, type_: IntType) -> int:
    """Return a value modulo the size of the range of `type_`."""
    return type_.lo + (value - type_.lo) % (type_.hi - type_.lo + 1)


def quotient(a: int, b: int) -> int:
    """Divide, truncating toward zero (C99 6.5.5); ``b`` is not 0."""
    magnitude = abs(a) // abs(b)
    return magnitude if (a < 0) == (b < 0) else -magnitude


def remainder(a: int, b: int) -> int:
    """Return the remainder of `quotient`, with the sign of the dividend; ``b`` is not 0."""
    return a - quotient(a, b) * b


def width(type_: IntType) -> int:
    """Return the modulus of a shift count: 32 or 64."""
    return 32 if common_machine(type_) in (INT32, UINT32) else 64


def compute(op: BinaryOp, a: int, b: int, type_: IntType) -> int:
    """Return the result of an arithmetic operator with result type `type_`; no divisor is 0.

    If the type wraps, the result is reduced to it. Otherwise the result lies within it.
    """
    match op:
        case BinaryOp.ADD:
            value = a + b
        case BinaryOp.SUB:
            value = a - b
        case BinaryOp.MUL:
            value = a * b
        case BinaryOp.DIV:
            value = quotient(a, b)
        case BinaryOp.REM:
            value = remainder(a, b)
        case BinaryOp.BIT_AND:
            value = a & b
        case BinaryOp.BIT_OR:
            value = a | b
        case BinaryOp.BIT_XOR:
            value = a ^ b
        case BinaryOp.SHIFT_LEFT:
            value = a << (b % width(type_))
        case BinaryOp.SHIFT_RIGHT:
            value = a >> (b % width(type_))
        case _:
            raise ValueError(op)
    return wrapped(value, type_) if type_.overflow is Overflow.WRAP else value


def interval(op: BinaryOp, a: IntType, b: IntType) -> IntType | None:
    """Return the interval of the exact results of an arithmetic operator.

    None if the divisor is always 0, or if a shift count may need reducing.
    """
    match op:
        case BinaryOp.ADD:
            return exact(a.lo + b.lo, a.hi + b.hi)
        case BinaryOp.SUB:
            return exact(a.lo - b.hi, a.hi - b.lo)
        case BinaryOp.MUL:
            return _corners([x * y for x in (a.lo, a.hi) for y in (b.lo, b.hi)])
        case BinaryOp.DIV:
            # a quotient is monotonic in each argument on either side of a divisor of 0
            divisors = [d for d in (b.lo, -1, 1, b.hi) if d != 0 and b.lo <= d <= b.hi]
            return _corners([quotient(x, d) for x in (a.lo, a.hi) for d in divisors])
        case BinaryOp.REM:
            return _remainders(a, b)
        case BinaryOp.BIT_AND | BinaryOp.BIT_OR | BinaryOp.BIT_XOR:
            return _bits(op, a, b)
        case BinaryOp.SHIFT_LEFT | BinaryOp.SHIFT_RIGHT:
            if not 0 <= b.lo <= b.hi < 32:  # only machine types reduce a wider count
                return None
            return _corners([_shift(op, x, n) for x in (a.lo, a.hi) for n in (b.lo, b.hi)])
        case _:
            raise ValueError(op)


def _corners(values: list[int]) -> IntType | None:
    return exact(min(values), max(values)) if values else None


def _shift(op: BinaryOp, value: int, count: int) -> int:
    return value << count if op is BinaryOp.SHIFT_LEFT else value >> count


def _remainders(a: IntType, b: IntType) -> IntType | None:
    most = max(abs(b.lo), abs(b.hi)) - 1
    if most < 0:
        return None
    # a dividend smaller than every divisor is the remainder
    least = 0 if b.lo <= 0 <= b.hi else min(abs(b.lo), abs(b.hi))
    if max(abs(a.lo), abs(a.hi)) < least:
        return exact(a.lo, a.hi)
    return exact(-min(most, max(-a.lo, 0)), min(most, max(a.hi, 0)))


def _bits(op: BinaryOp, a: IntType, b: IntType) -> IntType:
    if a.lo == a.hi and b.lo == b.hi:
        value = compute(op, a.lo, b.lo, exact(0, 0))
        return exact(value, value)
    if op is BinaryOp.BIT_AND and (a.lo >= 0 or b.lo >= 0):
        return exact(0, min(t.hi for t in (a, b) if t.lo >= 0))
    size = max(_magnitude(t) for t in (a, b))
    return exact(0 if a.lo >= 0 and b.lo >= 0 else -(1 << size), (1 << size) - 1)


def _magnitude(type_: IntType) -> int:
    """Return how many bits every value of the type fits in, without the sign."""
    return max(x.bit_length() if x >= 0 else (~x).bit_length() for x in (type_.lo, type_.hi))
