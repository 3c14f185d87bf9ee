"""The labels of edges, as text in lines, and how they stand beside and below each other."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from fsmkit.export.uppaal.network import Edge, Label, Point

LINE, LETTER = 17, 7
"""Pixels of a line of a label, and of a letter, in UPPAAL's editor."""
LONGEST = 48
"""Letters after which a label goes on in another line, if it has a part to begin it with."""
INDENT, GAP = 2, 2


def labels(edge: Edge) -> dict[Label, str]:
    """Return the texts of the labels that an edge has; long ones have several lines."""
    select = [f"{name} : int[{lo},{hi}]" for name, lo, hi in edge.select]
    texts = {
        Label.COMMENT: _lines(edge.comment.split(", "), ", "),
        Label.SELECT: _lines(select, ", "),
        Label.GUARD: _lines(edge.guard, " && "),
        Label.SYNC: edge.sync,
        Label.UPDATE: _lines(edge.update, ", "),
    }
    return {kind: text for kind, text in texts.items() if text}


def _lines(parts: Iterable[str], separator: str) -> str:
    """Join parts; where a line would become too long, a new one begins in place of a blank."""
    lines: list[str] = []
    for part in parts:
        if lines and len(lines[-1]) + len(part) <= LONGEST:
            lines[-1] += separator + part
        else:
            if lines:
                lines[-1] += separator.rstrip()
            lines.append(part)
    return "\n".join(lines)


@dataclass(frozen=True, slots=True)
class Block:
    """The labels of an edge, in pixels from the upper left corner of all."""

    places: tuple[tuple[Label, Point], ...]
    width: int
    height: int


def block(edge: Edge, widest: int) -> Block:
    """Place the labels of an edge beside each other, in lines of so many letters at most."""
    places: list[tuple[Label, Point]] = []
    row, column, width = 0, 0, 0
    for kind, text in labels(edge).items():
        lines = text.split("\n")
        letters = max(map(len, lines))
        if column and (column + letters > widest or len(lines) > 1):
            row, column = row + 1, INDENT
        places.append((kind, (column * LETTER, row * LINE)))
        width = max(width, column + letters)
        if len(lines) > 1:
            row, column = row + len(lines) - 1, widest
        else:
            column += letters + GAP
    return Block(tuple(places), width * LETTER, (row + 1) * LINE if places else 0)


def labelled(edge: Edge, place: Block, corner: Point) -> Edge:
    """Return an edge with its labels placed from a corner on."""
    x, y = corner
    at = tuple((kind, (x + dx, y + dy)) for kind, (dx, dy) in place.places)
    return replace(edge, labels_at=at)
