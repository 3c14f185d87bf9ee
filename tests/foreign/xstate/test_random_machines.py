"""Random machines of XState do the same under node and as charts."""

from __future__ import annotations

import os

import pytest

pytest.importorskip("tree_sitter_typescript")

from tests.foreign.xstate.machines import NODE_FOLDER, compare, random_jobs
from tests.needs import need, tool

COUNT = int(os.environ.get("FSMKIT_XSTATE_MACHINES", "60"))
"""Machines; a campaign sets more."""


@pytest.mark.cc
@pytest.mark.external
def test_library_and_chart_do_the_same() -> None:
    """Exits, entries, actions, their order and their times are equal for each event."""
    tool("node")
    need((NODE_FOLDER / "node_modules" / "xstate").is_dir(), "xstate")
    outcomes = list(compare(random_jobs(int(os.environ.get("FSMKIT_SEED", "7")), COUNT, 20)))
    differences = [one for one in outcomes if one.difference]
    assert not differences, f"{differences[0].job.source.text}\n{differences[0].difference}"
    compared = [one for one in outcomes if one.rejected is None]
    assert len(compared) >= COUNT // 4
    assert sum(one.events for one in compared) >= 5 * len(compared)
