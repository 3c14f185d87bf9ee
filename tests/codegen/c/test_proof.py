"""No undefined behaviour in generated C, whatever a host does that keeps to its contract.

`make prove` has the charts that take minutes.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import Machine, generate_machine
from fsmkit.codegen.c.options import Options
from fsmkit.testing.evidence.eva import prove
from tests.codegen.c.conftest import CHARTS, machine_of

pytestmark = pytest.mark.external

QUICK = ("flat", "nested", "apart", "functions", "chart_a", "chart_b")
PROVED = [n for n in CHARTS if n in QUICK or os.environ.get("FSMKIT_PROVE")]
REACHED = 85
"""Percent of the statements that the analysis must reach: a host that stops at once proves none.

The rest guards against what EVA knows not to happen; the smaller a machine, the more that weighs.
"""


@pytest.mark.parametrize("name", PROVED)
def test_no_alarm(name: str, tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    proof = prove(require_tool("frama-c"), machine_of(name), tmp_path)
    assert (proof.failure, proof.alarms) == ("", ())
    assert proof.reached >= REACHED


@pytest.mark.parametrize("name", ["functions", "nested"])
def test_no_alarm_in_tables(name: str, tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    """The form for size: no path, no row and no state lies outside of its table.

    The paths of `nested` have special steps, which skip parts of them.
    """
    machine = generate_machine(load(CHARTS[name]), name, Options(is_small=True))
    proof = prove(require_tool("frama-c"), machine, tmp_path)
    assert (proof.failure, proof.alarms) == ("", ())
    assert proof.reached >= REACHED


def test_an_alarm_is_seen(tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    """A queue that is used beyond its end."""
    machine = machine_of("flat")
    source = machine.files["flat.c"]
    assert source.count("m->fsm.queue_count >= FLAT_QUEUE") == 1
    broken = source.replace("m->fsm.queue_count >= FLAT_QUEUE", "m->fsm.queue_count > FLAT_QUEUE")
    files = machine.files | {"flat.c": broken}
    proof = prove(require_tool("frama-c"), Machine(machine.names, files, machine.figures), tmp_path)
    assert proof.alarms
