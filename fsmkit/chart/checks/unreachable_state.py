"""``unreachable-state``: no sequence of transitions enters it, guards left aside."""

from __future__ import annotations

from fsmkit.chart.analysis.reachability import reachable_states
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Origin


def check(chart: Chart, findings: Findings) -> None:
    """Report the outermost states that cannot be entered.

    A base chart is left alone: a derived one may well lead to its states.
    """
    if chart.abstract:
        return
    reached = reachable_states(chart)
    for state in chart.states[1:]:
        parent = state.parent or 0
        if state.index in reached or parent not in reached or state.origin is Origin.INHERITED:
            continue
        if state.is_history:
            continue
        findings.add(
            "unreachable-state",
            f"no transition leads to `{state.id}`",
            state.span,
            help="add a transition to it, or remove it",
        )
