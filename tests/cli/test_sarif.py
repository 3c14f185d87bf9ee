"""``--sarif``: the findings of a verb in a file, whether it succeeds or not."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from fsmkit.cli import execute

WRONG = '<scxml version="1.0"><state id="a"><transition target="b"/></state></scxml>'


def log(path: Path) -> list[Any]:
    results: list[Any] = json.loads(path.read_text())["runs"][0]["results"]
    return results


def test_the_findings_of_a_verb(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chart, sarif = tmp_path / "x.scxml", tmp_path / "out/x.sarif"
    chart.write_text(WRONG)
    assert execute(["show", "--sarif", str(sarif), str(chart)]) == 1
    assert [r["ruleId"] for r in log(sarif)] == ["FK0154", "FK0201"]
    chart.write_text(WRONG.replace('"b"', '"a"'))
    assert execute(["show", "--sarif", str(sarif), str(chart)]) == 0
    assert log(sarif)[0]["level"] == "warning"
    assert "FK0201" not in [r["ruleId"] for r in log(sarif)]
    capsys.readouterr()


def test_a_place_that_cannot_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    assert execute(["targets", "--sarif", str(tmp_path / "file/x.sarif")]) == 1
    assert "unwritable-output" in capsys.readouterr().err
