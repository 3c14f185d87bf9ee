"""Statecharts of itemis CREATE for tests, written in a short notation."""

from __future__ import annotations

import re
from xml.sax.saxutils import quoteattr

HEAD = (
    '<xmi:XMI xmlns:xmi="http://www.omg.org/XMI" '
    'xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" '
    'xmlns:sgraph="http://www.yakindu.org/sct/sgraph/2.0.0">'
)


def quoted(text: str) -> str:
    """Return an attribute's value, line ends included."""
    return quoteattr(text, {"\n": "&#xA;"})


def statechart(text: str, *regions: str, name: str = "T") -> str:
    """Return a file with one statechart."""
    inner = "".join(regions)
    return (
        f'{HEAD}<sgraph:Statechart xmi:id="chart" name="{name}" specification={quoted(text)}>'
        f"{inner}</sgraph:Statechart></xmi:XMI>"
    )


def region(name: str, *vertices: str) -> str:
    """Return a region; the first state is initial if there is no default entry."""
    heads = [one.partition(">")[0] for one in vertices]
    if not any('sgraph:Entry"' in one and ' name="" ' in one for one in heads):
        first = next(
            (found[1] for one in vertices if (found := re.search(r'State" xmi:id="(\w+)"', one))),
            "",
        )
        vertices = (vertex("Entry", "", f"entry_{name}", ("", first)), *vertices)
    return f'<regions name="{name}">{"".join(vertices)}</regions>'


def vertex(kind: str, name: str, id_: str, *arcs: tuple[str, str], more: str = "") -> str:
    """Return a vertex; an arc is its text and its target."""
    moves = "".join(
        f'<outgoingTransitions specification={quoted(text)} target="{target}"/>'
        for text, target in arcs
    )
    return (
        f'<vertices xsi:type="sgraph:{kind}" xmi:id="{id_}" name="{name}" {more}>{moves}</vertices>'
    )


def state(name: str, text: str, *arcs: tuple[str, str], inner: str = "") -> str:
    """Return a state with regions."""
    whole = vertex("State", name, name, *arcs, more=f"specification={quoted(text)}")
    return whole.replace("</vertices>", f"{inner}</vertices>")
