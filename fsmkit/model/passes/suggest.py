"""What was probably meant: the help of a finding about an unknown name."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


def suggest(name: str, known: Iterable[str], otherwise: str | None = None) -> str | None:
    """Return ``did you mean `...`?`` for the nearest known name, else ``otherwise``."""
    near = get_close_matches(name, sorted(known), n=1)
    return f"did you mean `{near[0]}`?" if near else otherwise
