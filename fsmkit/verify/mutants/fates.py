"""What becomes of a mutant."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from fsmkit.verify.mutants.contrast import Contrast
from fsmkit.verify.mutants.subject import Mutant


class Fate(Enum):
    """What became of a mutant."""

    FOUND = "found"
    """A property is violated, or something that `check` reports of every system."""
    EQUIVALENT = "equivalent"
    """In all systems that have it, it does as the original does."""
    SURVIVING = "surviving"
    """Every property holds."""
    UNDECIDED = "undecided"
    """Time or memory ended before any property was violated."""


@dataclass(frozen=True, slots=True)
class Evaluated:
    """A mutant and its fate.

    ``by``: names of violated properties; the search ends at the first. ``why``: of an equivalent
    one how that is known, of an undecided one what ended. ``systems``: those whose properties all
    hold though it may do something else there. ``contrast``: of a surviving one what a comparison
    with the original found. ``failed``: nothing is known, for a reason that is not its own.
    """

    mutant: Mutant
    fate: Fate
    by: tuple[str, ...] = ()
    why: str = ""
    states: int = 0
    systems: tuple[str, ...] = ()
    contrast: Contrast | None = None
    failed: bool = False
