"""A source as definitions that know what they refer to.

While a source is printed, a name of the machine's own is a symbol: `OWN` or `OWN_UPPER` stands for
the prefix, ``f"{OWN}_stop"`` for the function ``stop``. So a definition knows all names that its
lines refer to, whoever made those lines and wherever they were kept meanwhile; what no other
definition reaches is left out, and the prefix is spelt at the very end. The marks are control
characters, which no text of a chart brings along (`fsmkit.emit.lines`).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from fsmkit.codegen.definitions import reached
from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.emit import Emitter

OWN, OWN_UPPER = "\x01", "\x02"
"""The prefix of the machine's names, and that of its macros and constants."""
_SYMBOL = re.compile(f"[{OWN}{OWN_UPPER}]_([A-Za-z0-9_]+)")


@fast_init
@dataclass(frozen=True, slots=True)
class Definition:
    """Lines with symbols, what they define, and the names of the machine that they refer to."""

    name: str | None
    """Without the prefix; None where others may refer to it: it is always there."""
    lines: tuple[str, ...]
    names: frozenset[str]


class Unit(Emitter):
    """Definitions, one after the other."""

    def __init__(self) -> None:
        """Begin with lines that are always there."""
        super().__init__()
        self._ended: list[Definition] = []
        self._name: str | None = None

    def define(self, name: str | None = None) -> None:
        """Let what is added from here on be a definition; the one before it ends.

        ``name``: of what it defines, if nothing outside refers to it; its prefix may be left out.
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
        """Return all that was added."""
        self.define()
        return self._ended


def reachable(definitions: Iterable[Definition]) -> Iterator[Definition]:
    """Yield, in their order, the definitions that are always there and all that these need."""
    found = list(definitions)
    roots = (name for each in found if each.name is None for name in each.names)
    needed = reached(found, roots)
    return (each for each in found if each.name is None or each.name in needed)


def spelt(definitions: Iterable[Definition], lower: str, upper: str) -> str:
    """Return the text of definitions with the prefixes in, one empty line between any two."""
    lines: list[str] = []
    for each in definitions:
        for line in each.lines:
            if line or (lines and lines[-1]):
                lines.append(line)
    while lines and not lines[-1]:
        lines.pop()
    return "\n".join(lines).replace(OWN, lower).replace(OWN_UPPER, upper) + "\n"
