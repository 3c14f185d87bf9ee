"""Which transitions exclude each other, where that depends on what histories hold."""

from __future__ import annotations

from fsmkit.chart.chart import Transition
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.linking import ME
from fsmkit.codegen.python.names import Names
from fsmkit.codegen.python.relations import domain_of, is_dynamic, meeting
from fsmkit.codegen.python.selection import bit, decimal
from fsmkit.document.document import Kind, Trigger
from fsmkit.plan import Plan


def print_clashes(out: Lines, plan: Plan, names: Names) -> None:
    """Print how conflicts are found where histories decide a domain."""
    chart = plan.chart
    compound = [s.index for s in chart.states if s.index == 0 or s.kind is Kind.COMPOUND]
    still = {t.index: d for t in _static(plan) if (d := domain_of(plan, t)) is not None}
    own = dict.fromkeys(compound, 0)
    for index, still_domain in still.items():
        own[still_domain] |= 1 << index
    related = meeting(chart, own)
    near = meeting(chart, {state: 1 << state for state in compound})
    moving = [t for t in chart.transitions if is_dynamic(plan, t)]
    doc = "Return the transitions whose exit sets meet that of this one."
    with out.method("_clashes", doc, "transition: int", "int"):
        out.line(f"domain = {still!r}.get(transition, -1)")
        for t in moving:
            with out.suite(f"if transition == {t.index}:"):
                out.line(f"domain = {ME}_domain_{names.transitions[t.index]}()")
        with out.suite("if domain < 0:"):
            out.line("return 0")
        out.line(f"found: int = {_table(related)}[domain]")
        out.line(f"near: int = {_table(near)}[domain]")
        for t in moving:
            domain = f"{ME}_domain_{names.transitions[t.index]}()"
            with out.suite(f"if {ME}_chosen & {bit(t.index)} and near >> {domain} & 1:"):
                out.line(f"found |= {bit(t.index)}")
        out.line("return found")


def _static(plan: Plan) -> list[Transition]:
    return [
        t
        for t in plan.chart.transitions
        if t.targets and t.trigger is not Trigger.INITIAL and not is_dynamic(plan, t)
    ]


def _table(numbers: dict[int, int]) -> str:
    return f"{{{', '.join(f'{key}: {decimal(number)}' for key, number in numbers.items())}}}"
