"""Report a derived chart that widens or changes the type of an inherited variable."""

from __future__ import annotations

from fsmkit.chart.chart import Data
from fsmkit.chart.passes.collect_names import Names, collect_names
from fsmkit.chart.passes.number_states import number_states
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Document
from fsmkit.language import ArrayType, IntType, Type


def check_narrowing(base: Document | None, names: Names, tick: int, findings: Findings) -> None:
    """Compare each variable with the same one of the base: a range may only narrow.

    What the base proves of its variables (``x <= 3``) must hold in every chart derived from it.
    Constants count too: a bound may be a constant that the derived chart overrides.
    """
    if base is None:
        return
    before = collect_names(base, number_states(base, Findings()), tick, Findings())
    after = {d.name: d for d in _variables(names)}
    for old in _variables(before):
        new = after.get(old.name)
        if new is not None and not is_narrower(new.type, old.type):
            findings.add(
                "widened-range",
                f"`{old.name}` is {old.type} in the base and cannot become {new.type}",
                new.span,
                secondary=[(old.span, "declared in the base")],
                help=f"stay within {old.type}, or declare a variable of your own",
            )


def _variables(names: Names) -> tuple[Data, ...]:
    return (*names.data, *names.inputs, *names.outputs)


def is_narrower(new: Type, old: Type) -> bool:
    """Whether every value of the new type is one of the old, with the same meaning."""
    if isinstance(new, IntType) and isinstance(old, IntType):
        same_rule = new.overflow is old.overflow
        return new == old or (same_rule and new.lo in old and new.hi in old)
    if isinstance(new, ArrayType) and isinstance(old, ArrayType):
        return new.length == old.length and is_narrower(new.element, old.element)
    return new == old
