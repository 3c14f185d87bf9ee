"""Printed definitions, of which unreferenced ones are omitted."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Set as AbstractSet
from typing import Protocol


class Definition(Protocol):
    """A definition, and the links to it by its name."""

    @property
    def name(self) -> str | None:
        """The name that it defines, or None if no other definition refers to it."""

    @property
    def names(self) -> AbstractSet[str]:
        """The names that it uses."""


def reached(definitions: Iterable[Definition], names: Iterable[str]) -> set[str]:
    """Return the names of the definitions that some names need, directly or not."""
    by_name: dict[str, list[Definition]] = {}
    for definition in definitions:
        if definition.name is not None:
            by_name.setdefault(definition.name, []).append(definition)
    found: set[str] = set()
    waiting = [name for name in names if name in by_name]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            for definition in by_name[name]:
                waiting += [each for each in definition.names if each in by_name]
    return found
