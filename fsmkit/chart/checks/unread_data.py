"""``unread-data``: a variable that nothing reads."""

from __future__ import annotations

from fsmkit.chart.chart import Chart
from fsmkit.chart.content import all_statements, conditions, subexpressions, values
from fsmkit.chart.statements import Assign, ForEach
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Origin
from fsmkit.language import Variable


def check(chart: Chart, findings: Findings) -> None:
    """Report data and inputs without a reader; a base chart leaves them to derived ones.

    What a variable contributes to its own next value does not count as reading.
    """
    if chart.abstract:
        return
    read: set[str] = set()
    for condition in conditions(chart):
        read |= {e.name for e in subexpressions(condition) if isinstance(e, Variable)}
    for statement in all_statements(chart):
        used = {
            e.name
            for value in values(statement)
            for e in subexpressions(value)
            if isinstance(e, Variable)
        }
        if isinstance(statement, Assign) and isinstance(statement.location, Variable):
            used.discard(statement.location.name)
        if isinstance(statement, ForEach):
            used |= {v.name for v in (statement.item, statement.index) if v is not None}
        read |= used
    for data in (*chart.data, *chart.inputs):
        if data.name not in read and data.origin is Origin.OWN:
            findings.add(
                "unread-data",
                f"`{data.name}` is never read",
                data.span,
                help="remove it, or make it an output if the host reads it",
            )
