"""Arithmetic of the action language where Python's own operators differ."""

from __future__ import annotations

import math
import struct


class ContentError(Exception):
    """Content that cannot be evaluated: the rest of its block is skipped."""


class EndOfBlock(Exception):  # noqa: N818  (its error event was raised)
    """The rest of a block is skipped without another error."""


class RangeFault(Exception):  # noqa: N818  (a fault of the machine, not an error of the chart)
    """A value left the bounds of a type that forbids it: the machine stops."""


def around(value: int, lo: int, hi: int) -> int:
    """Return a value modulo the size of a range, inside of it."""
    return (value - lo) % (hi - lo + 1) + lo


def divide(a: int, b: int) -> int:
    """Divide integers, truncating toward zero (C99 6.5.5)."""
    if b == 0:
        raise ContentError("division by zero")
    return a // b if (a < 0) == (b < 0) else -(-a // b)


def remainder(a: int, b: int) -> int:
    """Return the remainder of `divide`; it has the sign of the dividend."""
    if b == 0:
        raise ContentError("division by zero")
    rest = abs(a) % abs(b)
    return -rest if a < 0 else rest


def divide_floats(a: float, b: float) -> float:
    """Divide as IEEE 754 does: by zero gives an infinity, or no number."""
    if b != 0:
        return a / b
    if a == 0 or math.isnan(a) or math.isnan(b):
        return math.nan
    return math.copysign(math.inf, a) * math.copysign(1.0, b)


def remainder_floats(a: float, b: float) -> float:
    """Return C's ``fmod``: no number where the divisor is zero or the dividend infinite."""
    if b == 0 or math.isinf(a) or math.isnan(a) or math.isnan(b):
        return math.nan
    return math.fmod(a, b)


def single(value: float) -> float:
    """Round to IEEE 754 binary32; a value beyond its range becomes an infinity."""
    try:
        rounded: float = struct.unpack("<f", struct.pack("<f", value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)
    return rounded


def truncate(value: float, lo: int, hi: int) -> int:
    """Return a number without its fraction; infinities lie just outside ``lo..hi``, NaN is 0."""
    if value != value:
        return 0
    if math.isinf(value):
        return hi + 1 if value > 0 else lo - 1
    return math.trunc(value)


def position(index: int, length: int) -> int:
    """Return a position in an array that is known to exist."""
    if 0 <= index < length:
        return index
    raise ContentError("index out of range")


def integer(value: float) -> int:
    """Return the whole part of a number, which must lie within 64 bits."""
    if math.isfinite(value) and -(2**63) <= math.trunc(value) < 2**63:
        return math.trunc(value)
    raise ContentError("no whole part within 64 bits")


def member(number: int, known: tuple[int, ...], otherwise: int | None = None) -> int:
    """Return `number` if it is known, else `otherwise`; stop the machine if that is None."""
    if number in known:
        return number
    if otherwise is None:
        raise ContentError("the number of no member")
    return otherwise


def bounded(value: int, lo: int, hi: int) -> int:
    """Return `value` if it lies in its range; otherwise stop the machine."""
    if lo <= value <= hi:
        return value
    raise RangeFault("a value left its range")


def cannot(reason: str) -> bool:
    """Fail as content does that has no meaning."""
    raise ContentError(reason)


def replace(old: list[object], new: list[object] | tuple[object, ...]) -> None:
    """Copy the parts of an array or record into another of the same shape."""
    for place, value in enumerate(new):
        part = old[place]
        if isinstance(part, list) and isinstance(value, (list, tuple)):
            replace(part, value)
        else:
            old[place] = value


def frozen(value: object) -> object:
    """Return a value that later assignments do not change."""
    return tuple([frozen(part) for part in value]) if isinstance(value, (list, tuple)) else value


def shown(value: object) -> str:
    """Spell a value as traces do: enumerations as numbers, durations in ticks."""
    if isinstance(value, (list, tuple)):
        return f"[{' '.join([shown(part) for part in value])}]"
    if isinstance(value, float):
        return f"{value:.17g}"
    return f'"{value}"' if isinstance(value, str) else f"{value:d}"
