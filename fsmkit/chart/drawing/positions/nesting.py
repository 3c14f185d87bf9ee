"""Lay composite states out one by one, from the inside out.

Graphviz lays a whole chart out best, but it takes minutes for hundreds of nested states, or fails.
Here each composite state is a graph of its own, in which inner composite states are boxes. An
arrow that crosses borders only decides the order of these boxes, and is routed later.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from fsmkit.chart.drawing.graphviz.engine import run_graphviz
from fsmkit.chart.drawing.layout import INCH, numbers
from fsmkit.chart.drawing.positions.curves import moved
from fsmkit.chart.drawing.positions.placement import Arrow, Rect
from fsmkit.chart.drawing.positions.placing import MARGIN, Item
from fsmkit.chart.drawing.positions.routing import arrow_of
from fsmkit.diagnostics.parsing import parse_json

MANY = 60
"""Boxes of a graph above which Graphviz improves its layout less."""
FAST = "nslimit=1, nslimit1=1, mclimit=0.3, splines=line"

MOST_LONG, LONG = 1_500.0, 4.0
"""Points of a row or a column, and how many times longer than wide it is, before it is cut."""
SHAPE = 1.4
"""Wanted width of a drawing, in heights."""
BETWEEN = 60.0
"""Points between the pieces: room for arrows with labels."""


@dataclass(frozen=True, slots=True)
class Tie:
    """An arrow between two items by their names, with its attributes for Graphviz."""

    name: str
    tail: str
    head: str
    attributes: str = ""


@dataclass(slots=True)
class Nested:
    """The result: rectangles relative to the parents, and arrows relative to one of the items.

    ``sizes``: the sizes of composite states. ``arrows``: by their names, the item in which the
    arrow is (empty: the whole drawing) and the arrow relative to its upper left corner.
    """

    places: dict[str, Rect] = field(default_factory=dict)
    sizes: dict[str, tuple[float, float]] = field(default_factory=dict)
    arrows: dict[str, tuple[str, Arrow]] = field(default_factory=dict)


def lay_out_nested(
    head: str, items: Sequence[Item], ties: Sequence[Tie], only: Collection[str]
) -> Nested:
    """Return the layout of some composite states.

    Args:
        head: The first lines of a graph, with the attributes of all nodes.
        items: All boxes, parents before their children.
        ties: All arrows.
        only: The composite states to lay out; the empty name is the whole drawing.

    Raises:
        FsmkitError: ``missing-graphviz``, ``drawing-failed``.

    """
    parents = {item.name: item.parent for item in items}
    children: dict[str, list[Item]] = {}
    for item in items:
        children.setdefault(item.parent, []).append(item)
    inside = _ties_by_composite(ties, parents)
    found = Nested()
    names = [item.name for item in reversed(items) if item.is_container]
    tops = {item.name: item for item in items}
    for name in (*names, ""):
        if name not in only or name not in children:
            continue
        title = tops[name] if name else Item("", "", 0, 0)
        left, top = (MARGIN, MARGIN + title.height) if name else (0.0, 0.0)
        width, height = _lay_out(
            head, name, children[name], inside.get(name, ()), (left, top), found
        )
        found.sizes[name] = max(width + 2 * left, title.width), height + top + MARGIN
    return found


def _ties_by_composite(
    ties: Sequence[Tie], parents: Mapping[str, str]
) -> dict[str, list[tuple[Tie, str, str]]]:
    """Return for each composite state the arrows between its children, or what is in those."""
    found: dict[str, list[tuple[Tie, str, str]]] = {}
    for tie in ties:
        tails, heads = [*_line(tie.tail, parents)], [*_line(tie.head, parents)]
        while tails and heads and tails[-1] == heads[-1]:
            around = tails.pop()
            heads.pop()
        if tails and heads:
            around = parents[tails[-1]]
            found.setdefault(around, []).append((tie, tails[-1], heads[-1]))
    return found


def _line(name: str, parents: Mapping[str, str]) -> Iterator[str]:
    """Yield an item and the items around it."""
    while name:
        yield name
        name = parents.get(name, "")


def _lay_out(
    head: str,
    name: str,
    children: Sequence[Item],
    ties: Sequence[tuple[Tie, str, str]],
    corner: tuple[float, float],
    found: Nested,
) -> tuple[float, float]:
    """Lay the children of a composite state out; return the size of the result."""
    numbered = {item.name: number for number, item in enumerate(children)}
    lines = [head, 'graph [label=""];']
    if len(children) > MANY:
        lines.append(f"graph [{FAST}];")
    for number, item in enumerate(children):
        width, height = found.sizes.get(item.name, (item.width, item.height))
        lines.append(
            f'n{number} [shape=box, label="", fixedsize=true, width={width / INCH:.5f}, '
            f"height={height / INCH:.5f}];"
        )
    for number, (tie, tail, end) in enumerate(ties):
        is_whole = (tail, end) == (tie.tail, tie.head)
        more = f", {tie.attributes}" if is_whole and tie.attributes else ""
        lines.append(f'n{numbered[tail]} -> n{numbered[end]} [id="{number}"{more}];')
    content = run_graphviz("\n".join((*lines, "}")), ("json",), is_small=True)
    read = parse_json(content, strict=False)
    left, _, _, top = numbers(read["bb"])
    places: dict[str, Rect] = {}
    for each in read.get("objects", ()):
        x, y = numbers(each["pos"])
        item = children[int(each["name"][1:])]
        width, height = found.sizes.get(item.name, (item.width, item.height))
        places[item.name] = Rect(x - left - width / 2, top - y - height / 2, width, height)
    moves = _wrap(places)
    dx, dy = corner
    for item_name, box in places.items():
        x, y = moves.get(item_name, (0.0, 0.0))
        found.places[item_name] = replace(box, x=box.x + x + dx, y=box.y + y + dy)
    arrows: list[Arrow] = []
    for each in read.get("edges", ()):
        tie, tail, end = ties[int(each["id"])]
        if (tail, end) != (tie.tail, tie.head) or "pos" not in each or ";" in each["pos"]:
            continue
        move = moves.get(tail, (0.0, 0.0))
        if move != moves.get(end, (0.0, 0.0)):
            continue
        label = numbers(each["lp"]) if "lp" in each else None
        arrow = arrow_of(each["pos"], None if label is None else (label[0], label[1]))
        arrows.append(moved(arrow, move[0] + dx - left, move[1] + dy + top))
        found.arrows[tie.name] = name, arrows[-1]
    points = [point for arrow in arrows for point in (*arrow.points, arrow.label or (0.0, 0.0))]
    boxes = [found.places[each] for each in places]
    return (
        max((*(box.right for box in boxes), *(x for x, _ in points)), default=dx) - dx,
        max((*(box.bottom for box in boxes), *(y for _, y in points)), default=dy) - dy,
    )


def _wrap(places: Mapping[str, Rect]) -> dict[str, tuple[float, float]]:
    """Return by how much boxes are moved, so that a long row or column becomes several.

    Such a layout has no shape on a screen. It is cut across, and the pieces stand side by side.
    """
    if not places:
        return {}
    boxes = places.values()
    width = max(box.right for box in boxes) - min(box.x for box in boxes)
    height = max(box.bottom for box in boxes) - min(box.y for box in boxes)
    is_tall = height > width
    long, short = (height, width) if is_tall else (width, height)
    if not is_long(long, short):
        return {}
    wanted = SHAPE if is_tall else 1 / SHAPE
    count = max(1, round((wanted * long / (short + BETWEEN)) ** 0.5))
    ordered = sorted(places, key=lambda name: places[name].y if is_tall else places[name].x)
    bands: list[list[str]] = []
    start, end = 0.0, 0.0
    for name in ordered:
        low, high = _extent(places[name], is_tall)
        if not bands or (high - start > long / count * 1.05 and low >= end):
            start = low
            bands.append([])
        end = max(end, high)
        bands[-1].append(name)
    moves: dict[str, tuple[float, float]] = {}
    across = 0.0
    for band in bands:
        start = min(_extent(places[name], is_tall)[0] for name in band)
        sides = [_extent(places[name], not is_tall) for name in band]
        side = across - min(low for low, _ in sides)
        moves |= dict.fromkeys(band, (side, -start) if is_tall else (-start, side))
        across = max(high for _, high in sides) + side + BETWEEN
    return moves


def is_long(long: float, short: float) -> bool:
    """Whether a drawing of these sides is too long for a screen."""
    return long > MOST_LONG and long > LONG * short


def _extent(box: Rect, is_down: bool) -> tuple[float, float]:
    """Return where a box starts and ends, downwards or to the right."""
    return (box.y, box.bottom) if is_down else (box.x, box.right)
