"""One body for all copies of a used chart: handlers that differ in numbers and data are one.

States of a chart follow each other in document order, so copies of equal size have numbers that
differ by a constant; so have their transitions and events. What the copies do is compared as typed
trees (`small.differences`), and the shared body is printed from the tree of the first copy, with
names that compute from ``copy``, the number of the copy (`small.together`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import NARROW, Names
from fsmkit.codegen.c.small.differences import Unlike, unified
from fsmkit.codegen.c.small.together import COPY, Defined, Together
from fsmkit.document.document import Kind
from fsmkit.emit import Emitter

__all__ = ["COPY", "Alike", "Place", "Shared", "copies_of"]

Lines = tuple[str, ...]
Shape = tuple[tuple[Kind, int, int], ...]
"""Of each state of a copy: its kind, how many transitions and children it has."""
LINE, READ, TABLE = 12, 12, 16
"""Bytes of a line or a call, of a body that computes with `COPY`, of reading that from a table
(Cortex-M0, gcc -Os, on the average); an entry of the table is one byte."""
Print = Callable[[Emitter, Together, Any], None]
"""Prints a tree with the names that it is given."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where something stands in a copy: equal in all copies of a group but for ``copy``."""

    group: int
    copy: int
    inner: tuple[int, ...]


def copies_of(chart: Chart) -> tuple[tuple[tuple[int, ...], int], ...]:
    """Return the groups of copies: their states, in document order, and how many states each has.

    Copies of a group are of one chart and have as many states; their numbers differ by a constant.
    """
    kinds: dict[tuple[str, Shape], list[int]] = {}
    for copy in chart.copies:
        states = chart.states[copy.state : chart.states[copy.state].last_descendant + 1]
        shape = tuple((s.kind, len(s.transitions), len(s.children)) for s in states)
        kinds.setdefault((copy.chart, shape), []).append(copy.state)
    groups = []
    taken: set[int] = set()
    for (_, shape), found in sorted(kinds.items(), key=lambda each: each[1][0]):
        bases = [base for base in found if base not in taken]
        step = bases[1] - bases[0] if len(bases) > 1 else 0
        evenly = [base for n, base in enumerate(bases) if base == bases[0] + n * step]
        if 1 < len(evenly) <= NARROW:
            groups.append((tuple(evenly), len(shape)))
            taken |= {base + n for base in evenly for n in range(len(shape))}
    return tuple(groups)


@dataclass(frozen=True, slots=True)
class Shared:
    """The body of several copies."""

    lines: Lines
    reads: bool
    """Whether it reads `COPY`."""
    cost: int
    """Lines that a body of one copy does not have."""


class Alike:
    """Merges the bodies of copies of one machine."""

    def __init__(self, names: Names, functions: Unit) -> None:
        """Begin; ``functions``: where those that bodies share are defined."""
        self._names = names
        self._functions = functions
        self._groups = copies_of(names.chart) if names.chart.copies else ()
        self._defined: Defined = {}

    def place(self, state: int, *more: int) -> Place | None:
        """Return where a state stands, or something of it; None outside of copies."""
        for group, (bases, size) in enumerate(self._groups):
            for copy, base in enumerate(bases):
                if base <= state < base + size:
                    return Place(group, copy, (state - base, *more))
        return None

    def transition(self, index: int) -> Place | None:
        """Return where a transition stands."""
        chart = self._names.chart
        source = chart.transitions[index].source
        own = chart.states[source].transitions
        return self.place(source, 1, own.index(index)) if index in own else None

    def copies(self, places: Sequence[Place | None]) -> list[int]:
        """Return the numbers of copies; 0 outside of them."""
        return [0 if place is None else place.copy for place in places]

    def merge(
        self,
        bodies: Mapping[int, Lines],
        places: Mapping[int, Place | None],
        tree: Callable[[int], object | None],
        print_: Print,
    ) -> tuple[list[tuple[list[int], Lines]], bool]:
        """Return bodies with all whose they are, and whether any reads ``copy``.

        Args:
            bodies: The lines of each, by what they are of.
            places: Where that stands.
            tree: What is printed of it; None for what is never shared.
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
            whole = place is not None and len(members) == len(self._groups[place.group][0])
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
        """Return the body that does for each copy what its own tree says; None if there is none."""
        if None in trees:
            return None
        out = Emitter()
        try:
            tree, found = unified(self._names.chart, trees)
            names = Together.of(self._names, found, self._functions, self._defined)
            print_(out, names, tree)
        except Unlike:
            return None
        return Shared(out.collected(), names.reads, names.cost)
