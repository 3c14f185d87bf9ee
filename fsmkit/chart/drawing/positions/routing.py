"""Route arrows around the states of a drawing.

Graphviz routes only the given arrows, and sees only the states near them: its time grows with the
cube of the states. An arrow that then meets another state is routed again with that.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from fsmkit.chart.drawing.graphviz.engine import run_graphviz
from fsmkit.chart.drawing.layout import INCH, control_points, numbers
from fsmkit.chart.drawing.positions.curves import (
    along,
    curves_of,
    cut_start,
    moved,
    points_of,
    reversed_curves,
)
from fsmkit.chart.drawing.positions.placement import Arrow, Rect
from fsmkit.diagnostics.parsing import parse_json

CORRIDOR = 40.0
"""Points beside the line between two states in which other states are seen at first."""
MOST_SEEN, MOST_ROUTED = 60, 16
"""States and arrows of one run, unless the states of one arrow are more."""
ROUNDS = 3
APART = 22.0
"""Points between the inner control points of two arrows of the same ends."""
WIDEST = 90.0
"""Points between the inner control points of all arrows of the same ends."""
BENDS = (1.0, 0.7, 0.4, 0.2)
"""Parts of the wanted bend that are tried."""
CORNER, AT_BORDER = 8.0, 2.0
"""Points that an end keeps from corners, and within which it is at a border."""
CLEAR = 1.0
"""Points that an arrow may be in a state it only touches."""


@dataclass(frozen=True, slots=True)
class Link:
    """An arrow to be routed, between nodes of the graph.

    ``tail`` and ``head`` may have a port after a colon. ``clips``: boxes at whose borders the arrow
    starts and ends. ``direction``: ``forward``, ``back`` or ``none``, as in Graphviz.
    """

    name: str
    tail: str
    head: str
    direction: str = "forward"
    clips: tuple[Rect | None, Rect | None] = (None, None)

    @property
    def ends(self) -> tuple[str, str]:
        """The nodes at its ends."""
        return self.tail.split(":")[0], self.head.split(":")[0]


@dataclass(frozen=True, slots=True)
class Node:
    """A node that arrows avoid: its rectangle, and the attributes of its outline."""

    box: Rect
    outline: str = "shape=box"


@dataclass(slots=True)
class _Batch:
    links: list[Link] = field(default_factory=list)
    seen: set[str] = field(default_factory=set)


def route(head: str, links: Sequence[Link], nodes: Mapping[str, Node]) -> dict[str, Arrow]:
    """Return the arrows of links by their names, without labels.

    Args:
        head: The first lines of a graph, with the attributes of all nodes.
        links: The arrows; those of the same ends should be together.
        nodes: All nodes of the drawing.

    Raises:
        FsmkitError: ``missing-graphviz``, ``drawing-failed``.

    """
    found: dict[str, Arrow] = {}
    seen = {link.name: _near(link, nodes) for link in links}
    waiting = [*links]
    for round_ in range(ROUNDS):
        for batch in _batches(waiting, seen):
            found |= _routed(head, batch, nodes)
        again: list[Link] = []
        for link in waiting:
            met = _met(found.get(link.name), link, nodes) - seen[link.name]
            if met:
                seen[link.name] |= met
                again.append(link)
        if not again or round_ == ROUNDS - 1:
            break
        waiting = _with_parallels(again, waiting, seen)
    found |= dict(_apart(links, found, nodes))
    links_by_name = {link.name: link for link in links}
    return {name: _clipped(arrow, links_by_name[name].clips) for name, arrow in found.items()}


def _with_parallels(
    again: Sequence[Link], links: Sequence[Link], seen: dict[str, set[str]]
) -> list[Link]:
    """Return the links of the same ends as those, which are kept apart from each other."""
    ends: dict[frozenset[str], set[str]] = {}
    for link in again:
        ends.setdefault(frozenset(link.ends), set()).update(seen[link.name])
    found = [link for link in links if frozenset(link.ends) in ends]
    for link in found:
        seen[link.name] |= ends[frozenset(link.ends)]
    return found


def _apart(
    links: Sequence[Link], arrows: Mapping[str, Arrow], nodes: Mapping[str, Node]
) -> Iterator[tuple[str, Arrow]]:
    """Yield bent arrows for those of the same ends, which Graphviz routes on top of each other.

    They are bent less where they would meet another state.
    """
    groups: dict[frozenset[str], list[Link]] = {}
    for link in links:
        if link.name in arrows and link.ends[0] != link.ends[1]:
            groups.setdefault(frozenset(link.ends), []).append(link)
    for group in groups.values():
        between = min(APART, WIDEST / len(group))
        for number, link in enumerate(group):
            aside = between * (number - (len(group) - 1) / 2)
            aside *= -1 if link.ends < group[0].ends else 1
            old = arrows[link.name]
            met = _met(old, link, nodes)
            boxes = [
                None if clip is not None else nodes[end].box
                for end, clip in zip(link.ends, link.clips, strict=True)
            ]
            for part in BENDS if aside else ():
                bent = _bent(old, aside * part, boxes[0], boxes[1])
                if _met(bent, link, nodes) <= met:
                    yield link.name, bent
                    break


def _bent(arrow: Arrow, aside: float, tail: Rect | None, head: Rect | None) -> Arrow:
    """Return an arrow whose inner points are moved aside, seen from its start.

    Its ends move along the borders of the boxes there, half as far.
    """
    (x1, y1), *inner, (x2, y2) = arrow.points
    length = ((x2 - x1) ** 2 + (y2 - y1) ** 2) ** 0.5 or 1.0
    dx, dy = -(y2 - y1) / length * aside, (x2 - x1) / length * aside
    tips = {end: (x, y) for end, x, y in arrow.heads}
    start = _along_border(tips.get("s", (x1, y1)), dx / 2, dy / 2, tail)
    end = _along_border(tips.get("e", (x2, y2)), dx / 2, dy / 2, head)
    moves = {"s": start, "e": end}
    return Arrow(
        (
            (x1 + start[0], y1 + start[1]),
            *((x + dx, y + dy) for x, y in inner),
            (x2 + end[0], y2 + end[1]),
        ),
        tuple((word, x + moves[word][0], y + moves[word][1]) for word, x, y in arrow.heads),
    )


def _along_border(
    point: tuple[float, float], dx: float, dy: float, box: Rect | None
) -> tuple[float, float]:
    """Return by how much the end of an arrow at a border can be moved; corners are round."""
    x, y = point
    if box is None or min(box.width, box.height) < 3 * CORNER:
        return 0.0, 0.0
    if min(abs(y - box.y), abs(y - box.bottom)) < AT_BORDER:
        return min(max(x + dx, box.x + CORNER), box.right - CORNER) - x, 0.0
    if min(abs(x - box.x), abs(x - box.right)) < AT_BORDER:
        return 0.0, min(max(y + dy, box.y + CORNER), box.bottom - CORNER) - y
    return 0.0, 0.0


def _near(link: Link, nodes: Mapping[str, Node]) -> set[str]:
    """Return the nodes that the line between the ends of a link meets, or nearly."""
    tail, head = (nodes[end].box for end in link.ends)
    (x1, y1), (x2, y2) = tail.centre, head.centre
    left, right = min(x1, x2) - CORRIDOR, max(x1, x2) + CORRIDOR
    top, bottom = min(y1, y2) - CORRIDOR, max(y1, y2) + CORRIDOR
    dx, dy = x2 - x1, y2 - y1
    length = (dx * dx + dy * dy) ** 0.5 or 1.0
    found: set[str] = set()
    for name, node in nodes.items():
        box = node.box
        if box.x > right or box.right < left or box.y > bottom or box.bottom < top:
            continue
        x, y = box.centre
        away = abs((x - x1) * dy - (y - y1) * dx) / length
        # half of the extent of the box across the line
        across = (abs(dy) * box.width + abs(dx) * box.height) / (2 * length)
        if away <= across + CORRIDOR:
            found.add(name)
    return found | set(link.ends)


def _met(arrow: Arrow | None, link: Link, nodes: Mapping[str, Node]) -> set[str]:
    """Return the nodes that an arrow meets, besides those at its ends."""
    if arrow is None:
        return set()
    points = along(arrow)
    xs, ys = [x for x, _ in points], [y for _, y in points]
    around = Rect(min(xs), min(ys), max(xs) - min(xs), max(ys) - min(ys))
    found: set[str] = set()
    for name, node in nodes.items():
        if name not in link.ends and node.box.meets(around, 1):
            box = node.box
            inner = Rect(
                box.x + CLEAR, box.y + CLEAR, box.width - 2 * CLEAR, box.height - 2 * CLEAR
            )
            if any(inner.holds(x, y) for x, y in points):
                found.add(name)
    return found


def _batches(links: Sequence[Link], seen: Mapping[str, set[str]]) -> Iterator[_Batch]:
    """Yield links with the nodes that they see; those of the same ends together."""
    groups: dict[frozenset[str], list[Link]] = {}
    for link in links:
        groups.setdefault(frozenset(link.ends), []).append(link)
    batch = _Batch()
    for group in groups.values():
        all_seen = set().union(*(seen[link.name] for link in group))
        is_full = (
            len(batch.seen | all_seen) > MOST_SEEN or len(batch.links) + len(group) > MOST_ROUTED
        )
        if batch.links and is_full:
            yield batch
            batch = _Batch()
        batch.links += group
        batch.seen |= all_seen
    if batch.links:
        yield batch


def _routed(head: str, batch: _Batch, nodes: Mapping[str, Node]) -> Iterator[tuple[str, Arrow]]:
    """Yield the arrows of one run of Graphviz."""
    lines = [head, 'graph [splines=true, label=""];']
    first = next(iter(batch.seen))
    for name in sorted(batch.seen):
        box = nodes[name].box
        x, y = box.centre
        lines.append(
            f'{name} [pos="{x:.6g},{-y:.6g}", width={box.width / INCH:.5f}, '
            f"height={box.height / INCH:.5f}, {nodes[name].outline}];"
        )
    for number, link in enumerate(batch.links):
        lines.append(f'{link.tail} -> {link.head} [id="{number}", dir={link.direction}];')
    content = run_graphviz("\n".join((*lines, "}")), ("json",), "neato -n2", is_small=True)
    read = parse_json(content, strict=False)
    dx, dy = _shift(read, first, nodes[first].box)
    for each in read.get("edges", ()):
        if "pos" in each and ";" not in each["pos"]:
            yield batch.links[int(each["id"])].name, moved(arrow_of(each["pos"]), -dx, dy)


def _shift(read: Any, name: str, box: Rect) -> tuple[float, float]:
    """Return by how much Graphviz moved the whole drawing; its y grows upwards."""
    for each in read.get("objects", ()):
        if each["name"] == name:
            (x, y), (left, top) = numbers(each["pos"]), box.centre
            return x - left, y + top
    return 0.0, 0.0


def arrow_of(text: str, label: tuple[float, float] | None = None) -> Arrow:
    """Return the arrow of an attribute ``pos`` and the middle of its label; y grows downwards."""
    heads = [(word[0], numbers(word[2:])) for word in text.split() if word[0] in "se"]
    return Arrow(
        tuple((x, -y) for x, y in control_points(text)),
        tuple((end, x, -y) for end, (x, y) in heads),
        None if label is None else (label[0], -label[1]),
    )


def _clipped(arrow: Arrow, clips: tuple[Rect | None, Rect | None]) -> Arrow:
    """Return an arrow without its parts in the boxes at its ends."""
    tail, head = clips
    tips = {end: (x, y) for end, x, y in arrow.heads}
    curves = [*curves_of(arrow.points)]
    start, end = tips.get("s"), tips.get("e")
    if tail is not None:
        curves, start = cut_start(curves, tail, start)
    if head is not None:
        cut, end = cut_start(reversed_curves(curves), head, end)
        curves = reversed_curves(cut)
    if not curves:
        return arrow
    ends = (("s", start), ("e", end))
    return Arrow(points_of(curves), tuple((word, *tip) for word, tip in ends if tip is not None))
