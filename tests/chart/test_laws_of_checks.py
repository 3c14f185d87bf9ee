"""What the checks claim of a chart holds in every run of it."""

from __future__ import annotations

import pytest

from devtools.random_charts.charts import random_document
from devtools.random_charts.choices import SeededChoices
from devtools.random_charts.scripts import random_script
from fsmkit.chart.analysis.reachability import reachable_states
from fsmkit.chart.checks.dead_transition import dead_transitions
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings
from fsmkit.runtime.script import run_script
from tests.parameters import sampled


@pytest.mark.parametrize("seed", sampled(range(40), every=4))
def test_no_run_contradicts_a_check(seed: int) -> None:
    choices = SeededChoices(seed)
    chart = elaborate((random_document(choices),), Findings())
    assert chart is not None
    reachable = {chart.states[s].id for s in reachable_states(chart)}
    dead = {transition.index for transition, _ in dead_transitions(chart)}
    trace = run_script(chart, random_script(choices, chart, 60))
    for line in trace:
        mark, _, name = line.partition(" ")
        if mark == "+":
            assert name in reachable
        if mark == "t":
            assert int(name) not in dead
