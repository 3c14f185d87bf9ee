"""What was probably meant by a name that is not known."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

LONGEST = 100
"""Characters; longer names are not compared, for comparing takes the square of their length."""
MOST = 1_000
"""So many names are compared in full; of more only those that begin alike."""


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that is most like one, None if none is."""
    if len(name) > LONGEST:
        return None
    candidates = sorted(k for k in known if len(k) <= LONGEST)
    if len(candidates) > MOST:
        candidates = [k for k in candidates if k[:2] == name[:2]][:MOST]
    near = get_close_matches(name, candidates, n=1)
    return near[0] if near else None


class Meant(str):
    """Advice that names what was probably meant for a wrong name."""

    __slots__ = ("name", "wrong")
    name: str
    wrong: str


def did_you_mean(name: str, wrong: str) -> Meant:
    """Return the advice to write another name."""
    advice = Meant(f"did you mean `{name}`?")
    advice.name, advice.wrong = name, wrong
    return advice


def suggest(name: str, known: Iterable[str], otherwise: str | None = None) -> str | None:
    """Return ``did you mean `...`?`` for the nearest known name, else ``otherwise``."""
    near = nearest(name, known)
    return did_you_mean(near, name) if near else otherwise
