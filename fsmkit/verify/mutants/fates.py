"""The fates of mutants."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from fsmkit.verify.mutants.contrast import Contrast
from fsmkit.verify.mutants.subject import Mutant


class Fate(Enum):
    """The fate of a mutant."""

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

    ``by``: names of violated properties; the search ends at the first. ``why``: the proof for an
    equivalent one, the exceeded limit for an undecided one. ``systems``: those whose properties all
    hold although it may differ there. ``contrast``: the comparison of a surviving one with the
    original. ``failed``: nothing is known, for an external reason.
    """

    mutant: Mutant
    fate: Fate
    by: tuple[str, ...] = ()
    why: str = ""
    states: int = 0
    systems: tuple[str, ...] = ()
    contrast: Contrast | None = None
    failed: bool = False
