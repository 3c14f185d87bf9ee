"""Identifiers for names of a chart: unique, legal, and as like the name as can be."""

from __future__ import annotations

import re
from collections.abc import Iterable


def snake(name: str) -> str:
    """Return a name in lower case words: ``FeederBelt`` gives ``feeder_belt``."""
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name)
    return legal(spaced).lower()


def legal(name: str) -> str:
    """Return a name with every character that identifiers cannot hold replaced."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return plain if plain and not plain[0].isdigit() else f"_{plain}"


class Namer:
    """Gives each name an identifier of its own, none of them reserved."""

    def __init__(self, reserved: Iterable[str] = ()) -> None:
        """Begin with the identifiers that are taken already."""
        self._reserved = frozenset(reserved)
        self._taken = set(self._reserved)
        self.numbered: dict[str, str] = {}
        """The identifiers that end in a number because others are taken, and those others."""

    def name(self, wanted: str, suffix: str = "") -> str:
        """Return the identifier for a name, made unique by a number where it must be.

        ``suffix``: ends it where the identifier is reserved.
        """
        base = legal(wanted)
        if base in self._reserved:
            base += suffix
        candidate, number = base, 1
        while candidate in self._taken:
            number += 1
            candidate = f"{base}_{number}"
        self._taken.add(candidate)
        if number > 1:
            self.numbered[candidate] = base
        return candidate
