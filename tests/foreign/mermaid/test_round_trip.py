"""Drawings in Mermaid are read back: the chart has the same states and arrows."""

from __future__ import annotations

import os
import re
from collections import Counter

import pytest

from devtools.random_charts.charts import random_document
from devtools.random_charts.choices import SeededChoices
from fsmkit.chart.chart import Chart
from fsmkit.chart.drawing.states.mermaid.draw import draw
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Kind, Trigger
from tests.foreign.imports import imported

CHARTS = int(os.environ.get("FSMKIT_CHARTS", "12"))
"""Random charts; more of them by the variable."""


def structure(chart: Chart) -> tuple[list[object], Counter[object]]:
    """Return the tree of states with their kinds, and the arrows with their triggers."""
    states: list[object] = [
        (state.index, state.kind if state.kind is not Kind.ATOMIC else "", state.parent)
        for state in chart.states
    ]
    arrows: Counter[object] = Counter(
        (each.source, each.targets, each.trigger, bool(each.guard))
        for each in chart.transitions
        if each.trigger is not Trigger.INITIAL and each.targets
    )
    starts: Counter[object] = Counter(
        (each.source, each.targets)
        for each in chart.transitions
        if each.trigger is Trigger.INITIAL and chart.states[each.source].kind is not Kind.PARALLEL
    )
    return states, arrows + starts


@pytest.mark.slow
def test_random_charts() -> None:
    read = 0
    for seed in range(10 * CHARTS):
        chart = elaborate((random_document(SeededChoices(seed), states=12),), Findings())
        if chart is None or read >= CHARTS:
            continue
        read += 1
        text = draw(chart, frozenset())
        found, findings = imported("mermaid", text, "chart.mmd")
        findings.stop_on_errors()
        assert found is not None
        again = elaborate((found.document,), findings)
        findings.stop_on_errors()
        assert again is not None
        assert structure(again) == structure(chart), text
        assert shape(draw(again, frozenset())) == shape(text), text
    assert read == CHARTS


def shape(text: str) -> list[str]:
    """Return the states and arrows of a drawing, without labels."""
    found = []
    for line in text.splitlines():
        if re.match(r"\s*(?:state .* as s\d+|state \w+ <<\w+>>|\}|--$)", line):
            found.append(re.sub(r'"[^"]*"|fork_\d+', "", line).strip())
        elif match := re.match(r"\s*(\S+ --> \S+)", line):
            found.append(re.sub(r"fork_\d+", "fork", match[1]))
    return found
