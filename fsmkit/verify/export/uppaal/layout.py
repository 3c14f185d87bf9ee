"""Positions: by Graphviz where it is installed, else a grid by the distance from the start."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import replace

from fsmkit.verify.export.uppaal.network import Edge, Location, Network, Point, Template

MOST_EDGES = 260
"""Templates with more are not for the eye: they get a grid."""
SECONDS = 20
LINE, LETTER = 17, 7
"""Pixels of a line of a label, and of a letter, in UPPAAL's editor."""
COLUMN, ROW = 340, 204


def laid_out(network: Network) -> Network:
    """Return a network with positions for all that is drawn."""
    return replace(network, templates=tuple(map(_template, network.templates)))


def _template(template: Template) -> Template:
    if len(template.edges) <= MOST_EDGES and shutil.which("dot") is not None:
        try:
            return _by_dot(template)
        except (subprocess.SubprocessError, ValueError, KeyError):
            pass
    return _on_a_grid(template)


def lines(edge: Edge) -> list[str]:
    """Return the labels of an edge, in the order in which they stand below each other."""
    select = ", ".join(f"{name} : int[{lo},{hi}]" for name, lo, hi in edge.select)
    texts = [edge.comment, select, " && ".join(edge.guard), edge.sync, ", ".join(edge.update)]
    return [text for text in texts if text]


# --- Graphviz -------------------------------------------------------------------------------------


def _by_dot(template: Template) -> Template:
    found = json.loads(
        subprocess.run(
            ["dot", "-Tjson"],
            input=_graph(template),
            capture_output=True,
            text=True,
            check=True,
            timeout=SECONDS,
        ).stdout
    )
    height = float(found["bb"].split(",")[3])
    places = {one["name"]: _point(one["pos"], height) for one in found["objects"]}
    ways = {int(one["id"]): one for one in found["edges"]}
    return replace(
        template,
        locations=tuple(_placed(loc, places[loc.id]) for loc in template.locations),
        edges=tuple(_drawn(edge, ways[n], height) for n, edge in enumerate(template.edges)),
    )


def _graph(template: Template) -> str:
    found = ["digraph {", "rankdir=LR; nodesep=0.25; ranksep=0.4; node [shape=box, fixedsize=true]"]
    for location in template.locations:
        longest = max(len(location.name), len(" && ".join(location.invariant)))
        width = max(0.5, longest * LETTER / 72)
        found.append(f'"{location.id}" [width={width:.2f}, height=0.6]')
    for number, edge in enumerate(template.edges):
        texts = lines(edge)
        width, height = max(map(len, texts), default=0) * LETTER, len(texts) * LINE
        label = (
            f'<<TABLE BORDER="0" FIXEDSIZE="TRUE" WIDTH="{width}" HEIGHT="{height}">'
            "<TR><TD></TD></TR></TABLE>>"
        )
        shown = f", label={label}" if texts else ""
        found.append(f'"{edge.source}" -> "{edge.target}" [id="{number}"{shown}]')
    return "\n".join([*found, "}"])


def _point(text: str, height: float) -> Point:
    x, y = text.split(",")[-2:]
    return round(float(x)), round(height - float(y))


def _placed(location: Location, at: Point) -> Location:
    x, y = at
    return replace(
        location,
        at=at,
        name_at=(x - len(location.name) * LETTER // 2, y - 2 * LINE) if location.name else None,
        invariant_at=(x + LINE // 2, y + LINE // 2) if location.invariant else None,
    )


def _drawn(edge: Edge, way: dict[str, str], height: float) -> Edge:
    points = [_point(p, height) for p in way["pos"].split() if not p.startswith(("e,", "s,"))]
    nails = points[3:-1:3] if edge.source != edge.target else points[2:-1:2]
    texts = lines(edge)
    if not texts:
        return replace(edge, nails=tuple(nails))
    x, y = _point(way["lp"], height)
    corner = x - max(map(len, texts)) * LETTER // 2, y - len(texts) * LINE // 2
    return _labelled(replace(edge, nails=tuple(nails)), corner)


def _labelled(edge: Edge, corner: Point) -> Edge:
    """Return an edge with its labels below each other."""
    x, y = corner
    has = [edge.comment, edge.select, edge.guard, edge.sync, edge.update]
    places: list[Point | None] = []
    for text in has:
        places.append((x, y) if text else None)
        y += LINE if text else 0
    comment, select, guard, sync, update = places
    return replace(
        edge,
        comment_at=comment,
        select_at=select,
        guard_at=guard,
        sync_at=sync,
        update_at=update,
    )


# --- the grid -------------------------------------------------------------------------------------


def _on_a_grid(template: Template) -> Template:
    """Place each location in the row of its distance from the start."""
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
    count: dict[int, int] = {}
    places: dict[str, Point] = {}
    for location in template.locations:
        row = depth.get(location.id, 0)
        places[location.id] = (count.get(row, 0) * COLUMN, row * ROW)
        count[row] = count.get(row, 0) + 1
    beside: dict[tuple[str, str], int] = {}
    edges = []
    for edge in template.edges:
        pair = (edge.source, edge.target)
        beside[pair] = beside.get(pair, 0) + 1
        edges.append(_bent(edge, places, beside[pair]))
    return replace(
        template,
        locations=tuple(_placed(loc, places[loc.id]) for loc in template.locations),
        edges=tuple(edges),
    )


def _bent(edge: Edge, places: dict[str, Point], number: int) -> Edge:
    """Return an edge bent away from those before it that have the same ends."""
    (x1, y1), (x2, y2) = places[edge.source], places[edge.target]
    middle = (x1 + x2) // 2 + 17 * number, (y1 + y2) // 2 + 34 * number
    nails = (middle,)
    if edge.source == edge.target:
        nails = ((x1 + 34, y1 + 34 * number), (x1 + 68, y1 + 34 * number + 17))  # type: ignore[assignment]
    return _labelled(replace(edge, nails=nails), (nails[-1][0] + 4, nails[-1][1]))
