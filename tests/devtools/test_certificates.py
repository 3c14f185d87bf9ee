"""The campaigns of certificates in short: random charts agree, seeded faults are found."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from devtools.certificates import CORTEX_M0, Subject, binary_faults, random_charts
from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import read_chart
from tests.verify.certify.test_certify import GATE, require


@pytest.mark.cc
def test_random_charts_agree() -> None:
    assert random_charts(range(3), seed=7, limit=150, seconds=0, command="") == []


@pytest.mark.cc
@pytest.mark.external
def test_faults_in_a_binary_are_found(tmp_path: Path) -> None:
    require(CORTEX_M0)
    subject = Subject(read_chart(GATE, Findings()), tmp_path / "gate", CORTEX_M0, 2_000)
    totals = binary_faults(subject, 12, Random(3))
    assert totals.found + len(totals.unreachable) + len(totals.survived) == 12
    assert totals.found >= 4
    assert not subject.binary_differs()
