"""Sets of local states by their components: as few conjunctions as a greedy search finds.

A cube says of some components which values they may have. What no local state is made of may be in
it or not: such combinations never come up, since each move leads from a local state to another. So
a set is covered by prime implicants with these as don't-cares (McCluskey, Minimization of Boolean
Functions, 1956), one for what is not yet covered at a time.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import reduce
from operator import and_

from fsmkit.export.components import Code

Cube = Mapping[int, frozenset[int]]
"""For components, in their order, the values that they may have; the others may have any."""


class Cubes:
    """The local states of a machine, as sets: bit n of a mask is the local state n."""

    def __init__(self, codes: Sequence[Code]) -> None:
        """Make the mask of each value of each component."""
        self._codes = codes
        self._all = (1 << len(codes)) - 1
        self._masks: list[dict[int, int]] = []
        for component in range(len(codes[0])):
            members: dict[int, list[int]] = {}
            for number, code in enumerate(codes):
                members.setdefault(code[component], []).append(number)
            self._masks.append({value: _mask(found) for value, found in sorted(members.items())})

    def cover(self, locals_: Collection[int]) -> list[Cube]:
        """Return cubes that hold these local states and no others."""
        left = _mask(locals_)
        outside = self._all & ~left
        found = []
        while left:
            first = (left & -left).bit_length() - 1
            cube, members = self._widened(self._codes[first], outside)
            found.append(cube)
            left &= ~members
        return found

    def _widened(self, code: Code, outside: int) -> tuple[Cube, int]:
        """Return a largest cube around a local state, of none outside, and its members.

        A value that no member would have is not in it: it would only puzzle who reads that.
        """
        kept = {n: masks[code[n]] for n, masks in enumerate(self._masks)}
        for component in reversed(list(kept)):
            rest = self._all_of(kept, component)
            if not rest & outside:
                del kept[component]
        cube: dict[int, frozenset[int]] = {}
        for component in reversed(list(kept)):
            rest = self._all_of(kept, component)
            values = {
                value: mask
                for value, mask in self._masks[component].items()
                if rest & mask and not rest & mask & outside
            }
            kept[component] = reduce(lambda a, b: a | b, values.values())
            cube[component] = frozenset(values)
        return dict(sorted(cube.items())), self._all_of(kept)

    def _all_of(self, kept: Mapping[int, int], but: int = -1) -> int:
        return reduce(and_, (mask for n, mask in kept.items() if n != but), self._all)


def _mask(numbers: Collection[int]) -> int:
    bits = bytearray(max(numbers, default=0) // 8 + 1)
    for number in numbers:
        bits[number // 8] |= 1 << number % 8
    return int.from_bytes(bits, "little")
