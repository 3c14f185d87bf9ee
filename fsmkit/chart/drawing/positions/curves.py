"""Cubic curves of arrows: their points, and where they leave a box."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fsmkit.chart.drawing.positions.placement import Arrow, Rect

LENGTH = 7.0
"""Points of an arrowhead."""
STEPS = 6
"""Points of a curve between two of its ends, by which its course is known."""
Point = tuple[float, float]
Curve = tuple[Point, Point, Point, Point]


def curves_of(points: Sequence[Point]) -> Iterator[Curve]:
    """Yield the curves between the ends in a list of control points."""
    return zip(points[0::3], points[1::3], points[2::3], points[3::3], strict=False)


def points_of(curves: Sequence[Curve]) -> tuple[Point, ...]:
    """Return the control points of curves that follow each other."""
    return (curves[0][0], *(point for curve in curves for point in curve[1:]))


def bezier(curve: Curve, t: float) -> Point:
    """Return the point of a curve at a parameter from 0 to 1."""
    (ax, ay), (bx, by), (cx, cy), (dx, dy) = curve
    u = 1 - t
    a, b, c, d = u * u * u, 3 * u * u * t, 3 * u * t * t, t * t * t
    return a * ax + b * bx + c * cx + d * dx, a * ay + b * by + c * cy + d * dy


def along(arrow: Arrow) -> tuple[Point, ...]:
    """Return points of an arrow from its start to its end, with its tips."""
    tips = {end: (x, y) for end, x, y in arrow.heads}
    first = (tips["s"],) if "s" in tips else ()
    curves = [*curves_of(arrow.points)]
    inner = (bezier(curve, step / STEPS) for curve in curves for step in range(STEPS))
    last = (tips["e"],) if "e" in tips else ()
    return (*first, *inner, *arrow.points[-1:], *last)


def moved(arrow: Arrow, dx: float, dy: float) -> Arrow:
    """Return an arrow at another place."""
    return Arrow(
        tuple((x + dx, y + dy) for x, y in arrow.points),
        tuple((end, x + dx, y + dy) for end, x, y in arrow.heads),
        None if arrow.label is None else (arrow.label[0] + dx, arrow.label[1] + dy),
    )


def reversed_curves(curves: Sequence[Curve]) -> list[Curve]:
    """Return the same curves from the end to the start."""
    return [(d, c, b, a) for a, b, c, d in reversed(curves)]


def cut_start(
    curves: list[Curve], border: Rect, tip: Point | None
) -> tuple[list[Curve], Point | None]:
    """Cut the start of curves off where they leave a box; return them and the new tip."""
    for number, curve in enumerate(curves):
        if border.holds(*curve[3]):
            continue
        if not border.holds(*curve[0]):
            break
        low, high = 0.0, 1.0
        for _ in range(20):
            middle = (low + high) / 2
            low, high = (middle, high) if border.holds(*bezier(curve, middle)) else (low, middle)
        rest = [_rest(curve, low), *curves[number + 1 :]]
        return (rest, None) if tip is None else (_shorten(rest), bezier(curve, low))
    return curves, tip


def _shorten(curves: list[Curve]) -> list[Curve]:
    """Start curves an arrowhead later."""
    start = curves[0][0]
    for number, curve in enumerate(curves):
        if _distance(start, curve[3]) < LENGTH and number + 1 < len(curves):
            continue
        low, high = 0.0, 0.9
        for _ in range(20):
            middle = (low + high) / 2
            is_near = _distance(start, bezier(curve, middle)) < LENGTH
            low, high = (middle, high) if is_near else (low, middle)
        return [_rest(curve, low), *curves[number + 1 :]]
    return curves


def _distance(one: Point, other: Point) -> float:
    return float(((one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2) ** 0.5)


def _rest(curve: Curve, t: float) -> Curve:
    """Return the part of a curve after a parameter (de Casteljau)."""
    a, b, c, d = curve

    def mix(p: Point, q: Point) -> Point:
        return p[0] + (q[0] - p[0]) * t, p[1] + (q[1] - p[1]) * t

    ab, bc, cd = mix(a, b), mix(b, c), mix(c, d)
    abc, bcd = mix(ab, bc), mix(bc, cd)
    return mix(abc, bcd), bcd, cd, d
