"""One body for all copies of a used chart.

The instances of the Plan are compared as typed trees (`small.differences`). The shared body is
printed from the tree of the first copy. Its names are computed from ``copy``, the number of the
copy (`small.copy_names`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.small.copy_names import COPY, CopyNames, Defined
from fsmkit.codegen.c.small.differences import NotMergeable, unified
from fsmkit.emit import Emitter
from fsmkit.plan.instances import Instance

__all__ = ["COPY", "BodyMerger", "Shared"]

Lines = tuple[str, ...]
LINE, READ, TABLE = 12, 12, 16
"""Bytes of a line or a call, of a body that computes with `COPY`, and of a table look-up
(Cortex-M0, gcc -Os, on the average). An entry of the table is one byte.
"""
Print = Callable[[Emitter, CopyNames, Any], None]
"""Prints a tree with given names."""


@dataclass(frozen=True, slots=True)
class Shared:
    """The body of several copies."""

    lines: Lines
    reads: bool
    """Whether it reads `COPY`."""
    cost: int
    """Lines that the body of a single copy does not have."""


class BodyMerger:
    """Merges the bodies of copies of one machine."""

    def __init__(self, names: Names, functions: Unit) -> None:
        """Create a merger; ``functions``: the unit for functions that bodies call."""
        self._names = names
        self._functions = functions
        self._groups = names.plan.instances.groups
        self._defined: Defined = {}

    def merge(
        self,
        bodies: Mapping[int, Lines],
        places: Mapping[int, Instance | None],
        tree: Callable[[int], object | None],
        print_: Print,
    ) -> tuple[list[tuple[list[int], Lines]], bool]:
        """Return bodies with their members, and whether any reads ``copy``.

        Args:
            bodies: The lines of each body, by its number.
            places: The instance that contains the body, by its number.
            tree: Returns the tree of a body; None for a body that is never shared.
            print_: Prints a tree.

        """
        alike: dict[object, list[int]] = {}
        unmerged: dict[Lines, list[int]] = {}
        for index, lines in bodies.items():
            unmerged.setdefault(lines, []).append(index)
        for index in bodies:
            place = places.get(index)
            key = ("", index) if place is None else (place.group, place.inner)
            alike.setdefault(key, []).append(index)
        found: dict[Lines, list[int]] = {}
        reads, saved = False, -TABLE - len(self._names.chart.states)
        for members in alike.values():
            place = places.get(members[0])
            whole = place is not None and len(members) == len(self._groups[place.group].bases)
            together = self._together([tree(m) for m in members], print_) if whole else None
            if together is None:
                for member in members:
                    found.setdefault(bodies[member], []).append(member)
                continue
            if together.reads:
                reads = True
                saved += (len(members) - 1) * len(bodies[members[0]]) * LINE - READ
                saved -= together.cost * LINE
            found.setdefault(together.lines, []).extend(members)
        if reads and saved < 0:
            found, reads = unmerged, False
        return [(sorted(members), lines) for lines, members in found.items()], reads

    def _together(self, trees: Sequence[object | None], print_: Print) -> Shared | None:
        """Return the body that all copies can share, or None."""
        if None in trees:
            return None
        out = Emitter()
        try:
            tree, found = unified(self._names.chart, trees)
            names = CopyNames.create(self._names, found, self._functions, self._defined)
            print_(out, names, tree)
        except NotMergeable:
            return None
        return Shared(out.collected(), names.reads, names.cost)
