"""``unread-data``: a variable that nothing reads."""

from __future__ import annotations

import re

from fsmkit.chart.chart import Chart
from fsmkit.chart.content import (
    all_statements,
    conditions,
    distinct,
    values,
    variables,
    written,
)
from fsmkit.chart.statements import ForEach
from fsmkit.diagnostics import Findings
from fsmkit.diagnostics.fixes import remove_entry
from fsmkit.document.document import Origin
from fsmkit.language import Variable
from fsmkit.language.walk import root


def check(chart: Chart, findings: Findings) -> None:
    """Report data and inputs without a reader; a base chart leaves them to derived ones.

    What a variable contributes to its own next value does not count as reading.
    """
    if chart.abstract:
        return
    unread = {data.name: data for data in (*chart.data, *chart.inputs) if data.origin is Origin.OWN}
    for name in (*_words_in_properties(chart), *variables(tuple(distinct(conditions(chart))))):
        unread.pop(name, None)
    assigned: set[str] = set()
    for statement in distinct(all_statements(chart)):
        if not unread:  # as in most charts, long before the end
            break
        used = variables(values(statement))
        for place in written(statement):
            assigned.add(root(place).name)
            if isinstance(statement, ForEach):
                used |= {root(place).name}
            elif isinstance(place, Variable):
                used -= {place.name}
        for name in used:
            unread.pop(name, None)
    for data in unread.values():
        findings.add(
            "unread-data",
            f"`{data.name}` is never read",
            data.span,
            help="remove it, or make it an output if the host reads it",
            fixes=remove_entry(data.span, whole=True) if data.name not in assigned else (),
        )


def _words_in_properties(chart: Chart) -> set[str]:
    """Return the words in the chart's properties, which include the names of variables."""
    texts = (
        text.value
        for one in chart.properties
        for text in (one.first, one.then, *one.watch)
        if text is not None
    )
    return {word for text in texts for word in re.findall(r"[A-Za-z_]\w*", text)}
