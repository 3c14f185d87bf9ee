"""Positions: a card for each location, placed by Graphviz where it is installed, else on a grid.

A card is a location with its name and invariant, and below them, one line for each, the labels of
its edges to itself and to hubs. Hubs are the targets of very many locations, such as those of
errors; they stand in a column at the right, and what leads to them is one bend in light grey.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from fsmkit.export.uppaal.apart import Box, apart
from fsmkit.export.uppaal.labels import LETTER, LINE, Block, block, labelled
from fsmkit.export.uppaal.nails import straightened
from fsmkit.export.uppaal.network import Edge, Location, Network, Point, Template

MOST_EDGES = 400
"""Edges that Graphviz is asked to lay out; templates with more are not for the eye."""
SECONDS = 20
FEWEST, SHARE = 4, 0.25
"""A hub is entered from so many locations, and from such a share of all."""
STRIP, HEAD = 30, 48
"""Of a card: the width of the strip below the location, and the height of its name."""
WIDE, NARROW = 56, 24
"""Letters of a line of labels in a card, and beside an edge."""
BETWEEN = 60
HIGH, MOST_CROSSING, CHAIN = 1800, 5, 3
"""A drawing that is so high is folded, where so few edges cross the fold.

An edge of a committed location counts as more: a chain stays together.
"""
COMMITTED, TO_HUB = "#ffa500", "#c8c8c8"


def laid_out(network: Network) -> Network:
    """Return a network with positions for all that is drawn."""
    return replace(network, templates=tuple(map(_template, network.templates)))


@dataclass(frozen=True, slots=True)
class Card:
    """A location and the edges told of in its card, by number; sizes in pixels."""

    location: Location
    rows: tuple[tuple[int, Block], ...]
    width: int
    height: int

    @property
    def is_point(self) -> bool:
        """Whether there is nothing but a committed location."""
        return self.location.committed and not self.rows


def hubs_of(template: Template) -> frozenset[str]:
    """Return the locations that very many others lead to."""
    named = {loc.id for loc in template.locations if not loc.committed}
    sources: dict[str, set[str]] = {}
    for edge in template.edges:
        if edge.source in named and edge.source != edge.target:
            sources.setdefault(edge.target, set()).add(edge.source)
    least = max(FEWEST, SHARE * len(named))
    return frozenset(target for target, of in sources.items() if len(of) >= least)


def _template(template: Template) -> Template:
    hubs = hubs_of(template)
    ids = [loc.id for loc in template.locations if loc.id not in hubs]
    free = {
        n
        for n, edge in enumerate(template.edges)
        if edge.source != edge.target and not {edge.source, edge.target} & hubs
    }
    found = None
    if len(free) <= MOST_EDGES and shutil.which("dot") is not None:
        try:
            found = _folded(template, ids, free)
        except (subprocess.SubprocessError, ValueError, KeyError):
            found = None
    found = found or _on_a_grid(template, _cards(template, ids, free), free)
    cards = _cards(template, [loc.id for loc in template.locations], set(found.ways))
    places = found.places | _at_the_side([c for c in cards if c.location.id in hubs], found)
    ways = found.ways | _of_cards(template.edges, cards, places, hubs)
    return replace(
        template,
        locations=tuple(_placed(loc, places[loc.id]) for loc in template.locations),
        edges=tuple(ways[n] for n in range(len(template.edges))),
    )


@dataclass(frozen=True, slots=True)
class Drawing:
    """Where locations stand, and the edges drawn between them, by number."""

    places: dict[str, Point]
    ways: dict[int, Edge]
    width: int
    height: int


# --- cards ----------------------------------------------------------------------------------------


def _cards(template: Template, ids: Sequence[str], free: Collection[int]) -> list[Card]:
    """Return the cards of locations; ``free``: the edges that are not told of in them."""
    own: dict[str, list[int]] = {}
    for number, edge in enumerate(template.edges):
        if number not in free:
            own.setdefault(edge.source, []).append(number)
    wanted = set(ids)
    return [
        _card(template.edges, location, own.get(location.id, []))
        for location in template.locations
        if location.id in wanted
    ]


def _card(edges: Sequence[Edge], location: Location, own: list[int]) -> Card:
    own = sorted(own, key=lambda n: (edges[n].target != location.id, edges[n].target))
    rows = tuple((n, block(edges[n], WIDE)) for n in own)
    heads = len(location.name), len(" && ".join(location.invariant))
    width = STRIP + max([max(heads) * LETTER, *(place.width for _, place in rows)])
    height = HEAD + sum(place.height for _, place in rows)
    return Card(location, rows, width, height)


def _placed(location: Location, at: Point) -> Location:
    x, y = at
    color = COMMITTED if location.committed else location.color
    return replace(
        location,
        color=color,
        at=at,
        name_at=(x + STRIP // 2, y - 2 * LINE) if location.name else None,
        invariant_at=(x + STRIP // 2, y - LINE) if location.invariant else None,
    )


def _of_cards(
    edges: Sequence[Edge],
    cards: Sequence[Card],
    places: Mapping[str, Point],
    hubs: Collection[str],
) -> dict[int, Edge]:
    """Return the edges told of in cards, with nails and labels."""
    found = {}
    for card in cards:
        x, y = places[card.location.id]
        top = y + LINE // 2
        for number, place in card.rows:
            edge = edges[number]
            if edge.target == edge.source:
                nails: tuple[Point, ...] = ((x - 22, y - 14), (x - 22, y + 14))
                color = ""
            else:
                is_hub = card.location.id in hubs
                nails = ((x - STRIP, y + STRIP),) if is_hub else ((x + card.width, y),)
                color = TO_HUB if is_hub or edge.target in hubs else ""
            drawn = replace(edge, nails=nails, color=color)
            found[number] = labelled(drawn, place, (x + STRIP // 2 + 4, top))
            top += place.height
    return found


def _at_the_side(hubs: Sequence[Card], drawing: Drawing) -> dict[str, Point]:
    """Place the hubs in a column, right of all others."""
    total = sum(card.height for card in hubs)
    gap = max(BETWEEN, (drawing.height - total) // (len(hubs) + 1))
    found, top = {}, gap
    for card in hubs:
        found[card.location.id] = drawing.width + 2 * BETWEEN, top + HEAD - LINE
        top += card.height + gap
    return found


# --- Graphviz -------------------------------------------------------------------------------------


def _folded(template: Template, ids: Sequence[str], free: set[int]) -> Drawing:
    """Draw by Graphviz; what is high is cut where few edges cross, into two columns."""
    whole = _by_dot(template.edges, free, _cards(template, ids, free))
    if whole.height < HIGH:
        return whole
    rows = sorted({y for _, y in whole.places.values()})
    committed = {loc.id for loc in template.locations if loc.committed}
    best: tuple[int, int, int] | None = None
    for upper, lower in pairwise(rows):
        cut = (upper + lower) // 2
        if not whole.height * 0.25 < cut < whole.height * 0.75:
            continue
        cut_off = [e for n in free if _crosses(e := template.edges[n], whole.places, cut)]
        crossing = sum(CHAIN if e.source in committed else 1 for e in cut_off)
        rank = crossing, abs(2 * cut - whole.height), cut
        best = rank if best is None else min(best, rank)
    if best is None or best[0] > MOST_CROSSING:
        return whole
    cut = best[2]
    inner = {n for n in free if not _crosses(template.edges[n], whole.places, cut)}
    halves = []
    for is_lower in (False, True):
        part = [name for name in ids if (whole.places[name][1] > cut) is is_lower]
        own = {n for n in inner if template.edges[n].source in part}
        halves.append(_by_dot(template.edges, own, _cards(template, part, inner)))
    left, right = halves
    shifted = _shifted(right, left.width + 2 * BETWEEN)
    return Drawing(
        left.places | shifted.places,
        left.ways | shifted.ways,
        shifted.width,
        max(left.height, right.height),
    )


def _crosses(edge: Edge, places: Mapping[str, Point], cut: int) -> bool:
    return (places[edge.source][1] > cut) != (places[edge.target][1] > cut)


def _shifted(drawing: Drawing, by: int) -> Drawing:
    """Return a drawing moved to the right."""

    def moved(at: Point | None) -> Point | None:
        return None if at is None else (at[0] + by, at[1])

    ways = {
        number: replace(
            edge,
            nails=tuple((x + by, y) for x, y in edge.nails),
            select_at=moved(edge.select_at),
            guard_at=moved(edge.guard_at),
            sync_at=moved(edge.sync_at),
            update_at=moved(edge.update_at),
            comment_at=moved(edge.comment_at),
        )
        for number, edge in drawing.ways.items()
    }
    places = {name: (x + by, y) for name, (x, y) in drawing.places.items()}
    return Drawing(places, ways, drawing.width + by, drawing.height)


def _by_dot(edges: Sequence[Edge], free: Collection[int], cards: Sequence[Card]) -> Drawing:
    blocks = {n: block(edges[n], NARROW) for n in sorted(free)}
    found = json.loads(
        subprocess.run(
            ["dot", "-Tjson"],
            input=_graph(edges, blocks, cards),
            capture_output=True,
            text=True,
            check=True,
            timeout=SECONDS,
        ).stdout
    )
    width, height = map(float, found["bb"].split(",")[2:])
    centres = {one["name"]: _point(one["pos"], height) for one in found["objects"]}
    places = {}
    for card in cards:
        x, y = centres[card.location.id]
        if not card.is_point:
            x, y = x - card.width // 2 + STRIP // 2, y - card.height // 2 + HEAD - LINE
        places[card.location.id] = x, y
    ways: dict[int, Edge] = {}
    spaces: dict[int, Box] = {}
    for one in found.get("edges", ()):
        number = int(one["id"])
        points = [_point(p, height) for p in one["pos"].split() if p[:2] not in ("e,", "s,")]
        ends = places[edges[number].source], places[edges[number].target]
        ways[number] = replace(edges[number], nails=straightened([ends[0], *points[::3], ends[1]]))
        if "lp" in one:
            x, y = _point(one["lp"], height)
            place = blocks[number]
            left, upper = x - place.width // 2, y - place.height // 2
            spaces[number] = left, upper, left + place.width, upper + place.height
    corners = apart([_space(card, places) for card in cards], list(spaces.values()))
    for number, corner in zip(spaces, corners, strict=True):
        ways[number] = labelled(ways[number], blocks[number], corner)
    return Drawing(places, ways, round(width), round(height))


def _space(card: Card, places: Mapping[str, Point]) -> Box:
    x, y = places[card.location.id]
    if card.is_point:
        return x - LINE, y - LINE, x + LINE, y + LINE
    left, upper = x - STRIP // 2, y - HEAD + LINE
    return left, upper, left + card.width, upper + card.height


def _graph(edges: Sequence[Edge], blocks: Mapping[int, Block], cards: Sequence[Card]) -> str:
    """Return what Graphviz is asked: cards as boxes, with a port below the location."""
    found = ["digraph {", "rankdir=TB; splines=polyline; nodesep=0.15; ranksep=0.25;"]
    found.append("node [shape=plain]; edge [arrowhead=none]")
    names = {card.location.id: card.is_point for card in cards}
    for card in cards:
        name, height = card.location.id, card.height
        if card.is_point:
            found.append(f'"{name}" [shape=circle, fixedsize=true, width=0.4, label=""]')
            continue
        cells = (
            f'<TD PORT="p" FIXEDSIZE="TRUE" WIDTH="{STRIP}" HEIGHT="{height}"></TD>'
            f'<TD FIXEDSIZE="TRUE" WIDTH="{card.width - STRIP}" HEIGHT="{height}"></TD>'
        )
        table = '<TABLE BORDER="0" CELLBORDER="0" CELLSPACING="0" CELLPADDING="0">'
        found.append(f'"{name}" [label=<{table}<TR>{cells}</TR></TABLE>>]')
    for number, place in blocks.items():
        edge = edges[number]
        table = f'<TABLE BORDER="0" FIXEDSIZE="TRUE" WIDTH="{place.width}" HEIGHT="{place.height}">'
        shown = f", label=<{table}<TR><TD></TD></TR></TABLE>>" if place.places else ""
        tail = f'"{edge.source}"' + ("" if names[edge.source] else ":p")
        head = f'"{edge.target}"' + ("" if names[edge.target] else ":p")
        found.append(f'{tail} -> {head} [id="{number}"{shown}]')
    return "\n".join([*found, "}"])


def _point(text: str, height: float) -> Point:
    x, y = text.split(",")[-2:]
    return round(float(x)), round(height - float(y))


# --- the grid -------------------------------------------------------------------------------------


def _on_a_grid(template: Template, cards: Sequence[Card], free: Collection[int]) -> Drawing:
    """Place each location in the row of its distance from the start, its labels below its card."""
    after: dict[str, list[str]] = {}
    for edge in template.edges:
        after.setdefault(edge.source, []).append(edge.target)
    depth = {template.initial: 0}
    order = [template.initial]
    for one in order:
        for target in after.get(one, ()):
            if target not in depth:
                depth[target] = depth[one] + 1
                order.append(target)
    below: dict[str, list[tuple[int, Block]]] = {}
    for number in sorted(free):
        edge = template.edges[number]
        below.setdefault(edge.source, []).append((number, block(edge, WIDE)))
    rows: dict[int, list[Card]] = {}
    for card in cards:
        rows.setdefault(depth.get(card.location.id, 0), []).append(card)
    places: dict[str, Point] = {}
    ways: dict[int, Edge] = {}
    top, width = HEAD, 0
    for _, row in sorted(rows.items()):
        left, lowest = 0, top
        for card in row:
            name = card.location.id
            places[name] = left, top
            own = below.get(name, [])
            y = top + card.height - HEAD // 2
            for number, place in own:
                nail = left - 4, y + place.height // 2
                drawn = replace(template.edges[number], nails=(nail,))
                ways[number] = labelled(drawn, place, (left + STRIP // 2 + 4, y))
                y += place.height
            left += max([card.width, *(STRIP + place.width for _, place in own)]) + BETWEEN
            lowest, width = max(lowest, y), max(width, left)
        top = lowest + HEAD + BETWEEN
    return Drawing(places, ways, width, top)
