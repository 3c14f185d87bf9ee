"""Regression tests of errors that random charts found."""

from __future__ import annotations

import pytest

from devtools.differential import random_case
from fsmkit.testing.harness.harness import INTERPRETER
from fsmkit.testing.harness.javascript import run_many


@pytest.mark.external
@pytest.mark.parametrize(("seed", "number"), [(2611, 9066)])
def test_an_operation_that_an_invoked_chart_declares_otherwise(seed: int, number: int) -> None:
    case = random_case(seed, number)
    (got,) = run_many([(case.chart, case.script)])
    assert got == INTERPRETER.run(case.chart, case.script)
