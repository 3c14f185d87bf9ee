"""Place the texts beside arrows and nodes where they cover nothing."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from fsmkit.chart.drawing.positions.curves import Point, along
from fsmkit.chart.drawing.positions.placement import Arrow, Rect

BESIDE = 3.0
"""Points between an arrow and its label."""
PARTS = (0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8)
"""Where along an arrow its label can be, the best first."""
COVERED, ON_BORDER, CROSSED, LATER = 20.0, 10.0, 2.0, 0.1
"""The cost of a box or a text below a label, a border, an arrow, and of a later candidate."""
NEAR = 12.0
"""Points around an arrow in which its label may be, besides the size of the label."""


class Obstacles:
    """What the texts of a drawing should not cover."""

    def __init__(
        self, boxes: Iterable[Rect], borders: Iterable[Rect], arrows: Iterable[Arrow]
    ) -> None:
        """Take boxes, borders of composite states, and arrows; texts follow one by one."""
        self.boxes = [*boxes]
        self._borders = [*borders]
        self._arrows = [(_around(arrow.points), arrow) for arrow in arrows]
        self._courses: list[tuple[Rect, Sequence[Point]]] = []

    def near(self, area: Rect) -> Obstacles:
        """Return what is in an area."""
        found = Obstacles((), (), ())
        found.boxes = [box for box in self.boxes if box.meets(area)]
        found._borders = [box for box in self._borders if box.meets(area)]
        near = (arrow for around, arrow in self._arrows if around.meets(area, NEAR))
        found._courses = [(_around(points), points) for points in map(along, near)]
        return found

    def cost(self, text: Rect) -> float:
        """Return how much a text would cover."""
        cost = COVERED * sum(box.meets(text) for box in self.boxes)
        for border in self._borders:
            is_inside = border.holds(text.x, text.y) and border.holds(text.right, text.bottom)
            cost += ON_BORDER * (not is_inside and border.meets(text))
        for around, points in self._courses:
            if around.meets(text, 1):
                cost += CROSSED * any(text.holds(x, y) for x, y in points)
        return cost


def label_place(arrow: Arrow, width: float, height: float, obstacles: Obstacles) -> Point:
    """Return the middle of the label of an arrow."""
    points = along(arrow)
    around = _around(points)
    near = obstacles.near(
        Rect(
            around.x - width - NEAR, around.y - height - NEAR,
            around.width + 2 * (width + NEAR), around.height + 2 * (height + NEAR),
        )
    )  # fmt: skip
    return _best(_beside_arrow(points, width, height), width, height, near)


def _beside_arrow(points: Sequence[Point], width: float, height: float) -> Iterator[Point]:
    for part in PARTS:
        number = min(int(part * (len(points) - 1)), len(points) - 2)
        rest = part * (len(points) - 1) - number
        (x1, y1), (x2, y2) = points[number], points[number + 1]
        x, y = x1 + (x2 - x1) * rest, y1 + (y2 - y1) * rest
        across, down = width / 2 + BESIDE, height / 2 + BESIDE
        if abs(x2 - x1) > 2 * abs(y2 - y1):
            yield from ((x, y - down), (x, y + down))
        else:
            yield from ((x + across, y), (x - across, y))


def text_place(box: Rect, width: float, height: float, obstacles: Obstacles) -> Point:
    """Return the middle of the text beside a node."""
    x, y = box.centre
    left, right = box.x - width / 2 - 1, box.right + width / 2 + 1
    above, below = box.y - height / 2 + BESIDE, box.bottom + height / 2 - BESIDE
    spots = ((left, above), (right, above), (right, below), (left, below), (right, y), (left, y))
    reach = Rect(box.x - width, box.y - height, box.width + 2 * width, box.height + 2 * height)
    return _best(iter((*spots, (x, above - BESIDE))), width, height, obstacles.near(reach))


def _best(spots: Iterator[Point], width: float, height: float, obstacles: Obstacles) -> Point:
    best, least = (0.0, 0.0), float("inf")
    for number, (x, y) in enumerate(spots):
        cost = LATER * number
        if cost >= least:
            break
        cost += obstacles.cost(Rect(x - width / 2, y - height / 2, width, height))
        if cost < least:
            best, least = (x, y), cost
    return best


def _around(points: Sequence[Point]) -> Rect:
    xs, ys = [x for x, _ in points], [y for _, y in points]
    return Rect(min(xs), min(ys), max(xs) - min(xs), max(ys) - min(ys))
