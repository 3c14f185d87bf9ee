"""Each file of ``cases`` is a chart, a script and the trace that SEMANTICS asks for."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.runtime.script import run_script

CASES = sorted((Path(__file__).parent / "cases").glob("*.case"))
SCRIPT, TRACE = "\n--- script\n", "\n--- trace\n"


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_trace(path: Path, build: Callable[[str], Chart]) -> None:
    chart, _, rest = path.read_text(encoding="utf-8").partition(SCRIPT)
    script, _, expected = rest.partition(TRACE)
    lines = [line for line in script.splitlines() if line]
    trace = "".join(f"{line}\n" for line in run_script(build(chart), lines))
    if "FSMKIT_BLESS" in os.environ:
        path.write_text(f"{chart}{SCRIPT}{script}{TRACE}{trace}", encoding="utf-8")
        return
    assert trace == expected


def test_there_are_cases() -> None:
    assert len(CASES) >= 15
