"""Measure boxes and texts, and keep their SVG, so that it can be drawn anywhere.

Graphviz draws each new statement once, alone. Later drawings move the result: a box that stays
costs no run of Graphviz.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape, unescape
from itertools import cycle
from operator import add

from fsmkit.chart.drawing.fitting import END, fitted
from fsmkit.chart.drawing.graph_text import Attribute, Statement
from fsmkit.chart.drawing.graphviz.engine import run_graphviz
from fsmkit.chart.drawing.layout import INCH, numbers
from fsmkit.diagnostics.parsing import parse_json

MOST_PIECES = 20_000
DRAWN = (
    "shape", "label", "width", "height", "fixedsize", "fontsize", "peripheries", "color",
    "fillcolor", "style", "penwidth", "fontcolor",
)  # fmt: skip
"""The attributes that decide the size and the looks of a node."""
LINK = re.compile(r' id="([^"]*)" href="[^"]*" title="([^"]*)"')
"""A link in a label, as `fsmkit.chart.drawing.states.dot` writes it."""
DRAWN_LINK = re.compile(r'<g id="a_k(\d+)"><a xlink:href="[^"]*" xlink:title="[^"]*">')
PART = re.compile(r"<!-- n(\d+) -->\n")
NUMBER = r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
POINTS = re.compile(rf'(?<= )(?:d|points)="[^"]*"|(?:c?x)="{NUMBER}" (?:c?y)="{NUMBER}"')
VALUE = re.compile(NUMBER)


@dataclass(frozen=True, slots=True)
class Piece:
    """A box or a text: its size in points, and its SVG around the origin.

    ``parts`` are formats with the coordinates that fill them. Before each but the first a link of
    the label starts: that of the number in ``links``.
    """

    width: float = 54.0
    height: float = 26.0
    parts: tuple[tuple[str, tuple[float, ...]], ...] = ()
    links: tuple[int, ...] = ()

    def svg(self, x: float, y: float, links: Sequence[tuple[str, str]] = ()) -> str:
        """Return the SVG around a point; ``links``: id and title of each link of the label."""
        drawn = [form % tuple(map(add, at, cycle((x, y)))) for form, at in self.parts]
        starts = (_link(*links[number]) for number in self.links if number < len(links))
        return "".join((*drawn[:1], *(s + d for s, d in zip(starts, drawn[1:], strict=False))))


def _link(own: str, title: str) -> str:
    return f'<g id="a_{own}"><a xlink:href="#{own}" xlink:title="{title}">'


_pieces: dict[str, Piece] = {}
"""The measured pieces by their statements."""


def drawn_text(text: str, part: Statement) -> str:
    """Return what decides the looks of a node; of a cluster and an arrow, of its label."""
    attributes = part.attributes
    if part.owner[0] == "node":
        pairs = [_pair(text, key, each) for key in DRAWN if (each := attributes.get(key))]
        return ", ".join(pairs)
    size = "fontsize=10, " if part.owner[0] == "edge" else ""
    return (
        f"shape=plain, style=solid, color=none, {size}{_pair(text, 'label', attributes['label'])}"
    )


def beside_text(text: str, part: Statement) -> str | None:
    """Return the statement of the text beside a node (``xlabel``); None without one."""
    each = part.attributes.get("xlabel")
    if each is None:
        return None
    return f"shape=plain, style=solid, color=none, {_pair(text, 'label', each)}"


def _pair(text: str, key: str, attribute: Attribute) -> str:
    """Return an attribute; the links of a label are numbered, for they change with each edit."""
    value = text[attribute.start : attribute.end]
    if key == "label" and "href=" in value:
        count = iter(range(len(value)))
        value = LINK.sub(lambda _: f' id="k{(n := next(count))}" href="#{n}" title="{n}"', value)
    return f"{key}={value}"


def links_of(text: str, part: Statement) -> list[tuple[str, str]]:
    """Return id and title of each link in a label, for SVG."""
    each = part.attributes.get("label")
    if each is None or "href=" not in (value := text[each.start : each.end]):
        return []
    return [(own, escape(unescape(title))) for own, title in LINK.findall(value)]


def measure(head: str, wanted: Iterable[str]) -> Mapping[str, Piece]:
    """Return the piece of each statement.

    Args:
        head: The first lines of a graph, with the attributes of all nodes.
        wanted: Statements by `drawn_text` and `beside_text`.

    Raises:
        FsmkitError: ``missing-graphviz``, ``drawing-failed``.

    """
    missing = [*dict.fromkeys(line for line in wanted if line not in _pieces)]
    if missing:
        if len(_pieces) > MOST_PIECES:
            _pieces.clear()
        lines = (f'n{number} [pos="0,0", {line}];' for number, line in enumerate(missing))
        content = run_graphviz(
            "\n".join((head, *lines, "}")), ("svg", "json"), "neato -n2", is_small=True
        )
        for number, piece in _measured(content):
            _pieces[missing[number]] = piece
    return _pieces


def _measured(content: bytes) -> Iterator[tuple[int, Piece]]:
    """Yield the number and the piece of each node of a drawing."""
    read = parse_json(content[content.index(END) + len(END) :], strict=False)
    boxes = {
        int(each["name"][1:]): (*numbers(each["pos"]), float(each["width"]), float(each["height"]))
        for each in read.get("objects", ())
        if "pos" in each
    }
    words = PART.split(fitted(content))
    drawn = {int(number): svg for number, svg in zip(words[1::2], words[2::2], strict=True)}
    for number, (x, y, width, height) in boxes.items():
        _, _, inside = drawn.get(number, "").partition("</title>\n")
        inside = inside.replace("</g>\n</svg>", "").rpartition("</g>")[0]
        yield number, _piece(inside, x, -y, width * INCH, height * INCH)


def _piece(svg: str, x: float, y: float, width: float, height: float) -> Piece:
    """Return the piece of a node that is drawn around a point."""
    words = DRAWN_LINK.split(svg)
    parts: list[tuple[str, tuple[float, ...]]] = []
    for word in words[::2]:
        values: list[float] = []
        form: list[str] = []
        done = 0
        for found in POINTS.finditer(word):
            form.append(word[done : found.start()].replace("%", "%%"))
            values += map(float, VALUE.findall(found[0]))
            form.append(VALUE.sub("%.6g", found[0]))
            done = found.end()
        form.append(word[done:].replace("%", "%%"))
        shifted = tuple(v - o for v, o in zip(values, cycle((x, y)), strict=False))
        parts.append(("".join(form), shifted))
    return Piece(width, height, tuple(parts), tuple(map(int, words[1::2])))
