"""The bends of a line: as few as show its way."""

from __future__ import annotations

from collections.abc import Sequence

from fsmkit.export.uppaal.network import Point

TOLERANCE = 3.0
"""Pixels by which a line may leave its way."""


def straightened(points: Sequence[Point]) -> tuple[Point, ...]:
    """Return the points between the ends of a line that it needs (Ramer, Douglas and Peucker)."""
    if len(points) < 3:
        return ()
    far, place = max((_distance(p, points[0], points[-1]), n) for n, p in enumerate(points))
    if far <= TOLERANCE:
        return ()
    return (
        *straightened(points[: place + 1]),
        points[place],
        *straightened(points[place:]),
    )


def _distance(point: Point, start: Point, end: Point) -> float:
    """Return how far a point is from the line between two others."""
    (x, y), (x1, y1), (x2, y2) = point, start, end
    dx, dy = x2 - x1, y2 - y1
    length = (dx * dx + dy * dy) ** 0.5
    if length == 0:
        return float(((x - x1) ** 2 + (y - y1) ** 2) ** 0.5)
    along = max(0.0, min(1.0, ((x - x1) * dx + (y - y1) * dy) / length**2))
    return float(((x - x1 - along * dx) ** 2 + (y - y1 - along * dy) ** 2) ** 0.5)
