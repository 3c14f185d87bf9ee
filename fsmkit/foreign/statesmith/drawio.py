"""Diagrams of draw.io: ``mxfile``, plain or deflated, alone or in the attribute of an SVG."""

from __future__ import annotations

import base64
import binascii
import re
import zlib
from urllib.parse import unquote

from fsmkit.diagnostics import Findings, Source, Text
from fsmkit.foreign.statesmith.graph import Diagram, Edge, Node, joined
from fsmkit.scxml.nodes import Element, read_nodes

LARGEST = 1 << 21
"""Bytes of all inflated pages of a file."""
BREAK = re.compile(r"<br\s*/?>|</?(?:div|p|li|h\d)(?:\s[^<>]*)?>", re.IGNORECASE)
TAG = re.compile(r"</?[A-Za-z][^<>]*>")
ENTITY = re.compile(r"&(?:lt|gt|amp|quot|nbsp|#(\d{1,6})|#x([0-9a-fA-F]{1,5}));")
ENTITIES = {"&lt;": "<", "&gt;": ">", "&amp;": "&", "&quot;": '"', "&nbsp;": " "}
DOCTYPE = re.compile(r"<!DOCTYPE[^<>\[]*>")
DEEPEST = 60
"""Levels of cells."""
NOTES = ("shape=note", "stickyNote", "shape=image", "image;")


def read_drawio(source: Source, findings: Findings) -> Diagram | None:
    """Return the pages of a file, or None after reporting an error."""
    plain = DOCTYPE.sub(lambda match: " " * len(match[0]), source.text, count=1)
    root = read_nodes(Source(source.name, plain), findings)
    if root is not None and root.name == "svg":
        content = root.get("content")
        if content is None:
            findings.add(
                "foreign-syntax",
                "the picture holds no diagram: it has no attribute `content`",
                root.span,
                help="export it from draw.io with a copy of the diagram",
            )
            return None
        root = read_nodes(Source(f"{source.name} (content)", content.value), findings)
    if root is None:
        return None
    diagram = Diagram()
    left = LARGEST
    for page in [root] if root.name == "mxGraphModel" else root.children:
        left -= _page(page, diagram, left, findings)
    return diagram


def _page(page: Element, diagram: Diagram, budget: int, findings: Findings) -> int:
    """Add the shapes of a page; return the number of characters that were inflated."""
    name = page.get("name")
    if name is not None and name.value.strip().lower().startswith("$notes"):
        diagram.lost.append(("a page of notes", page.span))
        return 0
    model = page if page.name == "mxGraphModel" else _model(page, budget, findings)
    if model is None:
        return budget
    cells: dict[str, tuple[Element, Text]] = {}
    for part in model.children:
        for element in part.children:
            _cell(element, cells)
    _build(cells, Node("", name or Text("", page.span), page.span), diagram)
    inner = model.span.source
    return 0 if inner is page.span.source else len(inner.text)


def _model(page: Element, budget: int, findings: Findings) -> Element | None:
    """Return the model of a page, inflated if it is compressed."""
    for child in page.children:
        if child.name == "mxGraphModel":
            return child
    try:
        inflater = zlib.decompressobj(-15)
        inflated = inflater.decompress(base64.b64decode(page.text.value), budget)
        if inflater.unconsumed_tail or len(inflated) >= budget or not inflater.eof:
            raise ValueError
        text = unquote(inflated.decode("utf-8"))
    except (ValueError, zlib.error, binascii.Error):
        findings.add(
            "foreign-syntax",
            "the page is neither a model nor a compressed one, or pages have more than 2 MiB",
            page.span,
            help="save the diagram again in draw.io",
        )
        return None
    return read_nodes(Source(f"{page.span.source.name} (page)", text), findings)


def _cell(element: Element, cells: dict[str, tuple[Element, Text]]) -> None:
    """Add a cell, or the cell inside an object with a label."""
    if element.name in ("UserObject", "object"):
        inner = next((child for child in element.children if child.name == "mxCell"), None)
        key, label = element.get("id"), element.get("label")
        if inner is not None and key is not None:
            cells[key.value] = inner, label or Text("", element.span)
    elif element.name == "mxCell" and (key := element.get("id")) is not None:
        cells[key.value] = element, element.get("value") or Text("", element.span)


def _build(cells: dict[str, tuple[Element, Text]], page: Node, diagram: Diagram) -> None:
    """Add the shapes of a page to the diagram. Text inside of a shape or arrow is its label."""
    nodes: dict[str, Node] = {}
    texts: dict[str, list[Text]] = {}
    for key, (cell, label) in cells.items():
        style = _get(cell, "style")
        parent = _get(cell, "parent")
        if (
            any(mark in style for mark in NOTES)
            and _get(cell, "vertex") == "1"
            and ("$STATEMACHINE" not in label.value and "swimlane" not in style)
        ):
            diagram.lost.append(("a note", cell.span))
        elif _get(cell, "vertex") == "1" and _is_text_of(parent, cells, cell):
            texts.setdefault(parent, []).append(plain_text(label, style))
        elif _get(cell, "vertex") == "1":
            nodes[key] = Node(key, plain_text(label, style), cell.span)
    for key, (cell, label) in cells.items():
        if key in nodes:
            own = nodes[key]
            own.label = joined(own.label, texts.get(key, []))
            home = nodes.get(_get(cell, "parent")) if _depth(key, cells) else None
            (page if home is None else home).children.append(own)
        elif _get(cell, "edge") == "1":
            style = _get(cell, "style")
            written = joined(plain_text(label, style), texts.get(key, []))
            ends = _get(cell, "source"), _get(cell, "target")
            noted = [end for end in ends if end in cells and end not in nodes]
            if noted or not (any(ends) or written.value.strip() or _in_node(cell, nodes)):
                diagram.lost.append(("an arrow of a note", cell.span))
                continue
            diagram.edges.append(Edge(*ends, written, cell.span))
    diagram.pages.append(page)


def _in_node(cell: Element, nodes: dict[str, Node]) -> bool:
    return _get(cell, "parent") in nodes


def _depth(key: str, cells: dict[str, tuple[Element, Text]]) -> int:
    """Return how deep a cell is; 0 if its parents form a circle, or are deeper than `DEEPEST`."""
    depth = 1
    while depth <= DEEPEST:
        key = _get(cells[key][0], "parent")
        if key not in cells:
            return depth
        depth += 1
    return 0


def _is_text_of(parent: str, cells: dict[str, tuple[Element, Text]], cell: Element) -> bool:
    if parent not in cells:
        return False
    holder = cells[parent][0]
    is_edge = _get(holder, "edge") == "1"
    return is_edge or (_get(cell, "connectable") == "0" and _get(holder, "vertex") == "1")


def _get(cell: Element, name: str) -> str:
    value = cell.get(name)
    return "" if value is None else value.value


def plain_text(label: Text, style: str) -> Text:
    """Return a label without HTML: breaks are new lines, other tags disappear."""
    value = label.value
    offsets = list(label.character_offsets())
    if "html=1" in style and ("<" in value or "&" in value):
        parts, kept, at = [], [], 0
        for match in TAG.finditer(value):
            parts.append(value[at : match.start()])
            kept += offsets[at : match.start()]
            if BREAK.fullmatch(match[0]):
                parts.append("\n")
                kept.append(offsets[match.start()])
            at = match.end()
        value, offsets = "".join(parts) + value[at:], kept + offsets[at:]
        parts, kept, at = [], [], 0
        for match in ENTITY.finditer(value):
            parts += [value[at : match.start()], _character(match)]
            kept += [*offsets[at : match.start()], offsets[match.start()]]
            at = match.end()
        value, offsets = "".join(parts) + value[at:], kept + offsets[at:]
    return Text(value.replace("\xa0", " "), label.span, tuple(offsets))


def _character(match: re.Match[str]) -> str:
    if match[0] in ENTITIES:
        return ENTITIES[match[0]]
    number = int(match[1]) if match[1] else int(match[2], 16)
    return chr(number) if number < 0x110000 and not 0xD800 <= number < 0xE000 else "?"
