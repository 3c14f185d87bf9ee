"""A source as definitions with their references.

The printed source contains a symbol for each name of the machine's own. `OWN` or `OWN_UPPER` is the
prefix, ``f"{OWN}_stop"`` the function ``stop``. A definition therefore has all names that its lines
refer to, whatever printed them.

`reachable` omits unreferenced definitions, and `resolve_prefixes` finally inserts the prefix. The
symbols use control characters, which the texts of a chart never contain (`fsmkit.emit.lines`).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from fsmkit.codegen.definitions import reached
from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.emit import Emitter

OWN, OWN_UPPER = "\x01", "\x02"
"""The symbols for the prefix of the machine's names, and for that of its macros and constants."""
_SYMBOL = re.compile(f"[{OWN}{OWN_UPPER}]_([A-Za-z0-9_]+)")


@fast_init
@dataclass(frozen=True, slots=True)
class Definition:
    """Lines with symbols, the name that they define, and the names that they refer to."""

    name: str | None
    """The name without the prefix; None for a definition that is always kept."""
    lines: tuple[str, ...]
    names: frozenset[str]


class Unit(Emitter):
    """A sequence of definitions."""

    def __init__(self) -> None:
        """Start with lines that are always kept."""
        super().__init__()
        self._ended: list[Definition] = []
        self._name: str | None = None

    def define(self, name: str | None = None) -> None:
        """Start a definition, which ends where the next starts.

        ``name``: the name that it defines, with or without the prefix, if only the machine uses it.
        """
        if self._lines:
            names = frozenset(_SYMBOL.findall("\n".join(self._lines)))
            self._ended.append(Definition(self._name, tuple(self._lines), names))
            self._lines.clear()
        self._name = None if name is None else name.removeprefix(f"{OWN}_")

    def include(self, other: Unit) -> None:
        """Add all definitions of another unit."""
        self.define()
        self._ended += other.definitions()

    def definitions(self) -> list[Definition]:
        """Return all definitions."""
        self.define()
        return self._ended


def reachable(definitions: Iterable[Definition]) -> Iterator[Definition]:
    """Yield, in their order, the definitions that are always kept, and those that they need."""
    found = list(definitions)
    roots = (name for each in found if each.name is None for name in each.names)
    needed = reached(found, roots)
    return (each for each in found if each.name is None or each.name in needed)


def resolve_prefixes(definitions: Iterable[Definition], lower: str, upper: str) -> str:
    """Return the text of definitions with the prefixes inserted and one empty line between two."""
    lines: list[str] = []
    for each in definitions:
        for line in each.lines:
            if line or (lines and lines[-1]):
                lines.append(line)
    while lines and not lines[-1]:
        lines.pop()
    return "\n".join(lines).replace(OWN, lower).replace(OWN_UPPER, upper) + "\n"
