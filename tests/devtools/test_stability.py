"""Drawings stay where they are while a chart is edited; the full form is a devtool."""

from __future__ import annotations

from pathlib import Path

import pytest

from devtools.stability import FAR, MEAN, Result, charts, crossings, measure
from fsmkit.chart.drawing.positions.placement import Arrow, Placement

pytestmark = pytest.mark.external


@pytest.mark.usefixtures("dot")
@pytest.mark.parametrize("name", ["regions", "supervisor"])
def test_states_stay_while_a_chart_is_edited(name: str, tmp_path: Path) -> None:
    (path,) = [path for path in charts(tmp_path, 20) if path.stem == name]
    found = measure(path, 12, 1)
    assert found.edits == 12
    assert found.mean <= MEAN
    assert found.far < FAR
    assert found.is_tidy


def test_crossings_are_counted() -> None:
    def line(*points: tuple[float, float]) -> Arrow:
        (a, b), (c, d) = points
        return Arrow(((a, b), (a, b), (c, d), (c, d)))

    arrows = {
        "a > b": line((0, 0), (100, 100)),
        "c > d": line((0, 97), (100, 5)),
        "a > d": line((0, 90), (100, 10)),
        "e > f": line((200, 0), (200, 100)),
    }
    assert crossings(Placement({}, arrows)) == 1


def test_a_moved_state_is_reported() -> None:
    far = Result("x", 1, [0.0] * 9 + [50.0], [1.0], (0, 0), (1.0, 1.0))
    assert not far.is_good
    assert str(far).endswith("FAR")
