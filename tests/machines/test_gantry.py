"""The gantry: two axes of one chart; its properties hold, and do not if x moves too early."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import fsmkit

GANTRY = Path(__file__).parents[2] / "machines/gantry"


@pytest.fixture
def gantry(tmp_path: Path) -> Path:
    for path in GANTRY.glob("*.yaml"):
        shutil.copy(path, tmp_path)
    return tmp_path / "gantry.yaml"


def verdicts(path: Path) -> dict[str, fsmkit.Verdict]:
    report = fsmkit.check(path, engine="python", time="discrete")
    return {result.name: result.verdict for result in report.results}


def test_what_must_hold_does(gantry: Path) -> None:
    found = verdicts(gantry)
    assert {"travels_lifted", "puts", "comes_back"} <= set(found)
    assert set(found.values()) == {fsmkit.Verdict.HOLDS}


def test_an_axis_that_seeks_too_early_is_found(gantry: Path) -> None:
    text = gantry.read_text(encoding="utf-8")
    early = text.replace("entry: raise z_home", "entry: raise z_home; raise x_home")
    assert early != text
    gantry.write_text(early, encoding="utf-8")
    assert verdicts(gantry)["travels_lifted"] is fsmkit.Verdict.VIOLATED
