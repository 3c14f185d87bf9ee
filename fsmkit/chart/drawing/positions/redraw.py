"""Lay a chart out around the positions of an earlier drawing.

The statements for Graphviz are those of any drawing. Boxes are placed here. Arrows whose ends have
not moved keep their curves, and Graphviz routes the others around the states near them.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.drawing.graph_text import Statement, statements
from fsmkit.chart.drawing.graphviz.engine import run_graphviz
from fsmkit.chart.drawing.layout import (
    INCH,
    Edits,
    improvements,
    numbers,
    split_layout,
)
from fsmkit.chart.drawing.positions.curves import along, moved
from fsmkit.chart.drawing.positions.nesting import Nested, Tie, is_long, lay_out_nested
from fsmkit.chart.drawing.positions.picture import Drawn, Text, picture
from fsmkit.chart.drawing.positions.pieces import (
    Piece,
    beside_text,
    drawn_text,
    links_of,
    measure,
)
from fsmkit.chart.drawing.positions.placement import Arrow, Placement, Rect
from fsmkit.chart.drawing.positions.placing import Item, place
from fsmkit.chart.drawing.positions.routing import Link, Node, arrow_of, route
from fsmkit.chart.drawing.positions.texts import Obstacles, label_place, text_place
from fsmkit.chart.drawing.states.boxes import shown
from fsmkit.diagnostics import FsmkitError
from fsmkit.document.document import Kind

ORDER = re.compile(r"^ *\S+ -> \{[^}]*\} \[style=invis, weight=0\];\n", re.MULTILINE)
"""Lines that keep the order of a whole layout."""
PART = re.compile(r"(s|cluster_|initial_|own_|label_|fork_)(\d+)")
PIECE = re.compile(r"t(\d+)(_\w+)?")
TITLE = (8.0, 4.0)
"""Points between the border of a cluster and its title, at the left and above."""
SMALL = ("initial_", "own_", "label_", "fork_")
MOST_WHOLE = 120
"""States that Graphviz lays out as one graph; its time grows with their square and more."""
SIZE = "size"
"""The word after a state's name for the size that it had before it was folded."""
SAME = 0.5
"""Points below which a box has not moved and has the same size."""


class Redrawn(NamedTuple):
    """A drawing in SVG, and where everything is in it."""

    svg: str
    placement: Placement


def redraw(chart: Chart, text: str, old: Placement | None) -> Redrawn:
    """Draw the text of a chart.

    Args:
        chart: The chart that the text draws.
        text: The text for Graphviz (`fsmkit.chart.drawing.states.dot`).
        old: Where things were; None or an empty one for a whole new layout.

    Raises:
        FsmkitError: ``missing-graphviz``, ``drawing-failed``.

    """
    scene = _Scene(chart, ORDER.sub("", text))
    if old is None or not old.boxes:
        old = _whole_layout(scene, text)
    nested = scene.nested(old)
    boxes = place(scene.placed_items(old, nested), old.boxes)
    _equalize(chart, boxes)
    inner = {
        name: moved(arrow, boxes[around].x, boxes[around].y) if around else arrow
        for name, (around, arrow) in nested.arrows.items()
    }
    arrows = scene.arrows(boxes, old, inner)
    return Redrawn(scene.picture(boxes, arrows), Placement(boxes, arrows, scene.hidden(boxes, old)))


def _whole_layout(scene: _Scene, text: str) -> Placement:
    """Return the layout of a chart by Graphviz; an empty one if it is too large or too long."""
    if sum(not item.is_small for item in scene.items) > MOST_WHOLE:
        return Placement()
    try:
        _, graph = split_layout(run_graphviz(text, ("dot", "json"), is_small=True))
    except FsmkitError as error:
        if error.diagnostics[0].rule.name != "drawing-failed":
            raise
        return Placement()
    found = _placement(graph, improvements(graph), scene.names)
    boxes = found.boxes.values()
    width = max((box.right for box in boxes), default=0) - min((b.x for b in boxes), default=0)
    height = max((box.bottom for box in boxes), default=0) - min((b.y for b in boxes), default=0)
    # a long one is cut into pieces side by side
    return Placement() if is_long(max(width, height), min(width, height)) else found


class _Names:
    """Names of parts that stay the same while a chart is edited."""

    def __init__(self, chart: Chart) -> None:
        self._states = [state.id for state in chart.states]
        counts: Counter[str] = Counter()
        self._transitions: list[str] = []
        for each in chart.transitions:
            name = self._ends(each)
            counts[name] += 1
            self._transitions.append(name if counts[name] == 1 else f"{name} {counts[name]}")

    def _ends(self, transition: Transition) -> str:
        targets = " ".join(self._states[target] for target in transition.targets)
        return f"{self._states[transition.source]} > {targets}"

    def part(self, node: str) -> str | None:
        """Return the name of a node or a cluster; None for any other graph."""
        found = PART.fullmatch(node)
        if found is None:
            return None
        kind, number = found[1], int(found[2])
        if kind in ("label_", "fork_"):
            return f"{self._transitions[number]} {kind[:-1]}"
        state = self._states[number]
        return state if kind in ("s", "cluster_") else f"{state} {kind[:-1]}"

    def arrow(self, own: str) -> str | None:
        """Return the name of an arrow by its id, ``t5`` or ``t5_1``."""
        found = PIECE.fullmatch(own)
        return None if found is None else self._transitions[int(found[1])] + (found[2] or "")


# --- the parts of a drawing ----------------------------------------------------------------------


@dataclass(frozen=True)
class _Scene:
    """The statements of a chart and what is known of them before anything has its place."""

    chart: Chart
    text: str

    @cached_property
    def names(self) -> _Names:
        return _Names(self.chart)

    @cached_property
    def parts(self) -> tuple[Statement, ...]:
        return tuple(statements(self.text))

    @cached_property
    def head(self) -> str:
        """The first lines of the text, with the attributes of all nodes and arrows."""
        return self.text[: self.text.index("\n", self.text.index("  edge [")) + 1]

    @cached_property
    def named(self) -> tuple[tuple[Statement, str], ...]:
        """The parts that have a place, with their names."""
        found: list[tuple[Statement, str]] = []
        for part in self.parts:
            kind, own = part.owner
            name = self.names.arrow(own) if kind == "edge" else self.names.part(own)
            if name is not None:
                found.append((part, name))
        return tuple(found)

    @cached_property
    def pieces(self) -> Mapping[tuple[str, str], Piece]:
        """The piece of each node, and of the text of each composite state and arrow."""
        wanted = {
            part.owner: drawn_text(self.text, part)
            for part in self.parts
            if part.owner[0] == "node" or "label" in part.attributes
        }
        wanted |= {
            ("beside", part.owner[1]): line
            for part in self.parts
            if (line := beside_text(self.text, part)) is not None
        }
        measured = measure(self.head, wanted.values())
        return {owner: measured.get(line, Piece()) for owner, line in wanted.items()}

    @cached_property
    def items(self) -> list[Item]:
        """The boxes to be placed, parents before their children."""
        near = _neighbours(self.chart)
        found: list[Item] = []
        for part, name in self.named:
            kind, node = part.owner
            if kind == "edge":
                continue
            size = self.pieces.get(part.owner, Piece())
            is_cluster = kind == "graph"
            if node.startswith(("label_", "fork_")):
                ends = name.rpartition(" ")[0].split(" > ")
                beside: tuple[str, ...] = (ends[0], *ends[1].split(" ")[:1])
            elif node.startswith(("initial_", "own_")):
                beside = _initial_target(self.chart, int(node.split("_")[1]))
            else:
                beside = near.get(name, ())
            found.append(
                Item(
                    name, self.names.part(part.cluster) or "",
                    size.width + (2 * TITLE[0] if is_cluster else 0),
                    size.height + (2 * TITLE[1] if is_cluster else 0), beside, is_cluster,
                    node.startswith(SMALL), node.startswith(("label_", "fork_")),
                    size.height if is_cluster else 0,
                )
            )  # fmt: skip
        return found

    # --- new composite states ----------------------------------------------------------------

    def nested(self, old: Placement) -> Nested:
        """Return the layout of composite states in which nothing was drawn before."""
        known = {
            item.parent for item in self.items if item.name in old.boxes or item.name in old.hidden
        }
        inside = {item.parent for item in self.items}
        fresh = {"", *(item.name for item in self.items if item.is_container)} & inside - known
        if not fresh:
            return Nested()
        return lay_out_nested(self.head, self.items, [*self._ties()], fresh)

    def _ties(self) -> Iterator[Tie]:
        items = {item.name for item in self.items}
        for part, name in self.named:
            if part.owner[0] != "edge":
                continue
            tail, head = (
                self.names.part(part.attributes[clip].value if clip in part.attributes else node)
                for node, clip in (
                    (part.head[0].split(":")[0], "ltail"),
                    (part.head[-1].split(":")[0], "lhead"),
                )
            )
            if tail in items and head in items:
                more = ", ".join(
                    f"{key}={self.text[each.start : each.end]}"
                    for key in ("dir", "label")
                    if (each := part.attributes.get(key)) is not None
                )
                yield Tie(name, tail, head, more)

    def placed_items(self, old: Placement, nested: Nested) -> list[Item]:
        """Return the boxes with their places in composite states that were not drawn before."""
        found: list[Item] = []
        for item in self.items:
            spot = nested.places.get(item.name) or old.hidden.get(item.name)
            width, height = nested.sizes.get(item.name, (item.width, item.height))
            size = old.hidden.get(f"{item.name} {SIZE}")
            if item.is_container and size is not None:
                width, height = max(width, size.width), max(height, size.height)
            at = None if spot is None else (spot.x, spot.y)
            found.append(replace(item, width=width, height=height, at=at))
        return found

    def hidden(self, boxes: Mapping[str, Rect], old: Placement) -> dict[str, Rect]:
        """Return where things are in folded states, from the corners of their parents."""
        drawn = shown(self.chart)
        folded = {state.id: state for state in self.chart.states if state.index not in drawn}
        found: dict[str, Rect] = {}
        for name in (*old.hidden, *old.boxes):
            state, _, rest = name.partition(" ")
            owner = self.chart.state_index.get(state)
            if name in boxes or owner is None:
                continue
            is_inside = rest in ("initial", "own", SIZE)
            if not (state in folded or (is_inside and not self.chart.states[owner].children)):
                continue
            parent = (
                state if is_inside else self.chart.states[self.chart.states[owner].parent or 0].id
            )
            around = old.boxes.get(parent)
            if name in old.boxes and around is not None:
                box = old.boxes[name]
                found[name] = replace(box, x=box.x - around.x, y=box.y - around.y)
                if rest == "initial":
                    found[f"{state} {SIZE}"] = replace(around, x=0, y=0)
            elif name in old.hidden:
                found[name] = old.hidden[name]
        return found

    # --- arrows ------------------------------------------------------------------------------

    def arrows(
        self, boxes: Mapping[str, Rect], old: Placement, inner: Mapping[str, Arrow]
    ) -> dict[str, Arrow]:
        """Return all arrows: those of unchanged ends as they were, and routed ones.

        ``inner``: the arrows of composite states that were laid out anew.
        """
        edges = [(part, name) for part, name in self.named if part.owner[0] == "edge"]
        kept = {**self._unchanged(edges, boxes, old), **inner}
        nodes = {
            part.owner[1]: Node(boxes[name], _outline(part))
            for part, name in self.named
            if part.owner[0] == "node" and name in boxes
        }
        links = [
            link
            for part, name in edges
            if name not in kept and (link := self._link(part, name, boxes, nodes)) is not None
        ]
        if not links:
            return kept
        routed = route(self.head, links, nodes)
        labels = {
            name: piece
            for part, name in edges
            if (piece := self.pieces.get(part.owner)) is not None
        }
        obstacles = self._obstacles(boxes, (*kept.values(), *routed.values()))
        obstacles.boxes += (
            _around(arrow.label, labels[name])
            for name, arrow in kept.items()
            if arrow.label is not None and name in labels
        )
        for name, arrow in routed.items():
            if name in labels:
                size = labels[name]
                spot = label_place(arrow, size.width, size.height, obstacles)
                routed[name] = replace(arrow, label=spot)
                obstacles.boxes.append(_around(spot, size))
        return {name: found for _, name in edges if (found := kept.get(name) or routed.get(name))}

    def _link(
        self, part: Statement, name: str, boxes: Mapping[str, Rect], nodes: Mapping[str, Node]
    ) -> Link | None:
        tail, head = part.head[0], part.head[-1]
        if not {tail.split(":")[0], head.split(":")[0]} <= nodes.keys():
            return None
        clips = (
            boxes.get(self.names.part(part.attributes[key].value) or "")
            if key in part.attributes
            else None
            for key in ("ltail", "lhead")
        )
        direction = part.attributes["dir"].value if "dir" in part.attributes else "forward"
        return Link(name, tail, head, direction, (next(clips), next(clips)))

    def _unchanged(
        self,
        edges: Sequence[tuple[Statement, str]],
        boxes: Mapping[str, Rect],
        old: Placement,
    ) -> dict[str, Arrow]:
        """Return the arrows whose ends moved alike or not at all, and that no moved box meets.

        Arrows of the same ends are kept together, because they keep apart from each other.
        """
        moves = {name: _move(old.boxes.get(name), box) for name, box in boxes.items()}
        leaves = {name for part, name in self.named if part.owner[0] == "node"}
        obstacles = [
            boxes[name] for name, move in moves.items() if move != (0.0, 0.0) and name in leaves
        ]
        found: dict[str, Arrow] = {}
        lost: set[frozenset[str]] = set()
        pairs: dict[str, frozenset[str]] = {}
        for part, name in edges:
            ends = {word.split(":")[0] for word in part.head if word != "->"}
            pairs[name] = frozenset(ends)
            ends |= {part.attributes[k].value for k in ("ltail", "lhead") if k in part.attributes}
            shared = {moves.get(self.names.part(end) or "") for end in ends}
            before = old.arrows.get(name)
            if before is None or len(shared) != 1 or None in shared:
                lost.add(pairs[name])
                continue
            move = shared.pop() or (0.0, 0.0)
            before = before if move == (0.0, 0.0) else moved(before, *move)
            if self._is_clear(part, before, obstacles):
                found[name] = before
            else:
                lost.add(pairs[name])
        return {name: arrow for name, arrow in found.items() if pairs[name] not in lost}

    def _is_clear(self, part: Statement, arrow: Arrow, obstacles: Sequence[Rect]) -> bool:
        """Whether an arrow and its label, in its present size, meet no obstacle."""
        size = self.pieces.get(part.owner)
        if (size is None) != (arrow.label is None):
            return False
        if not obstacles:
            return True
        if size is not None and arrow.label is not None:
            label = _around(arrow.label, size)
            if any(box.meets(label) for box in obstacles):
                return False
        return not any(box.holds(*point) for box in obstacles for point in along(arrow))

    def _obstacles(self, boxes: Mapping[str, Rect], arrows: Sequence[Arrow]) -> Obstacles:
        """Return what texts should not cover: nodes, titles, borders and arrows."""
        nodes: list[Rect] = []
        borders: list[Rect] = []
        for part, name in self.named:
            if part.owner[0] == "node":
                nodes.append(boxes[name])
            elif part.owner[0] == "graph":
                box, size = boxes[name], self.pieces.get(part.owner, Piece())
                borders.append(box)
                nodes.append(Rect(box.x + TITLE[0], box.y + TITLE[1], size.width, size.height))
        return Obstacles(nodes, borders, arrows)

    # --- the result --------------------------------------------------------------------------

    def picture(self, boxes: Mapping[str, Rect], arrows: Mapping[str, Arrow]) -> str:
        """Return the drawing in SVG."""
        title = self.pieces.get(("graph", self.chart.name), Piece())
        return picture(self.chart.name, title, self._drawn(boxes, arrows))

    def _drawn(self, boxes: Mapping[str, Rect], arrows: Mapping[str, Arrow]) -> Iterator[Drawn]:
        obstacles: Obstacles | None = None
        last: list[Drawn] = []
        for part, name in self.named:
            piece = self.pieces.get(part.owner)
            links = tuple(links_of(self.text, part))
            match part.owner[0]:
                case "graph":
                    box = boxes[name]
                    if piece is None:
                        yield Drawn(part, box)
                        continue
                    x = box.x + TITLE[0] + piece.width / 2
                    y = box.y + TITLE[1] + piece.height / 2
                    yield Drawn(part, box, (Text(piece, x, y, links),))
                case "node":
                    box = boxes[name]
                    texts = [Text(piece or Piece(), *box.centre, links)]
                    if (beside := self.pieces.get(("beside", part.owner[1]))) is not None:
                        obstacles = obstacles or self._all_obstacles(boxes, arrows)
                        spot = text_place(box, beside.width, beside.height, obstacles)
                        texts.append(Text(beside, *spot))
                        obstacles.boxes.append(texts[-1].box)
                    last.append(Drawn(part, None, tuple(texts)))
                case _ if (arrow := arrows.get(name)) is not None:
                    label = (
                        ()
                        if piece is None or arrow.label is None
                        else (Text(piece, *arrow.label, links),)
                    )
                    last.append(Drawn(part, arrow, label))
        yield from last

    def _all_obstacles(self, boxes: Mapping[str, Rect], arrows: Mapping[str, Arrow]) -> Obstacles:
        """Return what texts beside nodes should not cover: labels of arrows, too."""
        found = self._obstacles(boxes, [*arrows.values()])
        found.boxes += (
            _around(arrow.label, piece)
            for part, name in self.named
            if (arrow := arrows.get(name)) is not None
            and arrow.label is not None
            and (piece := self.pieces.get(part.owner)) is not None
        )
        return found


def _around(spot: tuple[float, float], size: Piece) -> Rect:
    """Return the rectangle of a text around its middle."""
    return Rect(spot[0] - size.width / 2, spot[1] - size.height / 2, size.width, size.height)


def _outline(part: Statement) -> str:
    """Return the attributes by which Graphviz ends arrows at a node."""
    word = part.attributes["shape"].value if "shape" in part.attributes else "box"
    shape = {"circle": "circle", "doublecircle": "circle", "diamond": "diamond", "point": "circle"}
    return f'shape={shape.get(word, "box")}, fixedsize=true, label="", peripheries=1'


def _move(old: Rect | None, new: Rect) -> tuple[float, float] | None:
    """Return by how much a box was moved; None if it is new or has another size."""
    if old is None or max(abs(old.width - new.width), abs(old.height - new.height)) >= SAME:
        return None
    move = new.x - old.x, new.y - old.y
    return (0.0, 0.0) if max(map(abs, move)) < SAME else (round(move[0], 1), round(move[1], 1))


def _equalize(chart: Chart, boxes: dict[str, Rect]) -> None:
    """Make the regions of each parallel state equally high where nothing is in between."""
    for state in chart.states:
        if state.kind is not Kind.PARALLEL or not state.children:
            continue
        names = [chart.states[child].id for child in state.children]
        regions = [boxes[name] for name in names if name in boxes]
        if not regions:
            continue
        top, bottom = min(r.y for r in regions), max(r.bottom for r in regions)
        beside = [
            box for key, box in boxes.items() if key.split(" ")[0] == state.id and key != state.id
        ]
        for name in names:
            if name not in boxes:
                continue
            old = boxes[name]
            grown = Rect(old.x, top, old.width, bottom - top)
            others = (boxes[other] for other in names if other != name and other in boxes)
            if not any(grown.meets(box) for box in (*others, *beside)):
                boxes[name] = grown


def _initial_target(chart: Chart, state: int) -> tuple[str, ...]:
    """Return the initial substate of a state, and then the others."""
    initial = chart.states[state].initial
    first = () if initial is None else chart.transitions[initial].targets
    return tuple(chart.states[each].id for each in (*first, *chart.states[state].children))


def _neighbours(chart: Chart) -> dict[str, tuple[str, ...]]:
    """Return for each state the sources of transitions to it, then its targets and siblings."""
    found: dict[str, list[str]] = {}
    for forward in (True, False):
        for each in chart.transitions:
            for target in each.targets:
                ends = chart.states[each.source].id, chart.states[target].id
                source, end = ends if forward else ends[::-1]
                if source != end:
                    found.setdefault(end, []).append(source)
    for state in chart.states:
        for before, after in zip(state.children, state.children[1:], strict=False):
            found.setdefault(chart.states[after].id, []).append(chart.states[before].id)
    return {name: tuple(dict.fromkeys(others)) for name, others in found.items()}


# --- a whole layout -----------------------------------------------------------------------------


def _placement(graph: Any, edits: Edits, names: _Names) -> Placement:
    """Return where a layout has its parts, from its upper left corner."""
    height = numbers(graph["bb"])[3] if "bb" in graph else 0.0
    boxes: dict[str, Rect] = {}
    for each in graph.get("objects", ()):
        name = names.part(each["name"])
        if name is None:
            continue
        if "bb" in each:
            changed = edits.get(("graph", each["name"]), {})
            left, bottom, right, top = numbers(changed.get("bb", each["bb"]))
            boxes[name] = Rect(left, height - top, right - left, top - bottom)
        elif "pos" in each:
            x, y = numbers(each["pos"])
            width, tall = float(each["width"]) * INCH, float(each["height"]) * INCH
            boxes[name] = Rect(x - width / 2, height - y - tall / 2, width, tall)
    arrows: dict[str, Arrow] = {}
    for each in graph.get("edges", ()):
        name = names.arrow(each.get("id", ""))
        if name is None or "pos" not in each or ";" in each["pos"]:
            continue
        spot = edits.get(("edge", each["id"]), {}).get("lp", each.get("lp"))
        label = None if spot is None else numbers(spot)
        arrow = arrow_of(each["pos"], None if label is None else (label[0], label[1]))
        arrows[name] = moved(arrow, 0, height)
    return Placement(boxes, arrows)
