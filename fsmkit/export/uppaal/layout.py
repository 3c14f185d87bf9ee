"""Compute positions: a card for each location, placed by Graphviz if installed, else on a grid.

A card is a location with its name and invariant, and below them, in a line or two each, the labels
of its outgoing edges. Edges between the same locations are one line. Hubs are the targets of very
many locations, such as error states. They form a column at the right, and lines to them are one
bend in light grey.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from fsmkit.chart.drawing.graphviz.engine import run_graphviz
from fsmkit.diagnostics import FsmkitError
from fsmkit.export.uppaal.network import Edge, Label, Location, Point, Template

LINE, LETTER = 17, 7
"""Pixels of a line of a label, and of a letter, in UPPAAL's editor."""
LONGEST = 48
"""Letters after which a label continues in another line, if it has a further part."""
INDENT, GAP = 2, 2
MOST_EDGES = 400
"""Lines that Graphviz lays out; templates with more are not for the eye."""
SECONDS = 20
FEWEST, SHARE = 4, 0.25
"""A hub is entered from so many locations, and from such a share of all."""
STRIP, HEAD = 30, 48
"""The width of a card's strip below the location, and the height of its name."""
WIDE, BETWEEN, INCH = 56, 60, 72
HIGH = 2400
"""A drawing that is so high, in pixels, is folded."""
COMMITTED, TO_HUB = "#ffa500", "#c8c8c8"

Way = tuple[str, str]
"""A line, from a location to another."""


@dataclass(frozen=True, slots=True)
class Block:
    """The labels of an edge, in pixels from the upper left corner of all."""

    places: tuple[tuple[Label, Point], ...]
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class Card:
    """A location, its edges by number with their labels, and its size in pixels."""

    location: Location
    rows: tuple[tuple[int, Block], ...]
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class Drawing:
    """The upper left corners of cards, the bends of lines, and the size of the drawing."""

    corners: dict[str, Point]
    bends: Mapping[Way, tuple[Point, ...]]
    width: int
    height: int


def hubs_of(template: Template) -> frozenset[str]:
    """Return the locations with very many sources."""
    named = {loc.id for loc in template.locations if not loc.committed}
    sources: dict[str, set[str]] = {}
    for edge in template.edges:
        if edge.source in named and edge.source != edge.target:
            sources.setdefault(edge.target, set()).add(edge.source)
    least = max(FEWEST, SHARE * len(named))
    return frozenset(target for target, of in sources.items() if len(of) >= least)


def lay_out(template: Template) -> Template:
    """Return a template with positions for all drawn parts."""
    hubs = hubs_of(template)
    leaving: dict[str, list[int]] = {}
    for number, edge in enumerate(template.edges):
        leaving.setdefault(edge.source, []).append(number)
    cards = [
        _card(template, location, leaving.get(location.id, ())) for location in template.locations
    ]
    others = [card for card in cards if card.location.id not in hubs]
    between = ((edge.source, edge.target) for edge in template.edges)
    connections = {(a, b): None for a, b in between if a != b and not {a, b} & hubs}
    drawing = _by_dot(others, connections) or _on_a_grid(others)
    top = BETWEEN
    for card in (card for card in cards if card.location.id in hubs):
        drawing.corners[card.location.id] = drawing.width + 2 * BETWEEN, top
        top += card.height + max(BETWEEN, drawing.height // (len(hubs) + 1) - card.height)
    edges = list(template.edges)
    for card in cards:
        for number, edge in _draw_edges(card, edges, drawing, hubs).items():
            edges[number] = edge
    places = (_at(drawing.corners[location.id]) for location in template.locations)
    locations = tuple(map(_with_position, template.locations, places))
    return replace(template, locations=locations, edges=tuple(edges))


def _card(template: Template, location: Location, leaving: Iterable[int]) -> Card:
    """Return the card of a location; ``leaving``: its outgoing edges, by number."""
    edges = template.edges
    own = sorted(leaving, key=lambda n: (edges[n].target != location.id, edges[n].target))
    rows = tuple((n, block(edges[n], WIDE)) for n in own)
    heads = max(len(location.name), len(" && ".join(location.invariant))) * LETTER
    width = STRIP + max([heads, *(place.width for _, place in rows)])
    return Card(location, rows, width, HEAD + sum(place.height for _, place in rows))


def _at(corner: Point) -> Point:
    """Return the position of the location of a card."""
    return corner[0] + STRIP // 2, corner[1] + HEAD - LINE


def _with_position(location: Location, at: Point) -> Location:
    x, y = at
    return replace(
        location,
        color=COMMITTED if location.committed else location.color,
        at=at,
        name_at=(x + STRIP // 2, y - 2 * LINE) if location.name else None,
        invariant_at=(x + STRIP // 2, y - LINE) if location.invariant else None,
    )


def _draw_edges(
    card: Card, edges: Sequence[Edge], drawing: Drawing, hubs: Collection[str]
) -> dict[int, Edge]:
    """Return the edges of a card, by number, with nails and labels."""
    found = {}
    x, y = _at(drawing.corners[card.location.id])
    top = y + LINE // 2
    for number, place in card.rows:
        edge = edges[number]
        is_hub, color = card.location.id in hubs, ""
        nails = drawing.bends.get((edge.source, edge.target), ())
        if edge.target == edge.source:
            nails = ((x - 22, y - 14), (x - 22, y + 14))
        elif is_hub or edge.target in hubs:
            nails = ((x - STRIP, y + STRIP),) if is_hub else ((x + card.width, y),)
            color = TO_HUB
        drawn = replace(edge, nails=nails, color=color)
        found[number] = with_labels(drawn, place, (x + STRIP // 2 + 4, top))
        top += place.height
    return found


def _by_dot(cards: Sequence[Card], connections: Collection[Way]) -> Drawing | None:
    """Return Graphviz's layout of cards as boxes; None if it fails.

    Lines leave below the strip and enter above it, so they cross no label of their own cards.
    """
    if not cards or len(connections) > MOST_EDGES:
        return None
    names = {card.location.id: f"n{n}" for n, card in enumerate(cards)}
    lines = ["digraph { splines=polyline; nodesep=0.4; ranksep=0.4; node [shape=box fixedsize=1]"]
    lines += [
        f"{names[c.location.id]} [width={c.width / INCH:.3f} height={c.height / INCH:.3f}]"
        for c in cards
    ]
    lines += [f"{names[a]} -> {names[b]} [tailport=sw headport=nw]" for a, b in connections]
    try:
        output = run_graphviz("\n".join([*lines, "}"]), ("plain",), seconds=SECONDS)
    except FsmkitError:
        return None
    words = [line.split() for line in output.decode().splitlines()]
    width, height = (round(INCH * float(size)) for size in words[0][2:4])

    def point(x: str, y: str) -> Point:
        return round(INCH * float(x)), height - round(INCH * float(y))

    by_name = {name: card for card, name in zip(cards, names.values(), strict=True)}
    ids = {name: id_ for id_, name in names.items()}
    corners: dict[str, Point] = {}
    bends: dict[Way, tuple[Point, ...]] = {}
    for kind, *rest in words[1:-1]:
        if kind == "node":
            card, (x, y) = by_name[rest[0]], point(*rest[1:3])
            corners[card.location.id] = x - card.width // 2, y - card.height // 2
        elif kind == "edge":
            count = int(rest[2])
            points = [point(*rest[3 + 2 * n : 5 + 2 * n]) for n in range(0, count, 3)]
            bends[ids[rest[0]], ids[rest[1]]] = tuple(points)
    return _fold(Drawing(corners, bends, width, height))


def _fold(drawing: Drawing) -> Drawing:
    """Return a high drawing in two columns, cut where the fewest lines cross."""
    corners, height = drawing.corners, drawing.height
    rows = sorted({y for _, y in corners.values() if height * 0.4 < y < height * 0.6})
    if height < HIGH or not rows:
        return drawing

    def crossing(cut: int) -> set[Way]:
        lower = {name for name, (_, y) in corners.items() if y >= cut}
        return {way for way in drawing.bends if len(lower & {*way}) == 1}

    cut = min(rows, key=lambda row: (len(crossing(row)), abs(2 * row - height)))
    cut_off = crossing(cut)

    def moved(at: Point, *, is_lower: bool) -> Point:
        return (at[0] + drawing.width + 2 * BETWEEN, at[1] - cut) if is_lower else at

    lower = {name for name, (_, y) in corners.items() if y >= cut}
    return Drawing(
        {name: moved(at, is_lower=name in lower) for name, at in corners.items()},
        {
            way: tuple(moved(at, is_lower=way[0] in lower) for at in points)
            for way, points in drawing.bends.items()
            if way not in cut_off
        },
        2 * (drawing.width + BETWEEN),
        max(cut, height - cut),
    )


def _on_a_grid(cards: Sequence[Card]) -> Drawing:
    """Place cards in their order, in as many rows as columns."""
    count = math.isqrt(len(cards)) + 1
    corners: dict[str, Point] = {}
    top, width = 0, 0
    for row in (cards[n : n + count] for n in range(0, len(cards), count)):
        left = 0
        for card in row:
            corners[card.location.id] = left, top
            left += card.width + BETWEEN
        width, top = max(width, left), top + max(card.height for card in row) + BETWEEN
    return Drawing(corners, {}, width, top)


# --- labels ---------------------------------------------------------------------------------------


def labels(edge: Edge) -> dict[Label, str]:
    """Return the texts of the labels of an edge; long ones have several lines."""
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
    """Join parts; before a line becomes too long, a new one replaces a blank."""
    lines: list[str] = []
    for part in parts:
        if lines and len(lines[-1]) + len(part) <= LONGEST:
            lines[-1] += separator + part
        else:
            if lines:
                lines[-1] += separator.rstrip()
            lines.append(part)
    return "\n".join(lines)


def block(edge: Edge, widest: int) -> Block:
    """Place the labels of an edge beside each other, in lines of at most so many letters."""
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


def with_labels(edge: Edge, place: Block, corner: Point) -> Edge:
    """Return an edge with its labels placed from a corner on."""
    x, y = corner
    at = tuple((kind, (x + dx, y + dy)) for kind, (dx, dy) in place.places)
    return replace(edge, labels_at=at)
