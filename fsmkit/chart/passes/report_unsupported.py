"""Say what SCXML has and a machine cannot do yet, rather than leave it out in silence."""

from __future__ import annotations

from fsmkit.chart.passes.number_states import Tree
from fsmkit.diagnostics import Findings, Severity


def report_unsupported(tree: Tree, findings: Findings, *, strict: bool) -> None:
    """Add a finding for each done event whose payload has no type."""
    severity = Severity.ERROR if strict else None
    for node in tree.nodes:
        if node.state.done_content is not None:
            findings.add(
                "payload-dropped",
                f"the content of `{node.id}` has no type and does not go with its done event",
                node.state.span,
                help="name its parts, with `param`",
                severity=severity,
            )
