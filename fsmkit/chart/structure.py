"""Relations in the tree of states that Appendix D defines. Pure functions of a Chart."""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.chart.chart import Chart, Transition
from fsmkit.document.document import Kind


def lcca(chart: Chart, states: Iterable[int]) -> int:
    """Return the least common compound ancestor: compound or the root, never parallel.

    Appendix D, findLCCA. The first of ``states`` need not be active; its proper ancestors count.
    """
    head, *tail = states
    for ancestor in chart.ancestors(head):
        is_compound = chart.states[ancestor].kind is Kind.COMPOUND or ancestor == 0
        if is_compound and all(chart.is_descendant(other, ancestor) for other in tail):
            return ancestor
    return 0


def meeting(chart: Chart, a: int, b: int) -> int:
    """Return the least common ancestor of two states, each of which may be it."""
    above = (a, *chart.ancestors(a))
    return next(s for s in above if s == b or chart.is_descendant(b, s))


def are_orthogonal(chart: Chart, a: int, b: int) -> bool:
    """Whether two states lie in different regions of one parallel state."""
    meet = meeting(chart, a, b)
    return meet not in (a, b) and chart.states[meet].kind is Kind.PARALLEL


def can_be_together(chart: Chart, a: int, b: int) -> bool:
    """Whether a configuration can hold both of two states."""
    return meeting(chart, a, b) in (a, b) or are_orthogonal(chart, a, b)


def is_internal(chart: Chart, transition: Transition) -> bool:
    """Whether a transition keeps its source active: SCXML 3.5, ``type="internal"``.

    It must be marked so, leave from a compound state, and all (effective) targets lie below it.
    """
    source = transition.source
    return (
        transition.internal
        and chart.states[source].kind is Kind.COMPOUND
        and all(chart.is_descendant(target, source) for target in transition.targets)
    )
