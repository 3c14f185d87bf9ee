"""What a chart may hold that an extension module cannot: names that the headers of Python have."""

from __future__ import annotations

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings, Span
from fsmkit.language import RecordType

TAKEN = ("Py", "_Py", "METH_", "FSM_", "fsm_")
"""How the names of macros begin that the wrapper uses."""


def report_names(chart: Chart, findings: Findings) -> None:
    """Report variables and fields, members of structs in C, that macros would take apart."""
    for variable in (*chart.data, *chart.inputs, *chart.outputs):
        _report(variable.name, variable.span, findings)
    for event in chart.events:
        for part in event.fields:
            _report(part.name, event.span or chart.root.span, findings)
    for type_ in chart.types:
        for part in type_.fields if isinstance(type_, RecordType) else ():
            _report(part.name, chart.root.span, findings)
    for invocation in chart.invocations:
        report_names(invocation.chart, findings)


def _report(name: str, span: Span, findings: Findings) -> None:
    if name.startswith(TAKEN):
        findings.add(
            "c-limit", f"`{name}` begins as names of Python's headers do", span,
            help="give it another name, or use the target python",
        )  # fmt: skip
