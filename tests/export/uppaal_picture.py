"""A template as UPPAAL's editor shows it, as SVG: from the positions that are in the file."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

from fsmkit.export.uppaal.layout import LETTER, LINE, labels
from fsmkit.export.uppaal.network import Edge, Label, Point, Template

Box = tuple[int, int, int, int]
"""Left, upper, right and lower bound, in pixels."""
RADIUS, MARGIN = 10, 24
LINE_COLOR, FILL, NAME, INVARIANT = "#555555", "#d0d0e0", "#a00000", "#a000a0"
COLORS = {
    Label.COMMENT: "#777777",
    Label.SELECT: "#a08000",
    Label.GUARD: "#007a00",
    Label.SYNC: "#008a8a",
    Label.UPDATE: "#0000b0",
}
"""As UPPAAL colors its labels."""
FONT = 'font-family="Helvetica,Arial,sans-serif" font-size="12"'
HEADS = (
    '<defs><marker id="head" markerWidth="9" markerHeight="8" refX="9" refY="4" orient="auto">'
    '<path d="M0,0 L9,4 L0,8 z" fill="context-stroke"/></marker></defs>'
)


def picture(template: Template) -> str:
    """Return the text of an SVG file."""
    at = {loc.id: loc.at or (0, 0) for loc in template.locations}
    boxes = [box for box, _ in (*label_boxes(template), *location_boxes(template))]
    nails = [nail for edge in template.edges for nail in edge.nails]
    left = min([b[0] for b in boxes] + [x for x, _ in nails], default=0) - MARGIN
    upper = min([b[1] for b in boxes] + [y for _, y in nails], default=0) - MARGIN
    width = max([b[2] for b in boxes] + [x for x, _ in nails], default=0) + MARGIN - left
    height = max([b[3] for b in boxes] + [y for _, y in nails], default=0) + MARGIN - upper
    size = f'width="{width}" height="{height}" viewBox="{left} {upper} {width} {height}"'
    found = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} {FONT}>',
        HEADS,
        f'<rect x="{left}" y="{upper}" width="{width}" height="{height}" fill="#ffffff"/>',
    ]
    lines = dict.fromkeys(_line(edge, at) for edge in template.edges)
    found += sorted(lines, key=lambda line: LINE_COLOR in line)
    found += _locations(template, at)
    for edge in template.edges:
        for kind, text, place in places(edge):
            found += _text(text, place, COLORS[kind])
    return "\n".join([*found, "</svg>", ""])


def _line(edge: Edge, at: dict[str, Point]) -> str:
    points = [at[edge.source], *edge.nails, at[edge.target]]
    points[0] = _towards(points[0], points[1])
    points[-1] = _towards(points[-1], points[-2])
    way = " ".join(f"{x},{y}" for x, y in points)
    color = edge.color or LINE_COLOR
    return f'<polyline points="{way}" fill="none" stroke="{color}" marker-end="url(#head)"/>'


def _towards(start: Point, end: Point) -> Point:
    """Return where a line leaves the circle of a location."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = max(1.0, (dx * dx + dy * dy) ** 0.5)
    return round(start[0] + dx * RADIUS / length), round(start[1] + dy * RADIUS / length)


def _locations(template: Template, at: dict[str, Point]) -> Iterator[str]:
    for location in template.locations:
        x, y = at[location.id]
        fill = location.color or FILL
        ring = f'cx="{x}" cy="{y}" stroke="{LINE_COLOR}"'
        yield f'<circle {ring} r="{RADIUS}" fill="{fill}"/>'
        if location.id == template.initial:
            yield f'<circle {ring} r="{RADIUS - 4}" fill="none"/>'
        if location.committed:
            yield f'<text x="{x}" y="{y + 4}" text-anchor="middle">C</text>'
        if location.name_at is not None:
            yield from _text(location.name, location.name_at, NAME, bold=True)
        if location.invariant_at is not None:
            yield from _text(" && ".join(location.invariant), location.invariant_at, INVARIANT)


def _text(text: str, at: Point, color: str, *, bold: bool = False) -> Iterator[str]:
    weight = ' font-weight="bold"' if bold else ""
    for row, line in enumerate(text.split("\n")):
        yield (
            f'<text x="{at[0]}" y="{at[1] + row * LINE + 12}" fill="{color}"{weight}>'
            f"{escape(line)}</text>"
        )


def places(edge: Edge) -> list[tuple[Label, str, Point]]:
    """Return the labels that have a place, with it."""
    texts = labels(edge)
    return [(kind, texts[kind], place) for kind, place in edge.labels_at]


def overlap(one: Box, other: Box) -> bool:
    """Whether two boxes have more in common than a border."""
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


# --- what lies where ------------------------------------------------------------------------------


def label_boxes(template: Template) -> Iterator[tuple[Box, str]]:
    """Yield the space that each label needs, and its text."""
    for edge in template.edges:
        for _, text, at in places(edge):
            yield _box(text, at), text
    for location in template.locations:
        if location.name_at is not None:
            yield _box(location.name, location.name_at), location.name
        if location.invariant_at is not None:
            text = " && ".join(location.invariant)
            yield _box(text, location.invariant_at), text


def location_boxes(template: Template) -> Iterator[tuple[Box, str]]:
    """Yield the space of each location, and its name or id."""
    for location in template.locations:
        if location.at is not None:
            x, y = location.at
            box = x - RADIUS, y - RADIUS, x + RADIUS, y + RADIUS
            yield box, location.name or location.id


def _box(text: str, at: Point) -> Box:
    lines = text.split("\n")
    return at[0], at[1], at[0] + max(map(len, lines)) * LETTER, at[1] + len(lines) * LINE
