"""Pictures have a dark colour for each light one."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fsmkit.chart.drawing.states.dot import draw as dot
from fsmkit.chart.loading import load
from fsmkit.emit.svg import DARK, STYLE, with_dark_colours
from fsmkit.system.views.drawing import draw
from fsmkit.verify.report.sequences import svg

ROOT = Path(__file__).parents[3]
COLOUR = re.compile(r'(?:fill|stroke)="(?!none|transparent)([^"]+)"')


def test_each_colour_of_the_generators_has_a_dark_one() -> None:
    for module in (dot, svg):
        assert module.__file__ is not None
        used = re.findall(r"#[0-9a-f]{6}\b", Path(module.__file__).read_text(encoding="utf-8"))
        assert used
        assert set(used) <= set(DARK)


def test_the_style_follows_the_opening_tag() -> None:
    written = with_dark_colours('<?xml version="1.0"?>\n<svg width="1">\n<path/></svg>')
    assert written == f'<?xml version="1.0"?>\n<svg width="1">\n{STYLE}\n<path/></svg>'


@pytest.mark.external
@pytest.mark.usefixtures("dot")
@pytest.mark.parametrize("active", [frozenset[int](), frozenset({1, 2})])
def test_each_colour_of_a_picture_has_a_dark_one(active: frozenset[int]) -> None:
    for name in ("production_cell/feeder.yaml", "philosophers/philosopher.yaml"):
        picture = draw(load(ROOT / "machines" / name), Path("x.svg"), active)
        assert isinstance(picture, bytes)
        assert STYLE in picture.decode()
        assert set(COLOUR.findall(picture.decode().replace(STYLE, ""))) <= set(DARK)
