"""Values far apart: a payload of 32 bits has few values that matter, and a wide range between."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.cli import execute

CHART = """
chart: Wide
events: {in: [e(n int32)]}
initial: a
states:
  a: {rest: true, on: {e: {if: event.n == 2000000000, target: b}}}
  b: {rest: true, on: {e: {if: event.n == -2000000000, target: a}}}
"""


@pytest.mark.external
def test_values_far_apart_take_no_memory(tmp_path: Path) -> None:
    (tmp_path / "wide.yaml").write_text(CHART)
    out = tmp_path / "wide.xml"
    assert (
        execute(["export", str(tmp_path / "wide.yaml"), "--to", "uppaal", "--out", str(out)]) == 0
    )
    assert "2000000000" in out.read_text()
