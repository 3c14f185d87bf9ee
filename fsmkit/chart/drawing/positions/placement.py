"""Where the parts of a drawing are, and the file of hints beside a chart.

Lengths are points. The origin is the top left corner, and y grows downwards. A part has a name that
does not change when states or transitions are added: a state its id, the initial dot of a state
``ID initial``, a transition ``SOURCE > TARGET`` with its number among those with the same ends.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fsmkit.diagnostics.parsing import parse_json

VERSION = 1
MOST_BYTES = 5_000_000
SUFFIX = ".layout.json"


@dataclass(frozen=True, slots=True)
class Rect:
    """A rectangle; ``y`` is its top."""

    x: float
    y: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """The right border."""
        return self.x + self.width

    @property
    def bottom(self) -> float:
        """The lower border."""
        return self.y + self.height

    @property
    def centre(self) -> tuple[float, float]:
        """The point in the middle."""
        return self.x + self.width / 2, self.y + self.height / 2

    def meets(self, other: Rect, gap: float = 0) -> bool:
        """Whether both are nearer than a gap."""
        return (
            self.x < other.right + gap
            and other.x < self.right + gap
            and self.y < other.bottom + gap
            and other.y < self.bottom + gap
        )

    def holds(self, x: float, y: float) -> bool:
        """Whether a point lies in it."""
        return self.x <= x <= self.right and self.y <= y <= self.bottom


@dataclass(frozen=True, slots=True)
class Arrow:
    """The curve of an arrow, and the middle of its label.

    ``points`` are the control points of a cubic curve. ``heads`` are the tips, each with ``s`` or
    ``e`` for the start or the end.
    """

    points: tuple[tuple[float, float], ...]
    heads: tuple[tuple[str, float, float], ...] = ()
    label: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Placement:
    """The rectangles of states and dots, and the curves of arrows, by their names.

    ``hidden``: the rectangles of the states in folded states, from the corner of its parent.
    """

    boxes: Mapping[str, Rect] = field(default_factory=dict)
    arrows: Mapping[str, Arrow] = field(default_factory=dict)
    hidden: Mapping[str, Rect] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """Return the content of the file of hints; numbers have one decimal."""
        return {
            "layout": VERSION,
            "boxes": {name: _rounded(box) for name, box in self.boxes.items()},
            "hidden": {name: _rounded(box) for name, box in self.hidden.items()},
            "arrows": {
                name: {
                    "points": [[round(x, 1), round(y, 1)] for x, y in a.points],
                    "heads": [[end, round(x, 1), round(y, 1)] for end, x, y in a.heads],
                    **({"label": [round(v, 1) for v in a.label]} if a.label else {}),
                }
                for name, a in self.arrows.items()
            },
        }


def _rounded(box: Rect) -> list[float]:
    return [round(value, 1) for value in (box.x, box.y, box.width, box.height)]


def placement_from_json(read: Any) -> Placement | None:
    """Return the placement of a file's content; None if it is not one of this version."""
    try:
        if read["layout"] != VERSION:
            return None
        boxes, hidden = (
            {str(name): Rect(*map(_number, box)) for name, box in rects.items()}
            for rects in (read["boxes"], read.get("hidden", {}))
        )
        arrows = {
            str(name): Arrow(
                tuple((_number(x), _number(y)) for x, y in arrow["points"]),
                tuple((_end(end), _number(x), _number(y)) for end, x, y in arrow["heads"]),
                (_number(arrow["label"][0]), _number(arrow["label"][1]))
                if "label" in arrow
                else None,
            )
            for name, arrow in read.get("arrows", {}).items()
        }
    except (KeyError, TypeError, ValueError, AttributeError, IndexError):
        return None
    return Placement(boxes, arrows, hidden)


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e6:
        raise ValueError(value)
    return float(value)


def _end(value: Any) -> str:
    if value not in ("s", "e"):
        raise ValueError(value)
    return str(value)


def renamed(placement: Placement, old: str, new: str) -> Placement:
    """Return the placement after a state was renamed."""

    def name(key: str) -> str:
        return " ".join(new if word == old else word for word in key.split(" "))

    return Placement(
        {name(key): box for key, box in placement.boxes.items()},
        {name(key): arrow for key, arrow in placement.arrows.items()},
        {name(key): box for key, box in placement.hidden.items()},
    )


def hints_path(chart: Path) -> Path:
    """Return the file of hints of a chart: ``gate.layout.json`` for ``gate.yaml``."""
    return chart.with_name(chart.name.split(".")[0] + SUFFIX)


def read_hints(chart: Path) -> Placement | None:
    """Return the hints beside a chart; None if they are missing or cannot be read."""
    path = hints_path(chart)
    try:
        if path.stat().st_size > MOST_BYTES:
            return None
        return placement_from_json(parse_json(path.read_bytes()))
    except (OSError, ValueError):
        return None


def hints_text(placement: Placement) -> str:
    """Return the text of the file of hints: one line for each part."""
    content = placement.as_json()
    parts = [f'"layout": {content["layout"]}']
    for kind in ("boxes", "arrows", "hidden"):
        lines = (f"  {json.dumps(k)}: {json.dumps(v)}" for k, v in content[kind].items())
        parts.append(f'"{kind}": {{\n' + ",\n".join(lines) + "\n}")
    return "{\n" + ",\n".join(parts) + "\n}\n"
