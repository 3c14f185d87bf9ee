"""Diagrams of yEd: GraphML with groups."""

from __future__ import annotations

from fsmkit.diagnostics import Findings, Source, Text
from fsmkit.foreign.statesmith.graph import Diagram, Edge, Node
from fsmkit.scxml.nodes import Element, read_nodes


def read_yed(source: Source, findings: Findings) -> Diagram | None:
    """Return the graph of a file, or None after reporting an error."""
    root = read_nodes(source, findings)
    if root is None:
        return None
    page, diagram = Node("", Text("", root.span), root.span), Diagram()
    _graphs(root, page, diagram)
    diagram.pages.append(page)
    return diagram


def _graphs(element: Element, parent: Node, diagram: Diagram) -> None:
    for graph in element.children:
        for child in graph.children if graph.name == "graph" else ():
            if child.name == "node":
                key = _get(child, "id")
                node = Node(key, _label(child, "NodeLabel"), child.span)
                parent.children.append(node)
                _graphs(child, node, diagram)
            elif child.name == "edge":
                ends = _get(child, "source"), _get(child, "target")
                diagram.edges.append(Edge(*ends, _label(child, "EdgeLabel"), child.span))


def _get(element: Element, name: str) -> str:
    value = element.get(name)
    return "" if value is None else value.value


def _label(element: Element, name: str) -> Text:
    """Return the label of a shape or an arrow; of an open and a closed group that of the first."""
    left = [child for child in element.children if child.name == "data"]
    while left:
        found = left.pop(0)
        if found.name == name:
            text = found.text
            return Text(text.value.replace("\xa0", " "), text.span, text.offsets).strip()
        left = [*found.children, *left]
    return Text("", element.span)
