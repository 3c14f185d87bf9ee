"""Cases of a switch in C, each of which ends in ``break``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from fsmkit.emit import Emitter


@contextmanager
def case(out: Emitter, label: str) -> Iterator[None]:
    """Print a case; ``label``: of a number, with a comment perhaps."""
    out.open(f"case {label}")
    yield
    out.close("    break;")


def default(out: Emitter) -> None:
    """Print that all else does nothing."""
    out.lines(["default:", "    break;"])
