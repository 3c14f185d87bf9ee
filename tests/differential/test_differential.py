"""The heart of the tests: on random charts, every target does what the interpreter does.

The long run is ``python -m devtools.differential --charts 1000``.
"""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from click.testing import CliRunner
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from devtools.differential import (
    BATCH,
    Case,
    compare,
    compare_all,
    elaborated,
    explain,
    main,
    random_case,
    reduce_case,
    run_batch,
    target_names,
)
from devtools.random_charts.charts import documents
from devtools.random_charts.scripts import scripts
from devtools.runtimes import harness
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import fail

CHARTS = {"python": 75, "pyext": 25}
FEWER = 60
"""For targets that have to be compiled."""
SEED = 2024


@pytest.mark.slow
@pytest.mark.external
@pytest.mark.parametrize("target", target_names())
def test_random_charts(target: str) -> None:
    for first in range(0, CHARTS.get(target, FEWER), BATCH):
        totals = run_batch(SEED, range(first, first + BATCH), [target])
        for name, found in totals.divergences[:1]:
            small, less = reduce_case(random_case(SEED, int(name.split()[1])), harness(target), 300)
            pytest.fail(explain(small, less or found))
        assert totals.charts == BATCH
        assert totals.rejected == 0
        assert totals.macrosteps > BATCH


@pytest.mark.slow
@pytest.mark.external
@pytest.mark.parametrize("target", ["c", "javascript", "python"])
def test_random_charts_that_are_saved_and_restored(target: str) -> None:
    totals = run_batch(SEED, range(1000, 1000 + BATCH), [target], is_saved=True)
    for name, found in totals.divergences[:1]:
        case = random_case(SEED, int(name.split()[1]), is_saved=True)
        small, less = reduce_case(case, harness(target), 300)
        pytest.fail(explain(small, less or found))
    assert (totals.charts, totals.rejected) == (BATCH, 0)
    assert totals.macrosteps > BATCH


@pytest.mark.slow
@pytest.mark.external
@pytest.mark.parametrize(("target", "charts"), [("c", 10), ("javascript", 10), ("python", 25)])
def test_random_charts_with_functions(target: str, charts: int) -> None:
    totals = run_batch(SEED, range(charts), [target], has_functions=True)
    for name, found in totals.divergences[:1]:
        case = random_case(SEED, int(name.split()[1]), has_functions=True)
        small, less = reduce_case(case, harness(target), 300)
        pytest.fail(explain(small, less or found))
    assert (totals.charts, totals.rejected) == (charts, 0)


@pytest.mark.slow
@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck), database=None)
@given(st.data())
def test_drawn_charts_in_python(data: st.DataObject) -> None:
    document = data.draw(documents(8))
    chart = elaborated((document,))
    case = Case((document,), chart, data.draw(scripts(chart, 15)))
    divergence = compare(case, harness("python"))
    assert divergence is None, explain(case, divergence)


class Failing:
    """A target that ends each run with an error of one rule."""

    name = "failing"

    def __init__(self, rule: str) -> None:
        self.rule = rule

    def run(self, chart: Chart, script: Sequence[str]) -> list[str]:
        raise fail(self.rule, f"`{chart.name}`, {len(script)} lines: on purpose")


def test_what_a_target_cannot_express_is_refused() -> None:
    totals = compare_all([random_case(SEED, 1)], [Failing("c-limit")])
    assert (totals.rejected, totals.divergences) == (1, [])


@pytest.mark.parametrize("rule", ["c-compiler-failed", "harness-failed", "no-c-compiler"])
def test_a_target_that_fails_has_not_refused(rule: str) -> None:
    totals = compare_all([random_case(SEED, 1)], [Failing(rule)])
    assert totals.rejected == 0
    ((_, divergence),) = totals.divergences
    assert "on purpose" in divergence.got


@pytest.mark.slow
def test_the_long_run_tells_its_figures() -> None:
    result = CliRunner().invoke(
        main, ["--charts", "5", "--seed", "3", "--targets", "python", "--processes", "1"]
    )
    assert result.exit_code == 0, result.output
    assert "5 charts on python: " in result.output
    assert " 0 divergences, 0 rejected, " in result.output
