"""Features for the environment of a check, which no generated machine supports."""

from __future__ import annotations

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Trigger


def report_environment_only(chart: Chart, findings: Findings, rule: str) -> bool:
    """Return whether a machine can run a chart; report each other transition under ``rule``."""
    can_run = True
    for transition in chart.transitions:
        if transition.trigger is Trigger.SOMETIMES:
            can_run = False
            findings.add(
                rule,
                "a generated machine cannot take a spontaneous transition",
                transition.span,
                help="give it an event, or use the chart only as an environment of `fsmkit check`",
            )
        if transition.least is not None:
            can_run = False
            findings.add(
                rule,
                "a generated machine cannot choose how long a delay takes",
                transition.span,
                help="give it one delay, or use the chart only as an environment",
            )
    within = [report_environment_only(each.chart, findings, rule) for each in chart.invocations]
    return can_run and all(within)
