"""Say what SCXML has and a machine cannot do yet, rather than leave it out in silence."""

from __future__ import annotations

from fsmkit.diagnostics import Findings, Severity
from fsmkit.model.passes.number_states import Tree


def report_unsupported(tree: Tree, findings: Findings, *, strict: bool) -> None:
    """Add a finding for each invoked chart and each payload of a done event."""
    severity = Severity.ERROR if strict else None
    for node in tree.nodes:
        for invoke in node.state.invokes:
            findings.add(
                "unsupported-invoke",
                f"the chart invoked in `{node.id}` is not run",
                invoke.span,
                help="make it a machine of its own, and connect the two in a system",
                severity=severity,
            )
        if node.state.done_data or node.state.done_content is not None:
            findings.add(
                "payload-dropped",
                f"the data of `{node.id}` does not go with its done event",
                node.state.span,
                help="assign it to a variable before the final state is entered",
                severity=severity,
            )
