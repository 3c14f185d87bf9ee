"""Local states by components: states of regions, values of variables, deadlines of timers.

A notation with variables expresses a local state by its components, so that a move names only its
changes. With a number for the whole state it would need a move for each value of all the rest.

Sets of local states are covered by cubes, as few as a greedy search finds. Combinations that are no
local state may be in a cube or not: they never occur, since each move leads from a local state to
another. So a set is covered by prime implicants with these as don't-cares (McCluskey, Minimization
of Boolean Functions, 1956), one at a time for the uncovered rest.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import groupby
from operator import and_

from fsmkit.chart.chart import Chart
from fsmkit.export.identifiers import word
from fsmkit.export.local_states import ARMED_FIRST, Fact, Key, facts_of
from fsmkit.export.network import Network
from fsmkit.runtime.interpreter.snapshot import Snapshot

Code = tuple[int, ...]
"""A local state: a number for each component."""
Cube = Mapping[int, frozenset[int]]
"""For components, in their order, the values that they may have; the others may have any."""
FEW = 3
"""So many values are listed one by one."""
NUMBERS = frozenset(map(str, range(256)))
"""Values that are their own words."""
TRUTH = ["false", "true"]


@dataclass(frozen=True, slots=True)
class Component:
    """A part of local states. ``texts``: the meaning of its numbers; ``words``: as identifiers.

    ``plain``: the word is the number itself, or ``true`` or ``false``.
    """

    name: str
    texts: Mapping[int, str]
    words: Mapping[int, str]
    plain: bool

    def note(self, number: int) -> str:
        """Return the meaning of a number, if its word does not show it."""
        text = self.texts[number]
        return "" if text.replace(" ", "_") == self.words[number] else text


ABSENT = Fact((-1, 0), "none")
"""A region that is not active, a timer that is not armed."""


def components_of(
    chart: Chart, snapshots: Sequence[Snapshot], *, untimed: bool
) -> tuple[tuple[Component, ...], tuple[Code, ...]]:
    """Return the components in which local states differ, and each local state by them."""
    found = [dict(facts_of(chart, snapshot, untimed=untimed)) for snapshot in snapshots]
    columns: dict[Key, list[Fact]] = {}
    for key in dict.fromkeys(key for facts in found for key in facts):
        column = [facts.get(key, ABSENT) for facts in found]
        if len(set(column)) > 1:
            columns[key] = column
    others = [column for key, column in columns.items() if key != ARMED_FIRST]
    if len(set(zip(*others, strict=True))) == len(snapshots):
        columns.pop(ARMED_FIRST, None)
    numbered = [_number_values(key[0], column) for key, column in columns.items()]
    codes = list(zip(*(numbers for _, numbers in numbered), strict=True)) if numbered else [()]
    if len(set(codes)) < len(snapshots):
        raise AssertionError("two local states have the same components")
    return tuple(component for component, _ in numbered), tuple(codes)


def _number_values(name: str, column: Sequence[Fact]) -> tuple[Component, list[int]]:
    """Return a component, and its number in each local state; whole numbers are kept."""
    values = sorted(set(column), key=lambda fact: fact.rank)
    texts = [fact.text for fact in values]
    if set(texts) <= NUMBERS and len(set(texts)) == len(texts):
        numbers = {fact: int(fact.text) for fact in values}
        plain = True
    else:
        numbers = {fact: number for number, fact in enumerate(values)}
        plain = texts == TRUTH
    words: dict[str, None] = {}
    for text in texts:
        chosen = text if plain else word(text)
        while chosen in words:
            chosen += "_"
        words[chosen] = None
    meaning = dict(zip(numbers.values(), texts, strict=True))
    names = dict(zip(numbers.values(), words, strict=True))
    return Component(name, meaning, names, plain), [numbers[fact] for fact in column]


class Cubes:
    """The local states of a machine, as sets: bit n of a mask is the local state n."""

    def __init__(self, codes: Sequence[Code]) -> None:
        """Compute the mask of each value of each component."""
        self._codes = codes
        self._all = (1 << len(codes)) - 1
        self._masks: list[dict[int, int]] = []
        for component in range(len(codes[0])):
            members: dict[int, list[int]] = {}
            for number, code in enumerate(codes):
                members.setdefault(code[component], []).append(number)
            self._masks.append({value: _mask(found) for value, found in sorted(members.items())})

    def cover(self, locals_: Collection[int]) -> list[Cube]:
        """Return cubes that hold exactly these local states."""
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
        """Return a maximal cube around a local state, disjoint from ``outside``, and its members.

        Values that no member has are removed, for the reader.
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


class Parts:
    """By machine: ``components``, and ``codes``, its local states by them."""

    def __init__(self, network: Network) -> None:
        """Split the local states into components."""
        charts = network.closed.charts
        found = [
            components_of(
                chart,
                [local.snapshot for local in automaton.locals],
                untimed=network.closed.untimed,
            )
            for chart, automaton in zip(charts, network.automata, strict=True)
        ]
        self.components = tuple(components for components, _ in found)
        self.codes = tuple(codes for _, codes in found)
        self._cubes = tuple(map(Cubes, self.codes))

    def cover(self, machine: int, locals_: Collection[int]) -> list[Cube] | None:
        """Return cubes that hold exactly these local states; None for all local states."""
        if len(set(locals_)) == len(self.codes[machine]):
            return None
        return self._cubes[machine].cover(locals_)

    def excluded(self, machine: int, component: int, values: Collection[int]) -> int | None:
        """Return the only value of a component that is not in ``values``."""
        others = [n for n in self.components[machine][component].texts if n not in values]
        return others[0] if len(others) == 1 < len(values) else None

    def runs(self, machine: int, component: int, values: Collection[int]) -> list[tuple[int, int]]:
        """Return the first and the last of each run of values; few are listed one by one."""
        every = sorted(self.components[machine][component].texts)
        chosen = [place for place, number in enumerate(every) if number in values]
        found: list[tuple[int, int]] = []
        for _, group in groupby(enumerate(chosen), key=lambda pair: pair[1] - pair[0]):
            run = [every[place] for _, place in group]
            found += [(n, n) for n in run] if len(run) <= FEW else [(run[0], run[-1])]
        return found
