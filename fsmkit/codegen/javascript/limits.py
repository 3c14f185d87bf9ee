"""What the JavaScript target cannot express, said before anything is written."""

from __future__ import annotations

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Trigger


def check(chart: Chart, findings: Findings) -> bool:
    """Whether a chart can be written as a JavaScript machine; findings where not."""
    is_fine = True
    for transition in chart.transitions:
        if transition.trigger is Trigger.SOMETIMES:
            is_fine = False
            findings.add(
                "javascript-sometimes",
                "a generated machine cannot take a spontaneous transition",
                transition.span,
                help="give it an event, or use the chart only as an environment of `fsmkit check`",
            )
        if transition.least is not None:
            is_fine = False
            findings.add(
                "javascript-sometimes",
                "a generated machine cannot choose how long a delay takes",
                transition.span,
                help="give it one delay, or use the chart only as an environment",
            )
    within = [check(invocation.chart, findings) for invocation in chart.invocations]
    return is_fine and all(within)
