"""Format numbers of states, which may be of any size."""

from __future__ import annotations

import math

SHOWN = 18
"""Digits up to which all are shown."""
MOST_DIGITS = 4000
"""Digits up to which a number is one in JSON: Python reads and writes no longer ones by default."""
DIGITS = 3


def count_text(count: int) -> str:
    """Return a count with separated thousands, as ``970,679,981``; a long one as ``2.05e53``."""
    if count < 10**SHOWN:
        return f"{count:,}"
    exponent = _digits(count) - 1
    leading = count // 10 ** (exponent - DIGITS)  # one digit more than shown
    rounded = (leading + 5) // 10
    if rounded >= 10**DIGITS:
        rounded, exponent = rounded // 10, exponent + 1
    text = str(rounded)
    return f"{text[0]}.{text[1:]}e{exponent}"


def quantity(count: int, noun: str) -> str:
    """Return a count with its noun, as ``1 timer`` and ``2 timers``."""
    return f"{count_text(count)} {noun}{'' if count == 1 else 's'}"


def count_in_json(count: int) -> int | str:
    """Return a count for JSON: a number, or its decimal digits if it is too long for one."""
    if count < 10**MOST_DIGITS:
        return count
    parts = []
    while count:
        count, part = divmod(count, 10**MOST_DIGITS)
        parts.append(f"{part:0{MOST_DIGITS}d}")
    return "".join(reversed(parts)).lstrip("0")


def _digits(count: int) -> int:
    """Return the number of decimal digits."""
    about = int(count.bit_length() * math.log10(2))
    return about + int(count >= 10**about)
