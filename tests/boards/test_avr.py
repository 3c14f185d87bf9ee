"""Generated C on a simulated 8-bit processor: every trace is that of the interpreter."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

import fsmkit
from tests.boards.playing import (
    Job,
    cell_jobs,
    expected,
    play_on_avr,
    random_jobs_for_avr,
    write_player,
)
from tests.codegen.c.conftest import WARNINGS

pytestmark = [pytest.mark.external, pytest.mark.slow]

RANDOM = 20
LENGTH = 100
"""Lines of a script for a chart of the production cell, at most."""
SPARE = 256
"""Bytes between the stack and the data, at least: with none, a wrong trace has another reason."""


@pytest.fixture(scope="module", params=["the production cell", "random charts", "found"])
def jobs(request: pytest.FixtureRequest) -> list[Job]:
    if request.param == "random charts":
        found = random_jobs_for_avr(RANDOM)
        assert len(found) == RANDOM
        return found
    if request.param == "found":
        return [narrow_int_job()]
    return cell_jobs(LENGTH)


def narrow_int_job() -> Job:
    """Return a chart with uint16_t values beside negative ones, and a script of all its events."""
    chart = fsmkit.read_chart(Path(__file__).with_name("narrow_int.yaml"))
    script = ["start 0"]
    for wide in (0, 3, 4000):
        for near in (-5, -1, 0, 5):
            script += [
                f"input wide {wide}",
                f"input near {near}",
                "post look",
                "post hold",
                "run 0",
            ]
            script += ["dump", "post hold", "post look", "run 0"]
    return Job(chart, tuple(script))


def test_atmega1284p(jobs: list[Job], tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    compiler, simulator = require_tool("avr-gcc"), require_tool("simavr")
    for number, (job, trace) in enumerate(zip(jobs, expected(jobs), strict=True)):
        folder = tmp_path / str(number)
        folder.mkdir()
        played, unused = play_on_avr(folder, job, compiler, simulator)
        assert played == trace, job.chart.name
        assert unused > SPARE


def test_avr_gcc_has_nothing_to_warn_of(tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    compiler = require_tool("avr-gcc")
    for number, job in enumerate([narrow_int_job(), *random_jobs_for_avr(5)]):
        folder = tmp_path / str(number)
        folder.mkdir()
        write_player(folder, [job], board=False)
        done = subprocess.run(
            [compiler, *WARNINGS, "-mmcu=atmega1284p", "-Os", "-c", "x0.c", "-o", "x0.o"],
            cwd=folder, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
