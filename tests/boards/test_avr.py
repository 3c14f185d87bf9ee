"""Generated C on a simulated 8-bit processor: every trace is that of the interpreter."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.boards.playing import Job, cell_jobs, expected, play_on_avr, random_jobs_for_avr

pytestmark = [pytest.mark.external, pytest.mark.slow]

RANDOM = 20
LENGTH = 100
"""Lines of a script for a chart of the production cell, at most."""
SPARE = 256
"""Bytes between the stack and the data, at least: with none, a wrong trace has another reason."""


@pytest.fixture(scope="module", params=["the production cell", "random charts"])
def jobs(request: pytest.FixtureRequest) -> list[Job]:
    if request.param == "random charts":
        found = random_jobs_for_avr(RANDOM)
        assert len(found) == RANDOM
        return found
    return cell_jobs(LENGTH)


def test_atmega1284p(jobs: list[Job], tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    compiler, simulator = require_tool("avr-gcc"), require_tool("simavr")
    for number, (job, trace) in enumerate(zip(jobs, expected(jobs), strict=True)):
        folder = tmp_path / str(number)
        folder.mkdir()
        played, unused = play_on_avr(folder, job, compiler, simulator)
        assert played == trace, job.chart.name
        assert unused > SPARE
