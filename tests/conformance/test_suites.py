"""The public suites: whatever the totals are, no test may end in a bug of ours.

They are not part of the project: skipped where they are not at hand.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from fsmkit.testing.conformance import Case, Result, judge
from fsmkit.testing.conformance_suites import find_cases
from fsmkit.testing.harness import harness

FOLDER = Path(
    os.environ.get("FSMKIT_CONFORMANCE", Path(__file__).parents[3] / "shared" / "conformance")
)
AT_LEAST = {"w3c": 115, "scripted": 96}
"""Tests that pass on the interpreter; to be raised, never lowered."""


def cases(suite: str) -> tuple[Case, ...]:
    folder = FOLDER / suite
    if not folder.is_dir():
        pytest.skip(f"the public test data are not at {folder}; set FSMKIT_CONFORMANCE")
    return find_cases(folder)


@pytest.mark.parametrize("suite", ["w3c", "scripted"])
def test_interpreter(suite: str) -> None:
    verdicts = [v for case in cases(suite) for v in judge(case, (harness("interpreter"),), 20)]
    bugs = [verdict for verdict in verdicts if "bug:" in verdict.reason]
    assert not bugs
    passed = sum(verdict.result is Result.PASSED for verdict in verdicts)
    assert passed >= AT_LEAST[suite], [v for v in verdicts if v.result is Result.FAILED]
