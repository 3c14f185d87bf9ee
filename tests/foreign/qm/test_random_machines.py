"""Random models of QM: QP's rules beside the interpreter on the chart (R1, R2 and R3).

``python -m devtools.foreign rewritings`` compares 2,000 of them.
"""

from __future__ import annotations

from collections import Counter

import pytest

from devtools.foreign.qm_models import comparison

SOME = [60, pytest.param(400, marks=pytest.mark.slow)]


@pytest.mark.parametrize("machines", SOME)
def test_the_chart_does_what_qp_does(machines: int) -> None:
    used: Counter[str] = Counter()
    for number in range(machines):
        difference, rewritten = comparison(number)
        assert difference is None
        used += Counter(one.rule for one in rewritten)
    assert all(used[rule] >= machines / 2 for rule in ("R1", "R2", "R3")), used


def test_a_history_restores_a_composite_that_rests() -> None:
    """In this model a shallow history records a state that was active without a child."""
    assert comparison(613)[0] is None
