"""Fit the texts of a drawing in SVG to the widths of its layout.

Graphviz lays texts out by the fonts of its machine. Where a drawing is looked at there may be wider
ones; each text is given the width for which room was left (``textLength``, SVG 1.1, 10.5).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from fsmkit.diagnostics.parsing import parse_json

END = b"</svg>"
TEXT = re.compile(
    r'<text(?: xml:space="preserve")? text-anchor="(\w+)" x="([^"]*)" y="([^"]*)"([^>]*)>'
    r"([^<]*)</text>"
)
"""A text; newer versions of Graphviz keep its white space, which the labels need not."""


def fitted(content: bytes) -> str:
    """Return a drawing in SVG whose texts have the widths of the layout.

    Args:
        content: The output of ``dot -Tsvg -Tjson``: the drawing, then its layout as JSON.

    """
    end = content.index(END) + len(END)
    svg = content[:end].decode()
    try:
        widths = dict(_widths(parse_json(content[end:], strict=False)))
    except ValueError:  # Graphviz writes some texts as invalid JSON: nothing is fitted
        widths = {}

    def wide(found: re.Match[str]) -> str:
        anchor, x, y, more, text = found.groups()
        width = widths.get(_place(float(x), -float(y)))
        if not width or len(text) < 2:  # one letter has no width that could be shared out
            return found[0]
        length = f' textLength="{width:.5g}" lengthAdjust="spacingAndGlyphs"'
        return f'<text text-anchor="{anchor}" x="{x}" y="{y}"{more}{length}>{text}</text>'

    return TEXT.sub(wide, svg) + "\n"


def _place(x: float, y: float) -> tuple[float, float]:
    """Return the start of a text, rounded as in both outputs."""
    return round(x, 1), round(y, 1)


def _widths(drawing: Any) -> Iterator[tuple[tuple[float, float], float]]:
    """Yield the places and widths of all texts, in the whole of a drawing."""
    match drawing:
        case {"op": "T", "pt": [x, y], "width": width}:
            yield _place(x, y), width
        case dict():
            for part in drawing.values():
                yield from _widths(part)
        case list():
            for part in drawing:
                yield from _widths(part)
        case _:
            pass
