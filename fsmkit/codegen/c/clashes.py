"""Names of a chart that are different in C."""

from __future__ import annotations

from fsmkit.codegen.c.names import Names
from fsmkit.diagnostics import Findings, Severity
from fsmkit.emit import snake

MOST = 5
"""How many names a message lists."""


def report_names(names: Names, findings: Findings, *, is_prefixed: bool = False) -> None:
    """Add a note with the names of a machine, and of those that it invokes, that differ in C."""
    own = snake(names.chart.name)
    changed = []
    if not (is_prefixed or names.is_invoked) and names.prefix != own:
        changed.append(f"machine `{own}` is `{names.prefix}`")
    changed += [f"{each.kind} `{each.name}` is `{each.text}`" for each in names.renamed]
    if changed:
        more = f" and {len(changed) - MOST} more" if len(changed) > MOST else ""
        findings.add(
            "c-name-taken",
            f"some names are different in C: {', '.join(changed[:MOST])}{more}",
            names.chart.root.span, severity=Severity.NOTE,
            help="the header lists them; `--prefix` chooses the name of the machine",
        )  # fmt: skip
    for inner in names.invoked:
        report_names(inner, findings)
