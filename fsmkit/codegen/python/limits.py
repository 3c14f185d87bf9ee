"""What the Python target cannot express, said before anything is written."""

from __future__ import annotations

from fsmkit.diagnostics import Findings
from fsmkit.model.chart import Chart
from fsmkit.model.document import Trigger


def check(chart: Chart, findings: Findings) -> bool:
    """Whether a chart can be written as a Python machine; findings where not."""
    is_fine = not chart.invocations
    for invocation in chart.invocations:
        findings.add(
            "c-limit",
            f"`{invocation.id}` is an invoked chart: this target has none yet",
            invocation.span or chart.root.span,
            help="run it with `fsmkit run`",
        )
    for transition in chart.transitions:
        if transition.trigger is Trigger.SOMETIMES:
            is_fine = False
            findings.add(
                "python-sometimes",
                "a generated machine cannot take a spontaneous transition",
                transition.span,
                help="give it an event, or use the chart only as an environment of `fsmkit check`",
            )
    return is_fine
