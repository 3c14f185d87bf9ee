"""``unknown-send``: a `cancel` whose id no `send` can have."""

from __future__ import annotations

from fsmkit.chart.chart import Chart
from fsmkit.chart.content import all_statements
from fsmkit.chart.statements import Cancel, Fail, Send
from fsmkit.diagnostics import Findings
from fsmkit.diagnostics.suggestions import suggest


def check(chart: Chart, findings: Findings) -> None:
    """Report cancelled ids that no send has; a base chart leaves them to derived ones.

    Inherited content and content of copies was reported where it is written. A send that is an
    error at run time has lost its id, which `cancel` may name: then nothing is reported. A computed
    id has several values, of which one known id is enough.
    """
    statements = tuple(all_statements(chart))
    if chart.abstract or any(isinstance(statement, Fail) for statement in statements):
        return
    ids = {s.id for s in statements if isinstance(s, Send) and s.id is not None}
    cancels = [s for s in statements if isinstance(s, Cancel)]
    meant = {s.span for s in cancels if s.id in ids}
    for statement in cancels:
        if statement.span not in meant and statement.span.source == chart.root.span.source:
            findings.add(
                "unknown-send",
                f"no `send` has the id `{statement.id}`",
                statement.span,
                help=suggest(
                    statement.id, ids, "give that id to the delayed `send`, or remove the `cancel`"
                ),
            )
