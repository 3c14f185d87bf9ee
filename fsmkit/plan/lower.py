"""The lowering from a Chart to a Plan."""

from __future__ import annotations

from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.structure import is_internal, lcca
from fsmkit.document.document import Kind, Trigger
from fsmkit.plan.entries import entries_below
from fsmkit.plan.operations import Restore, Variant, Within
from fsmkit.plan.plan import Plan
from fsmkit.plan.regions import Regions, regions_of


def lower(chart: Chart) -> Plan:
    """Return the Plan of a chart. Its size is almost linear in the size of the chart."""
    own = regions_of(chart)
    variants = tuple(_variants(own, transition) for transition in chart.transitions)
    assert chart.root.initial is not None  # noqa: S101
    start = entries_below(chart, 0, chart.transitions[chart.root.initial].targets)
    return Plan(chart, own.regions, own.region_of, own.last_below, variants, start)


def _variants(plan: Regions, transition: Transition) -> tuple[Variant, ...]:
    chart = plan.chart
    if not transition.targets:
        return (Variant((), None, ()),)
    source = transition.source
    if transition.trigger is Trigger.INITIAL:
        domain = plan.parents[source] if chart.states[source].is_history else source
        return (Variant((), domain, entries_below(chart, domain, transition.targets)),)
    if is_internal(chart, transition):
        domain = source
    else:
        domain = lcca(chart, (source, *transition.targets))
    static = Variant((), domain, entries_below(chart, domain, transition.targets))
    target = transition.targets[0]
    state = chart.states[target]
    parent = plan.parents[target]
    is_from_within = state.is_history and chart.is_descendant(source, parent)
    if len(transition.targets) > 1 or not is_from_within:
        return (static,)
    found = []
    if state.kind is Kind.DEEP_HISTORY:
        found += _deeper(plan, transition, parent)
    found += _by_default(plan, transition, domain)
    return (*found, static)


def _by_default(plan: Regions, transition: Transition, domain: int) -> list[Variant]:
    """Return the variant for an unrecorded history, if its default has another domain."""
    chart = plan.chart
    (history,) = transition.targets
    initial = chart.states[history].initial
    assert initial is not None  # noqa: S101
    targets = chart.transitions[initial].targets
    source = transition.source
    is_inside = transition.internal and chart.states[source].kind is Kind.COMPOUND
    if is_inside and all(chart.is_descendant(target, source) for target in targets):
        effective = source
    else:
        effective = lcca(chart, (source, *targets))
    if effective == domain:
        return []
    unrecorded = Within(history, plan.recorded_regions[history][0], 0, 0)
    return [Variant((unrecorded,), effective, entries_below(chart, effective, targets))]


def _deeper(plan: Regions, transition: Transition, parent: int) -> list[Variant]:
    """Return the variants whose domain lies between the source and the history's parent.

    A state is the domain if all recorded states lie below it. Its region then recorded a number
    within it, and every parallel state on the path to it has no other region.
    """
    chart = plan.chart
    (history,) = transition.targets
    source = transition.source
    chain = (source,) if transition.internal else ()
    candidates = [*chain, *(a for a in chart.ancestors(source) if chart.is_descendant(a, parent))]
    variants = []
    for candidate in candidates:
        if chart.states[candidate].kind is Kind.COMPOUND and _holds_all(plan, parent, candidate):
            region, last = plan.region_of[candidate], plan.last_below[candidate]
            condition = Within(history, region, candidate + 1, last)
            variants.append(Variant((condition,), candidate, (Restore(history, candidate),)))
    return variants


def _holds_all(plan: Regions, parent: int, candidate: int) -> bool:
    """Whether a candidate contains all active states below a parent: no region beside it."""
    for state in plan.chains[candidate]:
        if state == parent:
            break
        above = plan.parents[state]
        if plan.chart.states[above].kind is Kind.PARALLEL and len(plan.substates[above]) > 1:
            return False
    return True
