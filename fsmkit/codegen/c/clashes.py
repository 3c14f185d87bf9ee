"""Names of a chart that C, each machine, or another name of the chart has for something else."""

from __future__ import annotations

from fsmkit.codegen.c.names import Names
from fsmkit.diagnostics import Findings, Severity
from fsmkit.emit import snake


def report_names(names: Names, findings: Findings, *, is_prefixed: bool = False) -> None:
    """Report names that would be one in C, and as a note those that have another there."""
    own = snake(names.chart.name)
    other = []
    if not (is_prefixed or names.is_invoked) and names.prefix != own:
        other.append(f"machine `{own}` is `{names.prefix}`")
    known = {(each.scope, each.alone): each for each in reversed(names.declared)}
    told = set()
    for each in names.renamed:
        base = names.numbered.get((each.scope, each.alone), "")
        first = known.get((each.scope, base))
        if first is None or first.name == each.name:
            other.append(f"{each.kind} `{each.name}` is `{each.text}`")
        elif (each.kind, each.name) not in told:
            told.add((each.kind, each.name))
            findings.add(
                "c-name-taken",
                f"{each.kind} `{each.name}` and {first.kind} `{first.name}` have one name in C: "
                f"`{first.text}`",
                each.span, secondary=[] if first.span is None else [(first.span, "the other")],
                help="rename one of the two, or choose its name in C under `names` of a binding",
            )  # fmt: skip
    if other:
        findings.add(
            "c-name-taken",
            f"C or each machine has some names for something else: {', '.join(other)}",
            names.chart.root.span, severity=Severity.NOTE,
            help="the header lists them; `--prefix` chooses the name of the machine",
        )  # fmt: skip
    for inner in names.invoked:
        report_names(inner, findings)
