from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load

Build = Callable[[str], Chart]


@pytest.fixture
def build(tmp_path: Path) -> Build:
    """Return the chart of a YAML text."""

    def of(text: str) -> Chart:
        path = tmp_path / "chart.yaml"
        path.write_text(text, encoding="utf-8")
        return load(path)

    return of
