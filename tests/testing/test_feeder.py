"""The tests of the feeder that come with the Production Cell."""

from __future__ import annotations

from pathlib import Path

from fsmkit.diagnostics import Findings
from fsmkit.testing.coverage import reports
from fsmkit.testing.coverage.record import Recorder
from fsmkit.testing.reading import read_suite
from fsmkit.testing.running import run_case
from fsmkit.testing.runtimes import runtime

FILE = Path(__file__).parents[2] / "machines/production_cell/tests/feeder.test.yaml"


def test_the_cases_of_the_feeder_in_generated_python() -> None:
    suite, recorder, make = read_suite(FILE, Findings()), Recorder(), runtime("python")
    for case in suite.cases:
        assert run_case(suite, case, recorder=recorder, runtime=make).failures == ()
    (chart,) = recorder.coverage()
    assert reports.figures(chart).states == reports.Figure(19, 22)
    files = {Path(name).name for name in reports.lines((chart,))}
    assert files == {"feeder.yaml", "module.scxml"}, "what is inherited counts where it is written"
