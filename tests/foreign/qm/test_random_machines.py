"""Random models of QM: QP's rules beside the interpreter on the chart (R1, R2 and R3)."""

from __future__ import annotations

from collections import Counter

import pytest

from devtools.random_charts.choices import SeededChoices
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, Source
from fsmkit.foreign.qm.reader import import_machine
from tests.foreign.qm.machines import EVENTS, chart_calls, random_model, reference_calls, text_of

SOME = [60, pytest.param(400, marks=pytest.mark.slow)]


def compare(seed: int, number: int) -> Counter[str]:
    """Compare a model with its chart; return how often each rewriting was applied."""
    choices = SeededChoices(f"qm {seed}:{number}")
    model = random_model(choices)
    events = [choices.pick(EVENTS) for _ in range(30)]
    text, findings = text_of(model), Findings()
    found = import_machine(Source("random.qm", text), "Random", findings)
    findings.stop_on_errors()
    assert found is not None
    chart = elaborate((found.document,), findings)
    findings.stop_on_errors()
    assert chart is not None
    assert chart_calls(chart, events) == reference_calls(model, events), (number, text)
    return Counter(rewriting.rule for rewriting in found.rewritten)


@pytest.mark.parametrize("machines", SOME)
def test_the_chart_does_what_qp_does(machines: int) -> None:
    used: Counter[str] = Counter()
    for number in range(machines):
        used += compare(7, number)
    assert all(used[rule] >= machines / 2 for rule in ("R1", "R2", "R3")), used
