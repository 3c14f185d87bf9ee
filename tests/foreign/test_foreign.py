"""A part of `make foreign`: some charts of others, everything fsmkit does, others' readers."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.foreign.__main__ import read_by_others
from tests.foreign.readers import READERS
from tests.foreign.trials import Trial, charts_below
from tests.needs import where

pytestmark = pytest.mark.external

DATA = Path(
    os.environ.get("FSMKIT_CONFORMANCE", Path(__file__).parents[3] / "shared" / "conformance")
)
LARGEST = 10_000
"""Bytes of a chart; `make foreign` takes the larger ones, too."""
EACH = 8
CHECKED = 1.0
"""Seconds for `check` and each export of a chart: a chart with a counter has no end of states."""
CHARTS = [path for path in charts_below(DATA / "corpus") if path.stat().st_size <= LARGEST][::EACH]


@pytest.mark.slow
@where(CHARTS, "the public test data are not there; set FSMKIT_CONFORMANCE")
@pytest.mark.parametrize("chart", CHARTS, ids=lambda path: path.name)
def test_charts_of_others(chart: Path, tmp_path: Path) -> None:
    beside = tmp_path / "beside"
    beside.mkdir()
    for path in chart.parent.iterdir():
        if path.is_file():
            shutil.copy(path, beside)
    tried = Trial(beside / chart.name, tmp_path, chart.name, checked=CHECKED).all()
    read_by_others([tried])
    assert not tried.problems


BROKEN = {
    "c": "int f(void) { return 1 }",
    "py": "def f(:",
    "dot": "digraph { a -> }",
    "mmd": "stateDiagram-v2\n  a --> : {{{ b\n",
    "puml": "@startuml\nfoo bar ->>> ((\n@enduml\n",
    "pml": "active proctype p() { do }",
    "jani": '{"jani-version": 1}',
    "xml": "<nta><template/></nta>",
    "csp": "P = a -> (Q",
    "aut": 'des (0, 2, 1)\n(0, "a", 0)\n',
    "svg": "<svg",
}


@pytest.mark.parametrize("suffix", READERS)
def test_each_reader_refuses_what_is_broken(
    suffix: str, tmp_path: Path, require: Callable[[bool, str], None]
) -> None:
    reader = READERS[suffix]
    require(reader.is_there(), reader.name)
    broken = tmp_path / f"broken.{suffix}"
    broken.write_text(BROKEN[suffix])
    assert set(reader.read([broken])) == {broken}
