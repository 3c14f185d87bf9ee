"""Moves what lies on something else a little aside."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fsmkit.export.uppaal.network import Point

Box = tuple[int, int, int, int]
"""Left, upper, right and lower bound, in pixels."""

ACROSS, DOWN, FARTHEST = 14, 17, 12
"""A step to the side and one down, and how many are tried."""


def overlap(one: Box, other: Box) -> bool:
    """Whether two boxes have more in common than a border."""
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def apart(fixed: Iterable[Box], movable: Sequence[Box]) -> list[Point]:
    """Return where the upper left corner of each movable box stands free of all others.

    One without a free place near it stays.
    """
    shifts = sorted(
        (
            (dx * ACROSS, dy * DOWN)
            for dx in range(-FARTHEST, FARTHEST + 1)
            for dy in range(-FARTHEST, FARTHEST + 1)
        ),
        key=lambda by: (abs(by[0]) + abs(by[1]), by),
    )
    taken = list(fixed)
    found = []
    for box in movable:
        moved = ((box[0] + x, box[1] + y, box[2] + x, box[3] + y) for x, y in shifts)
        free = (one for one in moved if not any(overlap(one, other) for other in taken))
        best = next(free, box)
        taken.append(best)
        found.append(best[:2])
    return found
