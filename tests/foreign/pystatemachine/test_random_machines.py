"""Random machines of python-statemachine do the same in the library and as charts."""

from __future__ import annotations

import os
import warnings

import pytest

pytest.importorskip("statemachine")

from tests.foreign.pystatemachine.machines import random_outcome

COUNT = int(os.environ.get("FSMKIT_STATEMACHINE_MACHINES", "300"))
"""Machines; a campaign sets more."""


@pytest.mark.slow
def test_library_and_chart_do_the_same() -> None:
    """Callbacks, their order, and the active states are equal for each event."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        outcomes = [random_outcome(3, number, 20) for number in range(COUNT)]
    differences = [one for one in outcomes if one.difference]
    assert not differences, f"{differences[0].listing}\n{differences[0].difference}"
    compared = [one for one in outcomes if one.rejected is None]
    assert len(compared) >= COUNT // 4
    assert sum(one.events for one in compared) >= 10 * len(compared)
