"""Texts of drawings have the widths for which room was left."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from fsmkit.chart.drawing.fitting import fitted
from fsmkit.chart.loading import load
from fsmkit.system.views.drawing import draw

FEEDER = Path(__file__).parents[3] / "machines/production_cell/feeder.yaml"
TEXT = '<text text-anchor="start" x="{}" y="{}" fill="red">{}</text>'


def made(*texts: tuple[float, float, str], widths: object) -> bytes:
    drawn = "".join(TEXT.format(x, -y, text) for x, y, text in texts)
    return f"<svg>{drawn}</svg>\n{json.dumps(widths)}".encode()


def test_a_text_gets_the_width_of_its_place() -> None:
    ops = [{"op": "T", "pt": [3.0, 8.5], "width": 61.25}, {"op": "c", "pt": [1, 1], "width": 3}]
    content = made((3.0, 8.5, "a &lt; b"), (3.0, 9.5, "ab"), widths={"objects": [{"_x": ops}]})
    text = fitted(content)
    assert text.count("textLength") == 1
    assert 'fill="red" textLength="61.25" lengthAdjust="spacingAndGlyphs">a &lt; b</text>' in text


def test_what_cannot_be_read_leaves_the_drawing_as_it_is() -> None:
    content = made((3.0, 8.5, "ab"), widths=[])[:-1]
    assert fitted(content) == content[: content.index(b"\n") + 1].decode()


@pytest.mark.external
@pytest.mark.usefixtures("dot")
def test_all_texts_of_a_chart_are_fitted() -> None:
    svg = draw(load(FEEDER), Path("x.svg"))
    assert isinstance(svg, bytes)
    texts = re.findall(r"<text [^>]*>[^<]{2,}</text>", svg.decode())
    assert len(texts) > 100
    assert all("textLength=" in text for text in texts)
