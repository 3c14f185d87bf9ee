"""Units of time, durations in scripts and options, and advice for wrong units."""

from __future__ import annotations

import re
from fractions import Fraction

MICROSECONDS = {
    "us": 1,
    "ms": 1000,
    "s": 1_000_000,
    "m": 60_000_000,
    "h": 3_600_000_000,
    "d": 86_400_000_000,
}
MEANT = {
    word: unit
    for unit, words in {
        "us": "usec microsecond microseconds µs",
        "ms": "msec msecs millis millisecond milliseconds",
        "s": "sec secs second seconds",
        "m": "min mins minute minutes",
        "h": "hr hrs hour hours",
        "d": "day days",
    }.items()
    for word in words.split()
}
IN_OPTIONS = {**MICROSECONDS, "min": MICROSECONDS["m"]}
"""The same units for scripts and options."""
DURATION = re.compile(r"\s*(\d+\.?\d*|\.\d+)\s*([a-zA-Z]*)\s*")
LONGEST_NUMBER = 40
PART = re.compile(rf"\d+(?:{'|'.join(sorted(MICROSECONDS, reverse=True))})")
PARTS = re.compile(rf"(?<!\w)(?:{PART.pattern}){{2,}}(?!\w)")
NUMBER_AND_WORD = re.compile(r"(?<![\w.])(\d+\.?\d*|\.\d+)[ \t]*([^\W\d_]+)(?!\w)")


def split_number(text: str, at: int) -> tuple[str, str] | None:
    """Return the number at an offset of a text and the word directly after it."""
    for found in NUMBER_AND_WORD.finditer(text, max(0, at - LONGEST_NUMBER), at + LONGEST_NUMBER):
        is_apart = found.end(1) < found.start(2)
        if found.start(2) == at and (not is_apart or found[2].lower() in MEANT):
            return found[1], found[2]
    return None


def suggest_sum(text: str, at: int) -> str | None:
    """Return the advice for a duration of several parts, such as ``1h30m``.

    Return None for other texts.
    """
    found = PARTS.search(text, max(0, at - LONGEST_NUMBER))
    if found is None or not found.start() <= at <= found.end():
        return None
    return f"add the parts: `{' + '.join(PART.findall(found[0]))}`"


def unknown_unit(word: str) -> str:
    """Return the message that a word is not a unit of time, with the list of units."""
    return f"`{word}` is not a unit; units are {', '.join(MICROSECONDS)}"


def suggest_duration(number: str, word: str) -> str:
    """Return the advice for a duration with a wrong unit."""
    unit = MEANT.get(word.lower())
    written = [f"`{number}{each}`" for each in ([unit] if unit else ["ms", "s"])]
    return f"write {' or '.join(written)}"


def read_microseconds(text: str) -> int:
    """Return the microseconds of ``500ms``, ``2s``, ``.5s`` ...; else raise `ValueError`."""
    match = DURATION.fullmatch(text)
    if match is not None and match[2] and match[2] not in IN_OPTIONS:
        raise ValueError(f"is not a duration: {unknown_unit(match[2])}")
    if match is None or not match[2]:
        raise ValueError(f"is not a duration such as `500ms` or `2s`: `{text}`")
    exact = Fraction(match[1]) * IN_OPTIONS[match[2]]
    if exact.denominator != 1:
        raise ValueError(f"is finer than a microsecond: `{text}`")
    return int(exact)


def duration_text(microseconds: int) -> str:
    """Return a duration in the largest exact unit of us, ms and s, or in decimal seconds."""
    if microseconds >= 1_000_000 and microseconds % 1000 == 0:
        seconds = f"{microseconds // 1_000_000}.{microseconds // 1000 % 1000:03}"
        return f"{seconds.rstrip('0').rstrip('.')}s"
    if microseconds % 1000 == 0:
        return f"{microseconds // 1000}ms"
    return f"{microseconds}us"
