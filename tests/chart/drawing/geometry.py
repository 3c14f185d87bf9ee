"""Where the parts of a drawing lie: boxes, texts, arrows of an SVG by Graphviz."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from lxml import etree

SVG = "{http://www.w3.org/2000/svg}"


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle; in SVG the top has the least number. ``kind``: the class of its element."""

    left: float
    top: float
    right: float
    bottom: float
    kind: str = ""
    text: str = ""

    @property
    def height(self) -> float:
        return self.bottom - self.top

    def has(self, other: Box) -> bool:
        """Whether another box lies in it."""
        is_beside = other.left < self.left or other.right > self.right
        return not (is_beside or other.top < self.top or other.bottom > self.bottom)

    def meets(self, other: Box) -> bool:
        """Whether both have a point in common."""
        is_beside = other.left >= self.right or other.right <= self.left
        return not (is_beside or other.top >= self.bottom or other.bottom <= self.top)


@dataclass(frozen=True, slots=True)
class Picture:
    """Boxes of clusters and nodes by their ids, and the texts in each element."""

    boxes: dict[str, Box]
    texts: dict[str, tuple[Box, ...]]

    def clusters(self) -> dict[str, Box]:
        """Return the boxes that others lie in."""
        return {own: box for own, box in self.boxes.items() if "cluster" in box.kind.split()}


def picture(svg: bytes | str) -> Picture:
    """Return the parts of a drawing."""
    boxes, texts = {}, {}
    for group in etree.fromstring(svg if isinstance(svg, bytes) else svg.encode()).iter(f"{SVG}g"):
        kind, own = group.get("class") or "", group.get("id") or ""
        if not re.match(r"(cluster|node|edge)\b", kind):
            continue
        texts[own] = tuple(map(_text, group.iter(f"{SVG}text")))
        shapes = [shape for shape in map(_shape, group.iter()) if shape]
        if shapes and not kind.startswith("edge"):
            xs, ys = zip(*(point for shape in shapes for point in shape), strict=True)
            boxes[own] = Box(min(xs), min(ys), max(xs), max(ys), kind)
    return Picture(boxes, texts)


def _text(node: etree._Element) -> Box:
    """Return the rectangle of a text, as wide as its layout left room for."""
    x, y, size = (float(node.get(key) or 0) for key in ("x", "y", "font-size"))
    width = float(node.get("textLength") or size / 2)
    shift = {"middle": width / 2, "end": width}.get(node.get("text-anchor") or "", 0)
    said = "".join(map(str, node.itertext()))
    return Box(x - shift, y - 0.75 * size, x - shift + width, y + 0.2 * size, "text", said)


def _shape(node: etree._Element) -> list[tuple[float, float]]:
    match node.tag:
        case "{http://www.w3.org/2000/svg}ellipse":
            cx, cy, rx, ry = (float(node.get(key) or 0) for key in ("cx", "cy", "rx", "ry"))
            return [(cx - rx, cy - ry), (cx + rx, cy + ry)]
        case "{http://www.w3.org/2000/svg}path" | "{http://www.w3.org/2000/svg}polygon":
            return list(_points(node.get("d") or node.get("points") or ""))
        case _:
            return []


def _points(path: str) -> Iterator[tuple[float, float]]:
    numbers = [float(number) for number in re.findall(r"-?\d+(?:\.\d+)?", path)]
    return zip(numbers[::2], numbers[1::2], strict=True)
