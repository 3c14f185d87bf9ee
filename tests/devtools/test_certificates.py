"""The campaigns of certificates in short: random charts agree, seeded faults are found."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from devtools.certificates import CORTEX_M0, random_charts
from devtools.seeded_faults.binary import binary_faults
from devtools.seeded_faults.patches import ORIGINAL, patched, piece_patches
from devtools.seeded_faults.statements import statement_faults
from devtools.seeded_faults.subject import Subject
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
    assert totals.found + len(totals.never_executed) + len(totals.survived) == 12
    assert totals.found >= 4
    assert not subject.binary_differs()


@pytest.mark.cc
def test_faults_in_the_generated_c_and_in_its_generator_are_found(tmp_path: Path) -> None:
    subject = Subject(read_chart(GATE, Findings()), tmp_path / "gate", "", 2_000)
    totals = statement_faults(subject, 6, Random(3))
    assert totals.found >= 2
    loop = "pieces/loop.c"
    patches = [
        patch
        for patch in piece_patches(loop, (ORIGINAL / loop).read_text(encoding="utf-8"))
        if patch.before in ("m->fsm.busy = true;", "m->fsm.busy = false;")
    ]
    assert len(patches) == 2
    assert patched([subject], 2, patches, tmp_path).found == 2
