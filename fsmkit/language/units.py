"""Units of time, spans of time as scripts and options write them, and words that are no unit."""

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
"""The same for scripts and options."""
DURATION = re.compile(r"\s*(\d+\.?\d*|\.\d+)\s*([a-zA-Z]*)\s*")
LONGEST_NUMBER = 40
PART = re.compile(rf"\d+(?:{'|'.join(sorted(MICROSECONDS, reverse=True))})")
PARTS = re.compile(rf"(?<!\w)(?:{PART.pattern}){{2,}}(?!\w)")
NUMBER_AND_WORD = re.compile(r"(?<![\w.])(\d+\.?\d*|\.\d+)[ \t]*([^\W\d_]+)(?!\w)")


def number_with(text: str, at: int) -> tuple[str, str] | None:
    """Return a number and the word that stands at its end, at an offset of a text."""
    for found in NUMBER_AND_WORD.finditer(text, max(0, at - LONGEST_NUMBER), at + LONGEST_NUMBER):
        is_apart = found.end(1) < found.start(2)
        if found.start(2) == at and (not is_apart or found[2].lower() in MEANT):
            return found[1], found[2]
    return None


def several(text: str, at: int) -> str | None:
    """Return how a duration of several parts, ``1h30m``, is written; None where none stands."""
    found = PARTS.search(text, max(0, at - LONGEST_NUMBER))
    if found is None or not found.start() <= at <= found.end():
        return None
    return f"add the parts: `{' + '.join(PART.findall(found[0]))}`"


def no_unit(word: str) -> str:
    """Say that a word is no unit of time, and which there are."""
    return f"`{word}` is no unit; units are {', '.join(MICROSECONDS)}"


def meant(number: str, word: str) -> str:
    """Return how a duration with a wrong unit is probably to be written."""
    unit = MEANT.get(word.lower())
    written = [f"`{number}{each}`" for each in ([unit] if unit else ["ms", "s"])]
    return f"write {' or '.join(written)}"


def read_microseconds(text: str) -> int:
    """Return the microseconds of ``500ms``, ``2s``, ``.5s`` ...; `ValueError` for anything else."""
    match = DURATION.fullmatch(text)
    if match is not None and match[2] and match[2] not in IN_OPTIONS:
        raise ValueError(f"is no duration: {no_unit(match[2])}")
    if match is None or not match[2]:
        raise ValueError(f"is no duration such as `500ms` or `2s`: `{text}`")
    exact = Fraction(match[1]) * IN_OPTIONS[match[2]]
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
