"""The public suites: whatever the totals are, no test may end in a bug of ours."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.testing.conformance.charts import read_chart, totals
from fsmkit.testing.conformance.conformance import Result, evaluate
from fsmkit.testing.conformance.suites import find_cases, find_charts
from fsmkit.testing.harness.harness import harness

pytestmark = pytest.mark.slow

Shared = Callable[[str], Path]

AT_LEAST = {
    ("w3c", "interpreter"): 145,
    ("w3c", "python"): 145,
    ("scripted", "interpreter"): 97,
    ("scripted", "python"): 97,
}
"""Tests that pass; to be raised, never lowered."""
SUITES = tuple(dict.fromkeys(suite for suite, _ in AT_LEAST))
EACH = {"c": 5, "pyext": 20}
"""C is compiled for each test: it gets each fifth, and must then do as the interpreter does."""
LARGEST = 100_000
"""Bytes of a chart; the three that are larger take half a minute each."""


@pytest.mark.parametrize(("suite", "target"), AT_LEAST)
def test_passed(suite: str, target: str, shared: Shared) -> None:
    cases = find_cases(shared(suite))
    verdicts = [v for case in cases for v in evaluate(case, (harness(target),), 20)]
    assert not [verdict for verdict in verdicts if "bug:" in verdict.reason]
    failed = [verdict for verdict in verdicts if verdict.result is Result.FAILED]
    passed = sum(verdict.result is Result.PASSED for verdict in verdicts)
    assert passed >= AT_LEAST[suite, target], [f"{v.name}: {v.reason}" for v in failed]


@pytest.mark.external
@pytest.mark.parametrize("target", EACH)
@pytest.mark.parametrize("suite", SUITES)
def test_c_passes_what_the_interpreter_passes(
    suite: str, target: str, shared: Shared, require_tool: Callable[[str], str]
) -> None:
    require_tool("cc")
    runtimes = (harness("interpreter"), harness(target))
    results = []
    for case in find_cases(shared(suite))[:: EACH[target]]:
        reference, compiled = evaluate(case, runtimes, 60)
        assert compiled.result is reference.result, compiled
        results.append(compiled.result)
    # how many are skipped, since a person must assess them or for what they need, is chance
    assert results.count(Result.PASSED) >= 0.95 * (len(results) - results.count(Result.SKIPPED)) > 0


@pytest.mark.cc
def test_charts_as_they_are_found(shared: Shared, require_tool: Callable[[str], str]) -> None:
    """A chart is left behind only for its own fault; those named here lack a file or a state."""
    require_tool("cc")
    folder = shared("corpus")
    paths = [path for path in find_charts(folder) if path.stat().st_size <= LARGEST]
    readings = [read_chart(path, path.name, 60) for path in paths]
    stopped = {reading.name: reading.reason for reading in readings if reading.reason}
    assert not [reason for reason in stopped.values() if "bug" in reason or "c-comp" in reason]
    found = totals(readings)
    assert found["charts"] >= 0.9 * found["files"], stopped
    assert found["compiled"] >= 0.8 * found["files"], stopped
    assert found["compiled_without_warning"] >= 0.1 * found["files"]
