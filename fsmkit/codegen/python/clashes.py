"""Conflicts between transitions whose domain depends on recorded histories."""

from __future__ import annotations

from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.linking import ME
from fsmkit.codegen.python.names import Names
from fsmkit.codegen.python.selection import bit, decimal
from fsmkit.plan import Plan
from fsmkit.plan.conflicts import conflicts_by_domain, related_domains


def print_clashes(out: Lines, plan: Plan, names: Names) -> None:
    """Print the test for conflicts whose domain depends on histories."""
    own = [(t, r) for t, r in enumerate(plan.reactions) if r and r[0].domain is not None]
    still = {t: reactions[0].domain for t, reactions in own if len(reactions) == 1}
    moving = [plan.chart.transitions[t] for t, reactions in own if len(reactions) > 1]
    doc = "Return the transitions whose exit sets meet that of this one."
    with out.method("_clashes", doc, "transition: int", "int"):
        out.line(f"domain = {still!r}.get(transition, -1)")
        for t in moving:
            with out.suite(f"if transition == {t.index}:"):
                out.line(f"domain = {ME}_domain_{names.transitions[t.index]}()")
        with out.suite("if domain < 0:"):
            out.line("return 0")
        out.line(f"found: int = {_table(conflicts_by_domain(plan))}[domain]")
        out.line(f"near: int = {_table(related_domains(plan))}[domain]")
        for t in moving:
            domain = f"{ME}_domain_{names.transitions[t.index]}()"
            with out.suite(f"if {ME}_chosen & {bit(t.index)} and near >> {domain} & 1:"):
                out.line(f"found |= {bit(t.index)}")
        out.line("return found")


def _table(numbers: dict[int, int]) -> str:
    return f"{{{', '.join(f'{key}: {decimal(number)}' for key, number in numbers.items())}}}"
