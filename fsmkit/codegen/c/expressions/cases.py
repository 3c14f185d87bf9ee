"""Cases of a switch in C, each ending in ``break``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from fsmkit.emit import Emitter


@contextmanager
def case(out: Emitter, label: str) -> Iterator[None]:
    """Print a case. ``label``: a number, with an optional comment."""
    out.open(f"case {label}")
    yield
    out.close("    break;")


def default(out: Emitter) -> None:
    """Print an empty default case."""
    out.lines(["default:", "    break;"])
