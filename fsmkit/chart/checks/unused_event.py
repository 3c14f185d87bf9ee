"""``unused-event``: a declared event that the chart neither matches nor sends."""

from __future__ import annotations

from fsmkit.chart.chart import Chart
from fsmkit.chart.content import all_statements
from fsmkit.chart.statements import Destination, Raise, Send
from fsmkit.diagnostics import Findings
from fsmkit.diagnostics.fixes import remove_entry
from fsmkit.document.document import Direction, Origin


def check(chart: Chart, findings: Findings) -> None:
    """Report events of the interface without a use; a base chart leaves them to derived ones."""
    if chart.abstract:
        return
    heard = {e for t in chart.transitions for e in t.events}
    heard |= {e for s in chart.states for e in s.defer}
    sent: set[int] = set()
    for statement in all_statements(chart):
        match statement:
            case Send(event, destination=Destination.PORT):
                sent.add(event)
            case Send(event, destination=Destination.INVOKER | Destination.INVOKED):
                sent.add(event)
                heard.add(event)  # by the other machine
            case Send(event) | Raise(event):
                heard.add(event)
            case _:
                pass
    for declared in chart.events:
        if declared.origin is not Origin.OWN or declared.span is None:
            continue
        if Direction.OUT in declared.directions and declared.index not in sent:
            findings.add(
                "unused-event",
                f"`{declared.name}` is declared `out` and never sent",
                declared.span,
                help=f"write `send {declared.name}` where it happens, or remove it",
                fixes=remove_entry(declared.span, whole=True),
            )
        if declared.directions - {Direction.OUT} and declared.index not in heard:
            findings.add(
                "unused-event",
                f"no transition is taken on `{declared.name}`",
                declared.span,
                help="add a transition on it, or remove it",
                fixes=remove_entry(declared.span, whole=True),
            )
