"""Spans of real time as text and in microseconds, as scripts and options write them."""

from __future__ import annotations

import re
from fractions import Fraction

from fsmkit.language.units import no_unit

UNITS = {
    "us": 1,
    "ms": 1000,
    "s": 1_000_000,
    "m": 60_000_000,
    "min": 60_000_000,
    "h": 3_600_000_000,
    "d": 86_400_000_000,
}


DURATION = re.compile(r"\s*(\d+\.?\d*|\.\d+)\s*([a-zA-Z]*)\s*")


def read_microseconds(text: str) -> int:
    """Return the microseconds of ``500ms``, ``2s``, ``.5s`` ...; `ValueError` for anything else."""
    match = DURATION.fullmatch(text)
    if match is not None and match[2] and match[2] not in UNITS:
        raise ValueError(f"is no duration: {no_unit(match[2])}")
    if match is None or not match[2]:
        raise ValueError(f"is no duration such as `500ms` or `2s`: `{text}`")
    exact = Fraction(match[1]) * UNITS[match[2]]
    if exact.denominator != 1:
        raise ValueError(f"is finer than a microsecond: `{text}`")
    return int(exact)


def duration_text(microseconds: int) -> str:
    """Return a duration in the largest of us, ms and s that is exact, or seconds with a point."""
    if microseconds >= 1_000_000 and microseconds % 1000 == 0:
        seconds = f"{microseconds // 1_000_000}.{microseconds // 1000 % 1000:03}"
        return f"{seconds.rstrip('0').rstrip('.')}s"
    if microseconds % 1000 == 0:
        return f"{microseconds // 1000}ms"
    return f"{microseconds}us"
