"""Verbs on files of other tools."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.inspector.sources.opening import open_source

MACHINE = '{"initial": "a", "states": {"a": {"on": {"go": "b"}}, "b": {}}}'


def test_a_machine_in_json_is_opened_like_a_chart(tmp_path: Path) -> None:
    """Other files of JSON are traces of `check`."""
    pytest.importorskip("tree_sitter_typescript")
    (tmp_path / "door.json").write_text(MACHINE)
    assert isinstance(open_source(tmp_path / "door.json", Findings()).source, Chart)
    (tmp_path / "trace.json").write_text('{"file": "door.yaml"}')
    with pytest.raises(FsmkitError, match="not a trace"):
        open_source(tmp_path / "trace.json", Findings())


def test_edit_names_the_conversion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "door.json").write_text(MACHINE)
    assert execute(["edit", str(tmp_path / "door.json")]) == 2
    printed = " ".join(capsys.readouterr().err.split())
    assert "fsmkit convert" in printed
    assert "--out door.yaml" in printed
