"""Lay a chart out around the positions of an earlier drawing.

The text for Graphviz is that of any drawing. Boxes are placed here. Arrows whose ends have not
moved keep their curves, and Graphviz routes the others around the states.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.drawing.graph_text import Statement, statements
from fsmkit.chart.drawing.graphviz.engine import run_graphviz
from fsmkit.chart.drawing.layout import (
    INCH,
    Edits,
    control_points,
    format_curve,
    improve_parsed,
    numbers,
    split_layout,
)
from fsmkit.chart.drawing.positions.placement import Arrow, Placement, Rect
from fsmkit.chart.drawing.positions.placing import Item, place

ORDER = re.compile(r"^ *\S+ -> \{[^}]*\} \[style=invis, weight=0\];\n", re.MULTILINE)
"""Lines that keep the order of a whole layout."""
PART = re.compile(r"(s|cluster_|initial_|own_|label_|fork_)(\d+)")
PIECE = re.compile(r"t(\d+)(_\w+)?")
TITLE = (8.0, 4.0)
"""Points between the border of a cluster and its title, at the left and above."""
LENGTH = 7.0
"""Points of an arrowhead."""
MEASURED = ("shape", "label", "width", "height", "fixedsize", "fontsize", "peripheries")
LINK = re.compile(r' (?:href|id|title)="[^"]*"')
SMALL = ("initial_", "own_", "label_", "fork_")
MOST_SIZES = 20_000
_sizes: dict[str, tuple[float, float]] = {}
"""Sizes of boxes by their statements, which Graphviz has measured."""


class Redrawn(NamedTuple):
    """A text for ``neato -n2``, and where everything is."""

    text: str
    placement: Placement


def redraw(chart: Chart, text: str, old: Placement | None) -> Redrawn:
    """Lay out the text of a chart.

    Args:
        chart: The chart that the text draws.
        text: The text for Graphviz (`fsmkit.chart.drawing.states.dot`).
        old: Where things were; None or an empty one for a whole new layout.

    Raises:
        FsmkitError: ``missing-graphviz``, ``drawing-failed``.

    """
    names = _Names(chart)
    if old is None or not old.boxes:
        content = run_graphviz(text, ("dot", "json"))
        layout, graph = split_layout(content)
        return Redrawn(improve_parsed(layout, graph), _placement(graph, names, (0.0, 0.0)))
    text = ORDER.sub("", text)
    parts = [*statements(text)]
    items = _items(chart, names, parts, _measured(text, parts))
    boxes = place(items, old.boxes)
    arrows = _unchanged(parts, names, boxes, old)
    placed = _positioned(text, parts, names, boxes, arrows)
    content = run_graphviz(placed, ("dot", "json"), "neato -n2")
    layout, graph = split_layout(content)
    edits = _finish(graph, names, arrows)
    shift = _shift(graph, names, boxes)
    routed = _placement(graph, names, shift)
    return Redrawn(improve_parsed(layout, graph, edits), Placement(boxes, routed.arrows))


# --- names ---------------------------------------------------------------------------------------


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


# --- boxes ---------------------------------------------------------------------------------------


def _measured(text: str, parts: Sequence[Statement]) -> dict[str, tuple[float, float]]:
    """Return the width and height of each node, and of the title of each cluster."""
    wanted = {part.owner[1]: _statement_text(text, part) for part in parts if _is_box(part)}
    missing = [*dict.fromkeys(line for line in wanted.values() if line not in _sizes)]
    if missing:
        if len(_sizes) > MOST_SIZES:
            _sizes.clear()
        head = text[: text.index("\n", text.index("  edge [")) + 1]
        lines = (f"n{number} [{line};" for number, line in enumerate(missing))
        graph = split_layout(run_graphviz("\n".join((head, *lines, "}")), ("dot", "json")))[1]
        for each in graph.get("objects", ()):
            if "width" in each:
                size = (float(each["width"]) * INCH, float(each["height"]) * INCH)
                _sizes[missing[int(each["name"][1:])]] = size
    return {name: _sizes.get(line, (54.0, 26.0)) for name, line in wanted.items()}


def _is_box(part: Statement) -> bool:
    kind, name = part.owner
    return kind == "node" or name.startswith("cluster_")


def _statement_text(text: str, part: Statement) -> str:
    """Return the attributes that decide a box's size; those of a cluster as a plain node's."""
    kept = ("label",) if part.owner[0] == "graph" else MEASURED
    pairs = [
        f"{key}={LINK.sub('', text[each.start : each.end])}"
        for key in kept
        if (each := part.attributes.get(key)) is not None
    ]
    return f"{', '.join(['shape=plain'] * (part.owner[0] == 'graph') + pairs)}]"


def _items(
    chart: Chart,
    names: _Names,
    parts: Sequence[Statement],
    sizes: Mapping[str, tuple[float, float]],
) -> list[Item]:
    near = _neighbours(chart)
    items: list[Item] = []
    for part in parts:
        node = part.owner[1]
        name = names.part(node) if _is_box(part) else None
        if name is None:
            continue
        width, height = sizes[node]
        is_cluster = part.owner[0] == "graph"
        parent = names.part(part.cluster) or ""
        if node.startswith(("label_", "fork_")):
            beside: tuple[str, ...] = (name.split(" > ")[0],)
        elif node.startswith(("initial_", "own_")):
            beside = _initial_target(chart, int(node.split("_")[1]))
        else:
            beside = near.get(name, ())
        items.append(
            Item(
                name, parent, width + (2 * TITLE[0] if is_cluster else 0),
                height + (2 * TITLE[1] if is_cluster else 0), beside, is_cluster,
                node.startswith(SMALL), height if is_cluster else 0,
            )
        )  # fmt: skip
    return items


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


# --- arrows --------------------------------------------------------------------------------------


def _unchanged(
    parts: Sequence[Statement], names: _Names, boxes: Mapping[str, Rect], old: Placement
) -> dict[str, Arrow]:
    """Return the arrows whose ends moved alike or not at all, and that no moved box meets."""
    moves = {name: _move(old.boxes.get(name), box) for name, box in boxes.items()}
    moved = {name for name, move in moves.items() if move != (0.0, 0.0)}
    leaves = {names.part(part.owner[1]) for part in parts if part.owner[0] == "node"}
    obstacles = [boxes[name] for name in moved if name in leaves]
    found: dict[str, Arrow] = {}
    for part in parts:
        if part.owner[0] != "edge" or (name := names.arrow(part.owner[1])) is None:
            continue
        before = old.arrows.get(name)
        ends = {names.part(word.split(":")[0]) for word in part.head if word != "->"}
        ends |= {
            names.part(part.attributes[key].value)
            for key in ("ltail", "lhead")
            if key in part.attributes
        }
        shared = {moves.get(end) if end else None for end in ends}
        if before is None or len(shared) != 1 or None in shared:
            continue
        before = _moved(before, *(shared.pop() or (0.0, 0.0)))
        if not any(box.holds(*point) for box in obstacles for point in _along(before)):
            found[name] = before
    return found


def _move(old: Rect | None, new: Rect) -> tuple[float, float] | None:
    """Return by how much a box was moved; None if it is new or has another size."""
    if old is None or max(abs(old.width - new.width), abs(old.height - new.height)) >= 0.5:
        return None
    move = new.x - old.x, new.y - old.y
    return (0.0, 0.0) if max(map(abs, move)) < 0.5 else (round(move[0], 1), round(move[1], 1))


def _moved(arrow: Arrow, dx: float, dy: float) -> Arrow:
    return Arrow(
        tuple((x + dx, y + dy) for x, y in arrow.points),
        tuple((end, x + dx, y + dy) for end, x, y in arrow.heads),
        None if arrow.label is None else (arrow.label[0] + dx, arrow.label[1] + dy),
    )


def _along(arrow: Arrow) -> Iterator[tuple[float, float]]:
    """Yield points of a curve."""
    for a, b, c, d in _pieces(arrow.points):
        for step in range(6):
            yield _bezier(a, b, c, d, step / 6)


def _positioned(
    text: str,
    parts: Sequence[Statement],
    names: _Names,
    boxes: Mapping[str, Rect],
    arrows: Mapping[str, Arrow],
) -> str:
    """Return the text with the places of boxes and of unchanged arrows."""
    pieces: list[str] = []
    done = 0
    for part in parts:
        kind, own = part.owner
        new: list[str] = []
        name = (names.part(own) if kind != "edge" else names.arrow(own)) or ""
        if kind == "graph" and not own.startswith("cluster_"):
            new = ["splines=true"]
        elif kind == "edge" and name in arrows:
            new = _arrow_attributes(arrows[name])
        elif kind != "edge" and name in boxes:
            box = boxes[name]
            if kind == "graph":
                title = _sizes.get(_statement_text(text, part), (0.0, 0.0))
                x = box.x + TITLE[0] + title[0] / 2
                y = box.y + TITLE[1] + title[1] / 2
                new = [
                    f'bb="{box.x:.5g},{-box.bottom:.5g},{box.right:.5g},{-box.y:.5g}"',
                    f'lp="{x:.5g},{-y:.5g}"',
                ]
            else:
                x, y = box.centre
                new = [f'pos="{x:.6g},{-y:.6g}"']
        pieces += (text[done : part.inside], "".join(f"{each}, " for each in new))
        done = part.inside
    return "".join((*pieces, text[done:]))


def _arrow_attributes(arrow: Arrow) -> list[str]:
    heads = [f"{end},{x:.6g},{-y:.6g}" for end, x, y in arrow.heads]
    new = [f'pos="{format_curve(heads, ((x, -y) for x, y in arrow.points))}"']
    if arrow.label is not None:
        new.append(f'lp="{arrow.label[0]:.6g},{-arrow.label[1]:.6g}"')
    return new


def _shift(graph: Any, names: _Names, boxes: Mapping[str, Rect]) -> tuple[float, float]:
    """Return by how much Graphviz moved the whole drawing."""
    for each in graph.get("objects", ()):
        name = names.part(each["name"]) or ""
        if "pos" in each and name in boxes:
            (x, y), (left, top) = numbers(each["pos"]), boxes[name].centre
            return x - left, y + top
    return 0.0, 0.0


# --- the result ----------------------------------------------------------------------------------


def _placement(graph: Any, names: _Names, shift: tuple[float, float]) -> Placement:
    """Return where a layout has its parts; after a whole layout, from its upper left corner."""
    dx, dy = shift
    if shift == (0.0, 0.0) and "bb" in graph:
        dy = numbers(graph["bb"])[3]
    boxes: dict[str, Rect] = {}
    for each in graph.get("objects", ()):
        name = names.part(each["name"])
        if name is None:
            continue
        if "bb" in each:
            left, bottom, right, top = numbers(each["bb"])
            boxes[name] = Rect(left - dx, dy - top, right - left, top - bottom)
        elif "pos" in each:
            x, y = numbers(each["pos"])
            width, height = float(each["width"]) * INCH, float(each["height"]) * INCH
            boxes[name] = Rect(x - width / 2 - dx, dy - y - height / 2, width, height)
    arrows: dict[str, Arrow] = {}
    for each in graph.get("edges", ()):
        name = names.arrow(each.get("id", ""))
        if name is None or "pos" not in each or ";" in each["pos"]:
            continue
        words = [word for word in each["pos"].split() if word[0] in "se"]
        heads = ((word[0], *numbers(word[2:])) for word in words)
        label = numbers(each["lp"]) if "lp" in each else None
        arrows[name] = Arrow(
            tuple((x - dx, dy - y) for x, y in control_points(each["pos"])),
            tuple((end, x - dx, dy - y) for end, x, y in heads),
            None if label is None else (label[0] - dx, dy - label[1]),
        )
    return Placement(boxes, arrows)


# --- arrows of composite states ------------------------------------------------------------------

_Point = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class _Border:
    left: float
    bottom: float
    right: float
    top: float

    def holds(self, point: _Point) -> bool:
        return self.left <= point[0] <= self.right and self.bottom <= point[1] <= self.top


def _finish(graph: Any, names: _Names, unchanged: Mapping[str, Arrow]) -> Edits:
    """Finish the arrows that ``neato`` has routed; change the graph and return the changes.

    An arrow that starts or ends at a cluster (``ltail``, ``lhead``) leads to a node in it, and is
    cut at the border. Labels are put beside the middle of their arrows.
    """
    borders = {
        each["name"]: _Border(*numbers(each["bb"]))
        for each in graph.get("objects", ())
        if "bb" in each
    }
    edits: Edits = {}
    for each in graph.get("edges", ()):
        tail, head = borders.get(each.get("ltail", "")), borders.get(each.get("lhead", ""))
        if "pos" not in each or ";" in each["pos"] or names.arrow(each.get("id", "")) in unchanged:
            continue
        points, tips = control_points(each["pos"]), each["pos"].split()
        start = next((w for w in tips if w.startswith("s,")), None)
        end = next((w for w in tips if w.startswith("e,")), None)
        curves = [*_pieces(points)]
        if tail is not None:
            curves, start = _cut(curves, tail, start, "s")
        if head is not None:
            reverse = [piece[::-1] for piece in reversed(curves)]
            cut, end = _cut(reverse, head, end, "e")
            curves = [piece[::-1] for piece in reversed(cut)]
        if not curves:
            continue
        path = [curves[0][0], *(point for piece in curves for point in piece[1:])]
        new = {"pos": format_curve([w for w in (start, end) if w], path)}
        if "lp" in each:
            new["lp"] = _beside(each, curves)
        each["pos"] = new["pos"]
        edits["edge", each.get("id", "")] = new
    return edits


_Piece = tuple[_Point, _Point, _Point, _Point]


def _pieces(points: Sequence[_Point]) -> Iterator[_Piece]:
    return zip(points[0::3], points[1::3], points[2::3], points[3::3], strict=False)


def _cut(
    curves: list[_Piece], border: _Border, tip: str | None, end: str
) -> tuple[list[_Piece], str | None]:
    """Cut the start of a curve off where it leaves a border; move the tip of an arrow there."""
    for number, piece in enumerate(curves):
        if border.holds(piece[3]):
            continue
        if not border.holds(piece[0]):
            break
        low, high = 0.0, 1.0
        for _ in range(20):
            middle = (low + high) / 2
            low, high = (middle, high) if border.holds(_bezier(*piece, middle)) else (low, middle)
        at = _bezier(*piece, low)
        rest = [_second_half(piece, low), *curves[number + 1 :]]
        if tip is None:
            return rest, None
        new_tip = f"{end},{at[0]:.5g},{at[1]:.5g}"
        return _shorten(rest), new_tip
    return curves, tip


def _shorten(curves: list[_Piece]) -> list[_Piece]:
    """Start a curve an arrowhead later."""
    start = curves[0][0]
    for number, piece in enumerate(curves):
        if _distance(start, piece[3]) < LENGTH and number + 1 < len(curves):
            continue
        low, high = 0.0, 0.9
        for _ in range(20):
            middle = (low + high) / 2
            is_near = _distance(start, _bezier(*piece, middle)) < LENGTH
            low, high = (middle, high) if is_near else (low, middle)
        return [_second_half(piece, low), *curves[number + 1 :]]
    return curves


def _beside(edge: dict[str, Any], curves: Sequence[_Piece]) -> str:
    """Move the label of an arrow beside the middle of its curve; return its new middle."""
    x, y = numbers(edge["lp"])
    middle = _bezier(*curves[len(curves) // 2], 0.5 if len(curves) % 2 else 0.0)
    texts = [each for each in edge.get("_ldraw_", ()) if each["op"] == "T"]
    half = max((each["width"] for each in texts), default=0.0) / 2
    dx, dy = middle[0] + half + 4 - x, middle[1] - y
    for each in texts:
        each["pt"] = [each["pt"][0] + dx, each["pt"][1] + dy]
    edge["lp"] = f"{x + dx:.5g},{y + dy:.5g}"
    return str(edge["lp"])


def _distance(one: _Point, other: _Point) -> float:
    return float(((one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2) ** 0.5)


def _bezier(a: _Point, b: _Point, c: _Point, d: _Point, t: float) -> tuple[float, float]:
    u = 1 - t
    x, y = (
        u**3 * p + 3 * u * u * t * q + 3 * u * t * t * r + t**3 * s
        for p, q, r, s in zip(a, b, c, d, strict=True)
    )
    return x, y


def _second_half(piece: _Piece, t: float) -> _Piece:
    """Return the part of a curve after a parameter (de Casteljau)."""
    a, b, c, d = piece

    def mix(p: _Point, q: _Point) -> _Point:
        return tuple(v + (w - v) * t for v, w in zip(p, q, strict=True))

    ab, bc, cd = mix(a, b), mix(b, c), mix(c, d)
    abc, bcd = mix(ab, bc), mix(bc, cd)
    return mix(abc, bcd), bcd, cd, d
