"""One machine in each notation of StateSmith, from one description."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Sequence
from urllib.parse import quote
from xml.sax.saxutils import escape, quoteattr

Shape = tuple[str, str, Sequence["Shape"]]
"""A key, a label and the shapes inside."""
Arrow = tuple[str, str, str]
"""The keys of source and target, and a label."""


def drawio(name: str, shapes: Sequence[Shape], arrows: Sequence[Arrow]) -> str:
    cells = ['<mxCell id="0"/>', '<mxCell id="1" parent="0"/>']

    def add(shape: Shape, parent: str) -> None:
        key, label, inner = shape
        cells.append(
            f"<mxCell id={quoteattr(key)} value={quoteattr(label)} "
            f'parent={quoteattr(parent)} vertex="1"/>'
        )
        for each in inner:
            add(each, key)

    add(("m", f"$STATEMACHINE : {name}", shapes), "1")
    for number, (source, target, label) in enumerate(arrows):
        cells.append(
            f'<mxCell id="e{number}" value={quoteattr(label)} edge="1" parent="m" '
            f"source={quoteattr(source)} target={quoteattr(target)}/>"
        )
    model = f"<mxGraphModel><root>{''.join(cells)}</root></mxGraphModel>"
    return f'<mxfile><diagram name="Page-1">{model}</diagram></mxfile>'


def compressed(plain: str) -> str:
    model = plain[plain.index("<mxGraphModel") : plain.index("</diagram>")]
    deflater = zlib.compressobj(9, zlib.DEFLATED, -15)
    data = deflater.compress(quote(model).encode()) + deflater.flush()
    return f'<mxfile><diagram name="Page-1">{base64.b64encode(data).decode()}</diagram></mxfile>'


def svg(plain: str) -> str:
    return (
        '<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://www.w3.org/svg11.dtd">\n'
        f'<svg xmlns="http://www.w3.org/2000/svg" content={quoteattr(plain)}><g/></svg>'
    )


def graphml(name: str, shapes: Sequence[Shape], arrows: Sequence[Arrow]) -> str:
    def node(shape: Shape) -> str:
        key, label, inner = shape
        graph = f"<graph>{''.join(map(node, inner))}</graph>" if inner else ""
        text = f"<data><y:ShapeNode><y:NodeLabel>{escape(label)}</y:NodeLabel></y:ShapeNode></data>"
        return f"<node id={quoteattr(key)}>{text}{graph}</node>"

    edges = "".join(
        f"<edge source={quoteattr(s)} target={quoteattr(t)}><data><y:PolyLineEdge>"
        f"<y:EdgeLabel>{escape(label)}</y:EdgeLabel></y:PolyLineEdge></data></edge>"
        for s, t, label in arrows
    )
    return (
        '<graphml xmlns="http://graphml.graphdrawing.org/xmlns" '
        'xmlns:y="http://www.yworks.com/xml/graphml"><graph>'
        f"{node(('m', f'$STATEMACHINE : {name}', shapes))}{edges}</graph></graphml>"
    )
