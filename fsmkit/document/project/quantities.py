"""Sizes of memory and spans of time, as options and the project file write them."""

from __future__ import annotations

import re

SIZE = re.compile(r"(\d+(?:\.\d+)?)\s*([KMGT]?)B?", re.IGNORECASE)
SPAN = re.compile(r"(\d+(?:\.\d+)?)\s*(ms|s|m|min|h)?")
UNITS = {"": 0, "K": 10, "M": 20, "G": 30, "T": 40}
SECONDS = {"ms": 0.001, "s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0, None: 1.0}


def size_of(text: str) -> int | None:
    """Return the bytes of ``4G`` or ``512M``; None of another text."""
    match = SIZE.fullmatch(text)
    return None if match is None else int(float(match[1]) * (1 << UNITS[match[2].upper()]))


def seconds_of(text: str) -> float | None:
    """Return the seconds of ``10m`` or ``30s``; None of another text."""
    match = SPAN.fullmatch(text)
    return None if match is None else float(match[1]) * SECONDS[match[2]]
