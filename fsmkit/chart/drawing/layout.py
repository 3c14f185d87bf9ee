"""A layout by Graphviz, improved: regions of equal height, and no label across a border.

``dot`` makes clusters as high as what is in them, and puts the labels of arrows where there is room
among nodes, whatever borders of clusters are there. The result is a text for ``neato -n2``, which
draws a layout as it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from fsmkit.chart.drawing.graph_text import Attribute, statements
from fsmkit.diagnostics.parsing import parse_json

BETWEEN = b"\n}\n{\n"
"""Where the text of a layout ends and its JSON starts."""
INCH = 72.0
GAP = 2.0
"""Points that a label keeps from all else."""
STEP, FARTHEST = 4, 72
"""Points: a label is moved by multiples of the one, at most by the other."""
CROSSED = 16.0
"""Points that a label is rather moved than to stand on an arrow."""
RING = 8 / INCH
"""Inches by which a second periphery makes a node wider: ``neato`` adds it once more."""
HALVINGS = 4
"""How often a curve is halved until its control points are near it."""
PIECES = 12
"""Points of a curve between two of its ends, by which an arrow is known."""
TOUCH = 1.5
"""Points between a border and an arrow that ends there."""


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle in points; upwards numbers grow."""

    left: float
    bottom: float
    right: float
    top: float

    def meets(self, other: Box, gap: float = 0) -> bool:
        """Whether another one overlaps it, or is nearer than a gap."""
        return (
            self.left - gap < other.right
            and other.left < self.right + gap
            and self.bottom - gap < other.top
            and other.bottom < self.top + gap
        )

    def has(self, other: Box, gap: float = 0) -> bool:
        """Whether another one lies in it, a gap away from its border."""
        return (
            self.left + gap <= other.left
            and other.right <= self.right - gap
            and self.bottom + gap <= other.bottom
            and other.top <= self.top - gap
        )

    def holds(self, x: float, y: float) -> bool:
        """Whether a point lies in it."""
        return self.left <= x <= self.right and self.bottom <= y <= self.top

    def moved(self, dx: float, dy: float) -> Box:
        """Return it at another place."""
        return Box(self.left + dx, self.bottom + dy, self.right + dx, self.top + dy)


@dataclass(slots=True)
class Cluster:
    """A state with states in it: its border, its title, and the numbers of its nodes."""

    name: str
    box: Box
    title: Box | None
    is_region: bool
    nodes: frozenset[int]
    parent: str = ""
    rise: float = 0
    """By how much its top, and so its title, was moved up."""


@dataclass(frozen=True, slots=True)
class Label:
    """A text beside an arrow or a node: whose it is, the attribute of its place, its rectangle.

    ``around``: the node that it names; it stays in the states around that.
    """

    owner: tuple[str, str]
    key: str
    at: tuple[float, float]
    box: Box
    around: Box | None = None


@dataclass(slots=True)
class Layout:
    """The layout by ``dot``."""

    clusters: dict[str, Cluster] = field(default_factory=dict)
    nodes: dict[int, Box] = field(default_factory=dict)
    labels: list[Label] = field(default_factory=list)
    arrows: list[tuple[Box, tuple[tuple[float, float], ...]]] = field(default_factory=list)
    """For each arrow the points of its curve, and the box around them."""
    ends: list[tuple[float, float]] = field(default_factory=list)
    """Where arrows start and end."""


def improve_layout(content: bytes) -> str:
    """Return a text for ``neato -n2``.

    Args:
        content: What ``dot -Tdot -Tjson`` writes: the text of a layout, then the same as JSON.

    """
    text, graph = split_layout(content)
    return _edit(text, improvements(graph))


def split_layout(content: bytes) -> tuple[str, Any]:
    """Return the text of a layout, and its JSON; an empty graph if that cannot be read."""
    end = content.index(BETWEEN) + 3
    try:
        return content[:end].decode(), parse_json(content[end:], strict=False)
    except ValueError:  # Graphviz writes some texts as invalid JSON
        return content[:end].decode(), {}


def improvements(graph: Any) -> Edits:
    """Return new values of attributes of a layout: equal regions, and labels beside borders."""
    layout = _layout_of(graph)
    edits: Edits = {}
    for owner, values in (*_equalize(layout).items(), *_free_labels(layout).items()):
        edits[owner] = {**edits.get(owner, {}), **values}
    return edits


# --- what was laid out -----------------------------------------------------------------------


def _layout_of(read: Any) -> Layout:
    layout = Layout()
    objects = read.get("objects", [])
    by_number = {each["_gvid"]: each for each in objects}
    for each in objects:
        name = each["name"]
        if "bb" in each and name.startswith("cluster"):
            layout.clusters[name] = Cluster(
                name, Box(*numbers(each["bb"])), _title(each),
                "dashed" in each.get("style", "").split(","), frozenset(each.get("nodes", ())),
            )  # fmt: skip
        elif "pos" in each:
            (x, y), (w, h) = numbers(each["pos"]), (float(each[k]) for k in ("width", "height"))
            box = _centred(x, y, w * INCH, h * INCH)
            if each.get("style") != "invis":
                layout.nodes[each["_gvid"]] = box
            layout.labels += (
                replace(n, around=box) for n in _labels_of(("node", name), "xlp", each)
            )
    for each in objects:
        inner = (by_number[number]["name"] for number in each.get("subgraphs", ()))
        for name in inner:
            if name in layout.clusters and each["name"] in layout.clusters:
                layout.clusters[name].parent = each["name"]
    for each in read.get("edges", []):
        if each.get("style") == "invis" or "pos" not in each:
            continue
        layout.labels += _labels_of(("edge", each.get("id", "")), "lp", each)
        for curve in each["pos"].split(";"):
            points = tuple(curve_points(curve))
            xs, ys = zip(*points, strict=True)
            layout.arrows.append((Box(min(xs), min(ys), max(xs), max(ys)), points))
            layout.ends += (points[0], points[-1])
    return layout


def numbers(text: str) -> tuple[float, ...]:
    """Return the numbers of a list with commas."""
    return tuple(map(float, text.split(",")))


def _centred(x: float, y: float, width: float, height: float) -> Box:
    return Box(x - width / 2, y - height / 2, x + width / 2, y + height / 2)


def _title(entry: Mapping[str, Any]) -> Box | None:
    if "lp" not in entry:
        return None
    x, y = numbers(entry["lp"])
    return _centred(x, y, float(entry["lwidth"]) * INCH, float(entry["lheight"]) * INCH)


def _labels_of(owner: tuple[str, str], key: str, entry: Mapping[str, Any]) -> Iterator[Label]:
    """Yield the label of a node or an arrow whose place has that key, if it has one."""
    texts = [*_text_boxes(entry.get("_ldraw_", ()))]
    if key not in entry or not texts or not owner[1]:
        return
    x, y = numbers(entry[key])
    box = Box(
        min(t.left for t in texts), min(t.bottom for t in texts),
        max(t.right for t in texts), max(t.top for t in texts),
    )  # fmt: skip
    yield Label(owner, key, (x, y), box)


def _text_boxes(operations: Iterable[Mapping[str, Any]]) -> Iterator[Box]:
    """Yield the rectangles of texts that are not blank."""
    size = 0.0
    for each in operations:
        if each["op"] == "F":
            size = each["size"]
        elif each["op"] == "T" and each["text"].strip():
            (x, y), width = each["pt"], each["width"]
            left = x - {"l": 0, "c": width / 2, "r": width}[each["align"]]
            yield Box(left, y - 0.25 * size, left + width, y + 0.8 * size)


def curve_points(text: str) -> Iterator[tuple[float, float]]:
    """Yield points of a curve: of its arrowheads, and between the ends of its pieces."""
    heads = {word[0]: numbers(word[2:]) for word in text.split() if word[0] in "se"}
    ends = control_points(text)
    if "s" in heads:
        yield heads["s"][0], heads["s"][1]
    for a, b, c, d in zip(ends[0::3], ends[1::3], ends[2::3], ends[3::3], strict=False):
        for piece in range(PIECES):
            t = piece / PIECES
            u = 1 - t
            x, y = (
                u**3 * p + 3 * u * u * t * q + 3 * u * t * t * r + t**3 * s
                for p, q, r, s in zip(a, b, c, d, strict=True)
            )
            yield x, y
    yield ends[-1][0], ends[-1][1]
    if "e" in heads:
        yield heads["e"][0], heads["e"][1]


# --- regions ---------------------------------------------------------------------------------

Edits = dict[tuple[str, str], dict[str, str]]
"""New values of attributes of clusters, nodes and arrows."""


def _equalize(layout: Layout) -> Edits:
    """Make the regions of each parallel state as high as all of them together."""
    groups: dict[str, list[Cluster]] = {}
    for cluster in layout.clusters.values():
        if cluster.is_region:
            groups.setdefault(cluster.parent, []).append(cluster)
    edits: Edits = {}
    for regions in groups.values():
        top = max(region.box.top for region in regions)
        bottom = min(region.box.bottom for region in regions)
        for region in regions:
            old = region.box
            for side in ({"top": top}, {"bottom": bottom}):
                wanted = replace(region.box, **side)
                if wanted != region.box and _has_room(region, wanted, layout):
                    region.rise = wanted.top - old.top
                    region.box = wanted
            if region.box != old:
                edits["graph", region.name] = _of_cluster(region)
    return edits


def _has_room(region: Cluster, grown_box: Box, layout: Layout) -> bool:
    """Whether a region can grow: no other node is there, and no arrow ends at its border."""
    old = region.box
    grown = (
        replace(grown_box, bottom=old.top)
        if grown_box.top > old.top
        else replace(grown_box, top=old.bottom)
    )
    border = old.top if grown_box.top > old.top else old.bottom
    if any(old.left <= x <= old.right and abs(y - border) < TOUCH for x, y in layout.ends):
        return False
    if any(grown.meets(box) for n, box in layout.nodes.items() if n not in region.nodes):
        return False
    others = (c.box for c in layout.clusters.values() if c is not region)
    return not any(grown.meets(box) and not box.has(grown) for box in others)


def _of_cluster(cluster: Cluster) -> dict[str, str]:
    box, title = cluster.box, cluster.title
    found = {"bb": f"{box.left:.5g},{box.bottom:.5g},{box.right:.5g},{box.top:.5g}"}
    if title is not None and cluster.rise:
        cluster.title = title = title.moved(0, cluster.rise)
        x, y = (title.left + title.right) / 2, (title.bottom + title.top) / 2
        found["lp"] = f"{x:.5g},{y:.5g}"
    return found


# --- labels ----------------------------------------------------------------------------------


def _free_labels(layout: Layout) -> Edits:
    """Move each label that stands on a border, a node or another text to the next free place."""
    borders = [cluster.box for cluster in layout.clusters.values()]
    taken = [*layout.nodes.values()]
    taken += (c.title for c in layout.clusters.values() if c.title is not None)
    boxes = [label.box for label in layout.labels]
    edits: Edits = {}
    for place, label in enumerate(layout.labels):
        others = [*taken, *boxes[:place], *boxes[place + 1 :]]
        if _is_free(label, label.box, borders, others):
            continue
        found = _next_place(label, borders, others, layout.arrows)
        if found is None:
            continue
        dx, dy = found
        boxes[place] = label.box.moved(dx, dy)
        edits[label.owner] = {label.key: f"{label.at[0] + dx:.5g},{label.at[1] + dy:.5g}"}
    return edits


def _is_free(label: Label, there: Box, borders: Sequence[Box], others: Sequence[Box]) -> bool:
    """Whether a label can stand there: on no border, on nothing else, and by its node."""
    for border in borders:
        is_in = border.has(there, GAP)
        if not is_in and border.meets(there, GAP):
            return False
        if label.around is not None and border.has(label.around) != is_in:
            return False
    return not any(other.meets(there) for other in others)


def _next_place(
    label: Label,
    borders: Sequence[Box],
    others: Sequence[Box],
    arrows: Sequence[tuple[Box, tuple[tuple[float, float], ...]]],
) -> tuple[float, float] | None:
    """Return by how much a label is moved; None if there is no free place near."""
    box = label.box
    reach = Box(
        box.left - FARTHEST, box.bottom - FARTHEST, box.right + FARTHEST, box.top + FARTHEST
    )
    borders = [b for b in borders if b.meets(reach, GAP)]
    others = [b for b in others if b.meets(reach)]
    near = [points for around, points in arrows if around.meets(reach, 1)]
    best, cost = None, float("inf")
    for distance, dx, dy in MOVES:
        if distance >= cost:
            break
        there = box.moved(dx, dy)
        if _is_free(label, there, borders, others):
            crossed = sum(any(there.holds(*point) for point in points) for points in near)
            if distance + CROSSED * crossed < cost:
                best, cost = (dx, dy), distance + CROSSED * crossed
    return best


MOVES = sorted(
    ((dx * dx + dy * dy) ** 0.5, float(dx), float(dy))
    for dx in range(-FARTHEST, FARTHEST + 1, STEP)
    for dy in range(-FARTHEST, FARTHEST + 1, STEP)
)
"""All ways to move a label, the shortest first."""


# --- the text --------------------------------------------------------------------------------


def _edit(text: str, edits: Edits) -> str:
    """Return a text of Graphviz in which attributes have other values, and which is drawn as it is.

    ``neato`` makes a node with two peripheries wider once more, and a drawing so large that all
    control points of curves are in it.
    """
    pieces: list[tuple[int, int, str]] = []
    whole: Box | None = None
    for each in statements(text):
        owner, attributes = each.owner, each.attributes
        new = dict(edits.get(owner, {}))
        if owner[0] == "graph" and whole is None and "bb" in attributes:
            whole = Box(*numbers(attributes["bb"].value))
        if owner[0] == "node" and _has_ring(attributes):
            new |= {k: f"{float(attributes[k].value) - RING:.5g}" for k in ("width", "height")}
        if owner[0] == "edge" and whole is not None and "pos" in attributes:
            is_seen = _value(attributes, "style") != "invis"
            curves = new.get("pos", attributes["pos"].value).split(";")
            new["pos"] = ";".join(
                _subdivide(c, whole) if is_seen else _straighten(c) for c in curves
            )
        for key, value in new.items():
            if key in attributes and attributes[key].value != value:
                pieces.append((attributes[key].start, attributes[key].end, f'"{value}"'))
    found: list[str] = []
    done = 0
    for start, end, value in sorted(pieces):
        found += (text[done:start], value)
        done = end
    return "".join((*found, text[done:]))


def _has_ring(attributes: Mapping[str, Attribute]) -> bool:
    return "doublecircle" in _value(attributes, "shape") or _value(attributes, "peripheries") == "2"


def _value(attributes: Mapping[str, Attribute], key: str) -> str:
    return attributes[key].value if key in attributes else ""


def _subdivide(curve: str, whole: Box) -> str:
    """Return a curve whose control points do not lie outside of a drawing, if it does not."""
    heads = [word for word in curve.split() if word[0] in "se"]
    points = control_points(curve)
    for _ in range(HALVINGS):
        if all(whole.holds(x, y) for x, y in points):
            break
        halves = points[:1]
        for a, b, c, d in zip(points[0::3], points[1::3], points[2::3], points[3::3], strict=False):
            ab, bc, cd = _middle(a, b), _middle(b, c), _middle(c, d)
            abc, bcd = _middle(ab, bc), _middle(bc, cd)
            halves += (ab, abc, _middle(abc, bcd), bcd, cd, d)
        points = halves
    return format_curve(heads, points)


def _straighten(curve: str) -> str:
    """Return a line from the start of a curve to its end."""
    first, *_, last = control_points(curve)
    return format_curve([], [first, first, last, last])


def format_curve(heads: Sequence[str], points: Iterable[tuple[float, ...]]) -> str:
    """Return a curve: where its arrowheads are, and its points."""
    return " ".join((*heads, *(f"{x:.5g},{y:.5g}" for x, y in points)))


def control_points(curve: str) -> list[tuple[float, ...]]:
    """Return the control points of a curve, without those of arrowheads."""
    return [numbers(word) for word in curve.split() if word[0] not in "se"]


def _middle(one: tuple[float, ...], other: tuple[float, ...]) -> tuple[float, ...]:
    return tuple((a + b) / 2 for a, b in zip(one, other, strict=True))
