"""Sums over all cells of a ring that no step changes, such as the number of tokens.

A weight is a number for each cell, at an end or in the middle. The weights of a *conserved* sum
solve a system of linear equations: one for each step of a short ring. Cells in the middle start
with weight 0, so the sum is the same for every length of the ring. Windows alone do not count; with
a conserved sum that is never negative, they exclude a second token.

These are candidates. `prove` keeps those that every step from the windows conserves, where windows
with a greater sum are excluded; so the sums are invariants of all rings, by induction over steps.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from math import lcm

Cell = tuple[int, int]
"""The kind of a position (`Ring.kind`), and the cell there."""
Equation = Mapping[Cell, int]
MOST_CELLS = 250
"""Cells for which the equations are solved."""
COMBINED = {2: 16, 3: 8}
"""Solutions of a basis that are added, and the greatest basis for which they are."""
MOST_SUMS = 12
"""Sums that are returned, those with the least total and the most cells first."""
MOST_WEIGHT = 4
"""The greatest useful weight and sum."""


@dataclass(frozen=True, slots=True)
class Weights:
    """Weights of cells, never negative, and their sum in every reachable state of a ring."""

    by_cell: Mapping[Cell, int]
    total: int
    is_common: bool = False
    """A cell has the same weight at all positions."""

    def at(self, kind: int, cell: int) -> int:
        """Return the weight of a cell; a cell that never occurred has none."""
        return self.by_cell.get((0 if self.is_common else kind, cell), 0)


def change(before: Sequence[Cell], after: Sequence[Cell]) -> dict[Cell, int]:
    """Return how often each cell occurs more often after a step than before it."""
    found: dict[Cell, int] = {}
    for old, new in zip(before, after, strict=True):
        if old != new:
            found[new] = found.get(new, 0) + 1
            found[old] = found.get(old, 0) - 1
    return {cell: count for cell, count in found.items() if count}


def conserved_weights(
    equations: Iterable[Equation],
    cells: Iterable[Cell],
    zero: Iterable[Cell],
    start: Iterable[Cell],
) -> list[Weights]:
    """Return weights whose sum no step changes.

    Args:
        equations: For each step, how often each cell occurs after it, less how often before it.
        cells: All cells.
        zero: Cells that must have no weight.
        start: The cells of an initial state.

    """
    names = sorted(set(cells))
    if len(names) > MOST_CELLS:
        return []
    rows = [dict(each) for each in equations] + [{cell: 1} for cell in zero]
    basis = _solutions(rows, names)
    first = list(start)
    found: dict[tuple[int, ...], Weights] = {}
    for vector in _candidates(basis):
        whole = _whole(vector)
        if whole is None or min(whole) < 0 or max(whole) == 0 or max(whole) > MOST_WEIGHT:
            continue
        by_cell = {name: weight for name, weight in zip(names, whole, strict=True) if weight}
        total = sum(by_cell.get(cell, 0) for cell in first)
        if total <= MOST_WEIGHT:
            found[whole] = Weights(by_cell, total)
    by_use = sorted(found.values(), key=lambda weights: (weights.total, -len(weights.by_cell)))
    return by_use[:MOST_SUMS]


def _candidates(basis: list[list[Fraction]]) -> Iterable[list[Fraction]]:
    """Yield the solutions of a basis, their sums and differences."""
    signed = [[s * x for x in vector] for vector in basis for s in (1, -1)]
    yield from signed
    for size in (size for size, most in COMBINED.items() if len(basis) <= most):
        for chosen in combinations(signed, size):
            yield [sum(column, Fraction(0)) for column in zip(*chosen, strict=True)]


def _whole(vector: list[Fraction]) -> tuple[int, ...] | None:
    scale = lcm(*(x.denominator for x in vector)) if vector else 1
    return tuple(int(x * scale) for x in vector)


def _solutions(rows: list[dict[Cell, int]], names: list[Cell]) -> list[list[Fraction]]:
    """Return a basis of the solutions of homogeneous linear equations."""
    pivots: dict[Cell, dict[Cell, Fraction]] = {}
    for each in rows:
        row = {cell: Fraction(count) for cell, count in each.items() if count}
        for cell in [cell for cell in row if cell in pivots]:
            _subtract(row, pivots[cell], row.get(cell, Fraction(0)))
        if not row:
            continue
        pivot = min(row)
        scale = row[pivot]
        row = {cell: value / scale for cell, value in row.items()}
        for other in pivots.values():
            if pivot in other:
                _subtract(other, row, other[pivot])
        pivots[pivot] = row
    free = [name for name in names if name not in pivots]
    found = []
    for name in free:
        values = {name: Fraction(1)}
        for pivot, row in pivots.items():
            if name in row:
                values[pivot] = -row[name]
        found.append([values.get(cell, Fraction(0)) for cell in names])
    return found


def _subtract(row: dict[Cell, Fraction], other: Mapping[Cell, Fraction], factor: Fraction) -> None:
    if not factor:
        return
    for cell, value in other.items():
        left = row.get(cell, Fraction(0)) - factor * value
        if left:
            row[cell] = left
        else:
            row.pop(cell, None)
