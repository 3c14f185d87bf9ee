"""Conserved sums of a ring: candidates from a short ring, and the proof by windows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fsmkit.verify.any_number.cells import Ring
from fsmkit.verify.any_number.conserved import Cell, Weights, change, conserved_weights
from fsmkit.verify.any_number.windows import Windows

MOST_SAMPLES = 1500
"""States of the short ring that are visited."""


def candidates(ring: Ring) -> list[Weights]:
    """Return weights whose sum is constant in the first states of a short ring."""
    steps = ring.steps
    todo = [edge.to for edge in steps.initial()]
    if len(todo) != 1:
        return []  # other initial states may have other sums
    start, seen = todo[0], set(todo)
    equations: dict[tuple[tuple[Cell, int], ...], None] = {}
    cells: set[Cell] = set()
    for state in todo:  # grows
        before = [(ring.kind(p), ring.cell(p, state)) for p in range(ring.length)]
        cells.update(before)
        for edge in steps.successors(state):
            after = [(ring.kind(p), ring.cell(p, edge.to)) for p in range(ring.length)]
            equations[tuple(sorted(change(before, after).items()))] = None
            cells.update(after)
            if edge.to not in seen and len(seen) < MOST_SAMPLES:
                seen.add(edge.to)
                todo.append(edge.to)
    first = [(ring.kind(p), ring.cell(p, start)) for p in range(ring.length)]
    own = conserved_weights(
        map(dict, equations), cells, [cell for cell in first if cell[0] == 0], first
    )
    return [*_common(list(map(dict, equations)), cells, first), *own]


def _common(equations: list[dict[Cell, int]], cells: set[Cell], first: list[Cell]) -> list[Weights]:
    """Return weights that do not depend on the position of a cell."""
    joined = []
    for each in equations:
        row: dict[Cell, int] = {}
        for (_, cell), count in each.items():
            row[0, cell] = row.get((0, cell), 0) + count
        joined.append(row)
    zero = [cell for cell in first if cell[0] == 0]
    found = conserved_weights(
        joined, {(0, cell) for _, cell in cells}, zero, [(0, cell) for _, cell in first]
    )
    return [replace(weights, is_common=True) for weights in found]


def not_conserved(windows: Windows) -> set[int]:
    """Return the places of the weights of a set of windows whose sum some step changes."""
    ring, reach = windows.ring, windows.reach
    found: set[int] = set()

    def compare(before: Sequence[Cell], after: Sequence[Cell]) -> None:
        for place, weights in enumerate(windows.weights):
            if sum(weights.at(*cell) for cell in before) != sum(
                weights.at(*cell) for cell in after
            ):
                found.add(place)

    for segment in windows.segments(2 * reach + 1) if windows.weights else ():
        kinds = [ring.kind(segment.start + n) for n in range(len(segment.cells))]
        before = list(zip(kinds, segment.cells, strict=True))
        for move in windows.possible_moves(segment.start, segment.cells, reach):
            after = windows.after(segment.start, segment.cells, reach, move)
            if after is not None:
                compare(before, list(zip(kinds, after, strict=True)))
    for start, known in zip(windows.starts, windows.known, strict=True):
        for cell in {window[0] for window in known} if ring.closed.unit else ():
            if not ring.facts(start, cell).busy:
                kind = ring.kind(start)
                compare([(kind, cell)], [(kind, ring.elapsed(start, cell))])
    return found
