"""The structure of a statechart: regions, vertices and transitions, as read from XMI."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.scxml.nodes import Element

XMI = "http://www.omg.org/XMI"
XSI = "http://www.w3.org/2001/XMLSchema-instance"
DEEPEST = 40
"""States within each other."""


@dataclass(eq=False)
class Arc:
    """A transition with its text."""

    source: Vertex
    text: Text
    span: Span
    target_id: str
    target: Vertex


@dataclass(eq=False)
class Region:
    """A region; ``owner`` is None at the top. ``lo`` and ``hi`` are the places of its events."""

    name: str
    span: Span
    owner: Vertex | None
    place: int
    vertices: list[Vertex] = field(default_factory=list)
    lo: int = 0
    own: int = 0
    hi: int = 0

    @property
    def entry(self) -> Vertex | None:
        """Return the default entry: the first that has no name or is called ``default``."""
        return self.named("") or None

    def named(self, name: str) -> Vertex | None:
        """Return the entry of a name."""
        names = ("", "default") if name in ("", "default") else (name,)
        found = (v for v in self.vertices if v.kind == "Entry" and v.name.strip() in names)
        return next(found, None)


@dataclass(eq=False)
class Vertex:
    """A state or a pseudo-state. ``kind`` is the name of its class in the file."""

    kind: str
    name: str
    text: Text | None
    span: Span
    region: Region
    history: str = ""
    regions: list[Region] = field(default_factory=list)
    out: list[Arc] = field(default_factory=list)
    incoming: list[Arc] = field(default_factory=list)
    at: Text | None = None

    @property
    def containers(self) -> list[Vertex | Region]:
        """Return the vertex, its region, the state of the region, and so on."""
        found: list[Vertex | Region] = []
        vertex: Vertex | None = self
        while vertex is not None:
            found += [vertex, vertex.region]
            vertex = vertex.region.owner
        return found


def all_vertices(regions: list[Region]) -> Iterator[Vertex]:
    """Yield the vertices of regions and of all regions within, in order."""
    for region in regions:
        for vertex in region.vertices:
            yield vertex
            yield from all_vertices(vertex.regions)


def read_regions(element: Element, findings: Findings) -> list[Region]:
    """Return the top-level regions; loose ends are reported, and omitted."""
    by_id: dict[str, Vertex] = {}
    regions = _regions(element, None, by_id, findings, 0)
    for vertex in by_id.values():
        whole = [arc for arc in vertex.out if arc.target_id in by_id]
        for arc in vertex.out:
            if arc.target_id not in by_id:
                _damaged(findings, "this transition has a loose end", arc.span)
        vertex.out = whole
        for arc in whole:
            arc.target = by_id[arc.target_id]
            arc.target.incoming.append(arc)
    return regions


def _regions(
    element: Element, owner: Vertex | None, by_id: dict[str, Vertex], findings: Findings, depth: int
) -> list[Region]:
    if depth > DEEPEST:
        _damaged(findings, f"more than {DEEPEST} states within each other", element.span)
        return []
    found: list[Region] = []
    for child in element.children:
        if child.name != "regions":
            continue
        region = Region(_word(child, "name") or f"_region{len(found)}", child.span, owner,
                        len(found))  # fmt: skip
        for node in child.children:
            if node.name == "vertices":
                vertex = _vertex(node, region, by_id, findings)
                region.vertices.append(vertex)
                vertex.regions = _regions(node, vertex, by_id, findings, depth + 1)
        found.append(region)
    return found


def _vertex(node: Element, region: Region, by_id: dict[str, Vertex], findings: Findings) -> Vertex:
    kind, id_ = _word(node, "type", XSI).rpartition(":")[2], _word(node, "id", XMI)
    name = node.get("name")
    vertex = Vertex(kind, "" if name is None else name.value, node.get("specification"), node.span,
                    region, _word(node, "kind"), at=name)  # fmt: skip
    if not id_ or id_ in by_id:
        _damaged(findings, "a vertex has no id of its own", node.span)
        return vertex
    by_id[id_] = vertex
    for child in node.children:
        if child.name == "outgoingTransitions":
            text = child.get("specification") or Text("", child.span, ())
            vertex.out.append(Arc(vertex, text, child.span, _word(child, "target"), vertex))
    return vertex


def _word(element: Element, name: str, namespace: str = "") -> str:
    found = element.get(name, namespace)
    return "" if found is None else found.value


def _damaged(findings: Findings, message: str, at: Span) -> None:
    findings.add("foreign-syntax", message, at, help="open the file in itemis CREATE and save it")
