"""Units of time, and which one is probably meant by a word that is none."""

from __future__ import annotations

import re

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
LONGEST_NUMBER = 40
NUMBER_AND_WORD = re.compile(r"(?<![\w.])(\d+\.?\d*|\.\d+)([^\W\d_]+)(?!\w)")


def number_with(text: str, at: int) -> tuple[str, str] | None:
    """Return a number and the word that stands at its end, at an offset of a text."""
    for found in NUMBER_AND_WORD.finditer(text, max(0, at - LONGEST_NUMBER), at + LONGEST_NUMBER):
        if found.start(2) == at:
            return found[1], found[2]
    return None


def no_unit(word: str) -> str:
    """Say that a word is no unit of time, and which there are."""
    return f"`{word}` is no unit; units are {', '.join(MICROSECONDS)}"


def meant(number: str, word: str) -> str:
    """Return how a duration with a wrong unit is probably to be written."""
    unit = MEANT.get(word.lower())
    written = [f"`{number}{each}`" for each in ([unit] if unit else ["ms", "s"])]
    return f"write {' or '.join(written)}"
