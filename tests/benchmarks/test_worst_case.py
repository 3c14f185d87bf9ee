"""The worst case of each event: hand-written and generated machines in the emulator."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.comparison import c_machines
from benchmarks.worst_case.__main__ import Worst, measure
from benchmarks.yardstick.charts import chart_file
from benchmarks.yardstick.streams import make_stream
from tests.verify.certify.test_certify import COMPILERS, require

COUNT = 2_000


@pytest.mark.cc
@pytest.mark.external
def test_machines_by_hand_and_generated_are_measured(tmp_path: Path) -> None:
    require(COMPILERS["Cortex-M0"])
    stream = make_stream("A", tmp_path, COUNT)
    (by_hand,) = c_machines.by_hand("A")
    (generated, *_), _ = c_machines.machines(chart_file("A"), c_machines.VARIANTS[:1])
    hand, own = (
        measure(machine, stream, COUNT, tmp_path / machine.variant.name)
        for machine in (by_hand, generated)
    )
    assert list(hand) == list(own) == [f"E{number}" for number in range(8)]
    for event, worst in hand.items():
        assert 15 < worst.instructions < own[event].instructions
        assert worst.instructions < worst.cycles < 3 * worst.instructions
        assert 0 < worst.stack < own[event].stack
    assert Worst() not in own.values()
