"""Write the SVG of a drawing whose boxes and arrows have their places, in the form of Graphviz."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from xml.sax.saxutils import escape

from fsmkit.chart.drawing.graph_text import Attribute, Statement
from fsmkit.chart.drawing.positions.pieces import Piece
from fsmkit.chart.drawing.positions.placement import Arrow, Rect
from fsmkit.emit.svg import with_dark_colours

PAD = 14.4
"""Points around a drawing."""
ABOVE = 10.0
"""Points between the title and the drawing."""
ROUND = 12.0
"""Points of a rounded corner."""
HEAD = 0.35
"""Half of the width of an arrowhead, in parts of its length."""
QUOTES = {'"': "&quot;"}


@dataclass(frozen=True, slots=True)
class Text:
    """A text that is drawn around a point."""

    piece: Piece
    x: float
    y: float
    links: tuple[tuple[str, str], ...] = ()

    @property
    def box(self) -> Rect:
        """Its rectangle."""
        width, height = self.piece.width, self.piece.height
        return Rect(self.x - width / 2, self.y - height / 2, width, height)

    @property
    def svg(self) -> str:
        """Its SVG."""
        return self.piece.svg(self.x, self.y, self.links)


@dataclass(frozen=True, slots=True)
class Drawn:
    """A part of a drawing: its statement, where it is, and its texts.

    ``shape``: a rectangle of a composite state; an arrow; None for a node, which is its first text.
    """

    part: Statement
    shape: Rect | Arrow | None
    texts: tuple[Text, ...] = ()


def picture(name: str, title: Piece, parts: Iterable[Drawn]) -> str:
    """Return a drawing in SVG.

    Args:
        name: The name of the chart.
        title: Its title, which is drawn above.
        parts: The composite states, outer ones first, then nodes and arrows.

    """
    parts = [*parts]
    areas = [area for each in parts for area in _areas(each)]
    left = min((area.x for area in areas), default=0.0)
    right = max((area.right for area in areas), default=0.0)
    top = min((area.y for area in areas), default=0.0) - ABOVE - title.height
    bottom = max((area.bottom for area in areas), default=0.0)
    middle = (left + right) / 2
    left, right = min(left, middle - title.width / 2), max(right, middle + title.width / 2)
    width, height = right - left + 2 * PAD, bottom - top + 2 * PAD
    x1, y1 = left - PAD, top - PAD
    x2, y2 = x1 + width, y1 + height
    outline = ((x1, y2), (x1, y1), (x2, y1), (x2, y2), (x1, y2))
    corners = " ".join(f"{x:.6g},{y:.6g}" for x, y in outline)
    lines = [
        '<?xml version="1.0" encoding="UTF-8" standalone="no"?>',
        f'<svg width="{width:.0f}pt" height="{height:.0f}pt"',
        f' viewBox="0.00 0.00 {width:.2f} {height:.2f}" xmlns="http://www.w3.org/2000/svg"',
        ' xmlns:xlink="http://www.w3.org/1999/xlink">',
        f'<g id="graph0" class="graph" transform="translate({-x1:.6g} {-y1:.6g})">',
        f"<title>{escape(name)}</title>",
        f'<polygon fill="white" stroke="none" points="{corners}"/>',
        title.svg(middle, top + title.height / 2),
    ]
    lines += map(_group, parts)
    lines.append("</g>\n</svg>\n")
    return with_dark_colours("\n".join(lines))


def _areas(drawn: Drawn) -> Iterable[Rect]:
    if isinstance(drawn.shape, Rect):
        yield drawn.shape
    if isinstance(drawn.shape, Arrow):
        yield from (Rect(x, y, 0, 0) for x, y in drawn.shape.points)
    yield from (text.box for text in drawn.texts)


def _group(drawn: Drawn) -> str:
    part = drawn.part
    kind, name = part.owner
    own = _value(part.attributes, "id") or name
    classes = _value(part.attributes, "class")
    word = {"graph": "cluster", "node": "node", "edge": "edge"}[kind]
    title = " ".join(part.head) if kind == "edge" else name
    tooltip = _value(part.attributes, "tooltip")
    inner, rest = drawn.texts, drawn.texts[:0]
    match drawn.shape:
        case Rect() as box:
            shape = _composite(box, part.attributes)
        case Arrow() as arrow:
            shape = _arrow(arrow, part.attributes)
            inner, rest = rest, inner
        case None:
            shape = ""
            inner, rest = inner[:1], inner[1:]
    body = "".join((shape, *(text.svg for text in inner)))
    if tooltip:
        body = f'<g id="a_{own}"><a xlink:title="{tooltip}">\n{body}</a>\n</g>\n'
    beside = "".join(text.svg for text in rest)
    return (
        f'<g id="{own}" class="{word}{" " if classes else ""}{classes}">\n'
        f"<title>{escape(title)}</title>\n{body}{beside}</g>"
    )


def _value(attributes: Mapping[str, Attribute], key: str) -> str:
    """Return the value of an attribute for SVG; Graphviz reads entities in it, too."""
    each = attributes.get(key)
    if each is None:
        return ""
    text = each.value.replace("\\\\", "\0").replace('\\"', '"').replace("\\n", "\n")
    text = text.replace("\0", "\\").replace("&amp;", "&")
    return escape(text, QUOTES)


def _pen(attributes: Mapping[str, Attribute]) -> str:
    """Return the attributes of SVG for a border or a line."""
    width = _value(attributes, "penwidth")
    is_dashed = "dashed" in _value(attributes, "style").split(",")
    return "".join(
        (
            f' stroke="{_value(attributes, "color") or "#1f2933"}"',
            f' stroke-width="{width}"' if width not in ("", "1") else "",
            ' stroke-dasharray="5,2"' if is_dashed else "",
        )
    )


def _composite(box: Rect, attributes: Mapping[str, Attribute]) -> str:
    """Return a rectangle with rounded corners, as Graphviz draws it."""
    r = min(ROUND, box.width / 3, box.height / 3)
    x1, y1, x2, y2 = box.x, box.y, box.right, box.bottom
    points = (
        (x1 + r, y2), (x2 - r, y2), (x2 - r, y2), (x2 - r / 2, y2), (x2, y2 - r / 2), (x2, y2 - r),
        (x2, y2 - r), (x2, y1 + r), (x2, y1 + r), (x2, y1 + r / 2), (x2 - r / 2, y1), (x2 - r, y1),
        (x2 - r, y1), (x1 + r, y1), (x1 + r, y1), (x1 + r / 2, y1), (x1, y1 + r / 2), (x1, y1 + r),
        (x1, y1 + r), (x1, y2 - r), (x1, y2 - r), (x1, y2 - r / 2), (x1 + r / 2, y2), (x1 + r, y2),
    )  # fmt: skip
    course = " ".join(f"{x:.6g},{y:.6g}" for x, y in points)
    fill = _value(attributes, "fillcolor")
    return f'<path fill="{fill}"{_pen(attributes)} d="M{x1 + r:.6g},{y2:.6g}C{course}"/>\n'


def _arrow(arrow: Arrow, attributes: Mapping[str, Attribute]) -> str:
    """Return the curve of an arrow and its tips."""
    (x, y), *others = arrow.points
    course = " ".join(f"{x:.6g},{y:.6g}" for x, y in others)
    pen = _pen(attributes)
    lines = [f'<path fill="none"{pen} d="M{x:.6g},{y:.6g}C{course}"/>\n']
    color = _value(attributes, "color") or "#1f2933"
    for end, tip_x, tip_y in arrow.heads:
        x, y = arrow.points[0 if end == "s" else -1]
        dx, dy = HEAD * (tip_x - x), HEAD * (tip_y - y)
        corners = ((x - dy, y + dx), (tip_x, tip_y), (x + dy, y - dx), (x - dy, y + dx))
        points = " ".join(f"{x:.6g},{y:.6g}" for x, y in corners)
        lines.append(f'<polygon fill="{color}" stroke="{color}" points="{points}"/>\n')
    return "".join(lines)
