"""Group steps of a machine that change components alike, so that one statement expresses them.

Separately, the steps of a chart with an unrestricted environment are more than tools read.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from fsmkit.export.components import Code
from fsmkit.export.network import Automaton, Move

Change = Mapping[int, int]
"""For components, their values afterwards."""


@dataclass(frozen=True, slots=True)
class Joint:
    """Moves with the same effect, from different local states, that change components alike."""

    moves: tuple[Move, ...]
    change: Change

    @property
    def sources(self) -> frozenset[int]:
        """The local states in which they start."""
        return frozenset(move.source for move in self.moves)


def joint_moves(
    automaton: Automaton, codes: Sequence[Code], *, named: bool = False
) -> tuple[Joint, ...]:
    """Return the moves of a machine grouped by their effects and their changes.

    ``named``: only moves of one label are grouped, and at most one per local state. A local state
    then has as many steps as moves.
    """
    groups: dict[Hashable, list[Move]] = {}
    counts: Counter[Hashable] = Counter()
    for move in automaton.moves:
        key: Hashable = automaton.signature(move)
        if named:
            counts[move.source, move.label, key] += 1
            key = move.label, key, counts[move.source, move.label, key]
        groups.setdefault(key, []).append(move)
    found: list[Joint] = []
    for group in groups.values():
        steps = [(move.source, move.target) for move in group]
        for change, places in changes(codes, steps):
            found.append(Joint(tuple(group[place] for place in places), change))
    return tuple(found)


def changes(
    codes: Sequence[Code], steps: Sequence[tuple[int, int]], but: Collection[int] = ()
) -> Iterator[tuple[Change, list[int]]]:
    """Yield the changes of steps between local states, and the steps with exactly this change.

    A step that changes less counts as one that changes more, if the result is the same. ``but``:
    omitted components.
    """
    exact: dict[tuple[tuple[int, int], ...], list[int]] = {}
    for place, (before, after) in enumerate(steps):
        pairs = enumerate(zip(codes[before], codes[after], strict=True))
        change = tuple((n, new) for n, (old, new) in pairs if old != new and n not in but)
        exact.setdefault(change, []).append(place)
    left = dict.fromkeys(sorted(exact, key=len))
    while left:
        change, _ = left.popitem()
        values = dict(change)
        places = exact[change]
        for smaller in list(left):
            if not all(values.get(n) == new for n, new in smaller):
                continue
            fits = {p for p in exact[smaller] if _has(codes[steps[p][1]], change)}
            places += fits
            exact[smaller] = [p for p in exact[smaller] if p not in fits]
            if not exact[smaller]:
                del left[smaller]
        yield values, sorted(places)


def _has(code: Code, change: Iterable[tuple[int, int]]) -> bool:
    return all(code[n] == value for n, value in change)


def shifting_components(
    codes: Sequence[Code], steps: Sequence[tuple[int, int]]
) -> dict[int, dict[int, set[int]]]:
    """Return the components that steps change as functions of themselves: shift and sources.

    Values from which a component does not change are omitted.
    """
    found: dict[int, dict[int, set[int]]] = {}
    for component in range(len(codes[0])):
        values = {(codes[before][component], codes[after][component]) for before, after in steps}
        if len({old for old, _ in values}) < len(values) or all(old == new for old, new in values):
            continue
        shifts = found.setdefault(component, {})
        for old, new in sorted(values):
            if old != new:
                shifts.setdefault(new - old, set()).add(old)
    return found
