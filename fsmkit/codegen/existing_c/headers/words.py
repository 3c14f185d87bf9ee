"""The similarity of names in a chart and in a header: both are joined words."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import lru_cache
from typing import TypeVar

Found = TypeVar("Found")
WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
EXACT, ENDS, STARTS, HOLDS, DIFFERENT = 4, 3, 2, 1, 0


@lru_cache(maxsize=1 << 16)
def words(name: str) -> tuple[str, ...]:
    """Return the words of a name in lower case: three for ``BMS_AmpsMax``."""
    return tuple(word.lower() for word in WORD.findall(name))


def likeness(name: str, other: str) -> int:
    """Return the similarity of names by common words: all, at the end, start, inside; 0: none."""
    own, theirs = words(name), words(other)
    if not own or len(theirs) < len(own):
        return DIFFERENT
    if own == theirs:
        return EXACT
    if theirs[-len(own) :] == own:
        return ENDS
    if theirs[: len(own)] == own:
        return STARTS
    places = range(1, len(theirs) - len(own))
    return HOLDS if any(theirs[n : n + len(own)] == own for n in places) else DIFFERENT


def alike(name: str, found: Iterable[Found], key: Callable[[Found], str]) -> list[Found]:
    """Return the most similar candidates, or none if no name is similar."""
    best: list[Found] = []
    most = DIFFERENT
    for each in found:
        score = likeness(name, key(each))
        if score > most:
            best, most = [each], score
        elif score and score == most:
            best.append(each)
    return best
