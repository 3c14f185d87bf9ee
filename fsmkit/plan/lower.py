"""From a Chart to a Plan."""

from __future__ import annotations

from bisect import bisect_right

from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.structure import is_internal, lcca
from fsmkit.document.document import Kind, Trigger
from fsmkit.plan.entries import entries_below
from fsmkit.plan.plan import Move, Plan, Region, Restore, Variant, Within


def lower(chart: Chart) -> Plan:
    """Return the plan of a chart; its size is near-linear in that of the chart."""
    regions, region_of = _regions(chart)
    last = _last_below(chart, region_of)
    recorded = tuple(
        _recorded_regions(chart, regions, region_of, state.index) if state.is_history else ()
        for state in chart.states
    )
    moves = tuple(
        Move(t.index, _variants(chart, region_of, last, recorded, t)) for t in chart.transitions
    )
    assert chart.root.initial is not None  # noqa: S101
    start = entries_below(chart, 0, chart.transitions[chart.root.initial].targets)
    return Plan(chart, regions, region_of, last, moves, start, recorded)


def _regions(chart: Chart) -> tuple[tuple[Region, ...], tuple[int, ...]]:
    region_of = [0] * len(chart.states)
    tops: list[tuple[int, int | None]] = [(0, None)]
    members: list[list[int]] = [[]]
    for state in chart.states[1:]:
        parent = state.parent
        assert parent is not None  # noqa: S101
        if chart.states[parent].kind is Kind.PARALLEL and not state.is_history:
            region_of[state.index] = len(tops)
            tops.append((state.index, parent))
            members.append([])
        else:
            region_of[state.index] = region_of[parent]
        if not state.is_history:
            members[region_of[state.index]].append(state.index)
    regions = tuple(
        Region(index, top, owner, tuple(members[index])) for index, (top, owner) in enumerate(tops)
    )
    return regions, tuple(region_of)


def _last_below(chart: Chart, region_of: tuple[int, ...]) -> tuple[int, ...]:
    last = list(range(len(chart.states)))
    for state in reversed(chart.states[1:]):
        parent = state.parent
        inside = parent is not None and region_of[parent] == region_of[state.index]
        if parent is not None and inside and not state.is_history:
            last[parent] = max(last[parent], last[state.index])
    return tuple(last)


def _recorded_regions(
    chart: Chart, regions: tuple[Region, ...], region_of: tuple[int, ...], history: int
) -> tuple[int, ...]:
    state = chart.states[history]
    parent = state.parent
    assert parent is not None  # noqa: S101
    own = (region_of[parent],) if chart.states[parent].kind is Kind.COMPOUND else ()
    # regions are in document order of their tops: those below the parent stand side by side
    last = chart.states[parent].last_descendant
    first = bisect_right(regions, parent, key=lambda region: region.top)
    inner = range(first, bisect_right(regions, last, first, key=lambda region: region.top))
    if state.kind is Kind.DEEP_HISTORY:
        return (*own, *inner)
    return own or tuple(inner[:1])  # all regions of a parallel state are always active: one tells


def _variants(
    chart: Chart,
    region_of: tuple[int, ...],
    last: tuple[int, ...],
    recorded: tuple[tuple[int, ...], ...],
    transition: Transition,
) -> tuple[Variant, ...]:
    if not transition.targets:
        return (Variant((), None, ()),)
    source = transition.source
    if transition.trigger is Trigger.INITIAL:
        domain = chart.states[source].parent if chart.states[source].is_history else source
        assert domain is not None  # noqa: S101
        return (Variant((), domain, entries_below(chart, domain, transition.targets)),)
    if is_internal(chart, transition):
        domain = source
    else:
        domain = lcca(chart, (source, *transition.targets))
    static = Variant((), domain, entries_below(chart, domain, transition.targets))
    target = transition.targets[0]
    state = chart.states[target]
    parent = state.parent
    assert parent is not None  # noqa: S101
    is_from_within = state.is_history and chart.is_descendant(source, parent)
    if len(transition.targets) > 1 or not is_from_within:
        return (static,)
    found = []
    if state.kind is Kind.DEEP_HISTORY:
        found += _deeper(chart, region_of, last, transition, parent)
    found += _by_default(chart, recorded[target], transition, domain)
    return (*found, static)


def _by_default(
    chart: Chart, recorded: tuple[int, ...], transition: Transition, domain: int
) -> list[Variant]:
    """Return the variant for a history not recorded yet, if its default has another domain."""
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
    unrecorded = Within(history, recorded[0], 0, 0)
    return [Variant((unrecorded,), effective, entries_below(chart, effective, targets))]


def _deeper(
    chart: Chart,
    region_of: tuple[int, ...],
    last: tuple[int, ...],
    transition: Transition,
    parent: int,
) -> list[Variant]:
    """Return the variants whose domain lies between the source and the parent of the history.

    A state is the domain if all that was recorded lies below it: then its region recorded a
    number inside it, and every parallel state on the way to it has no other region.
    """
    (history,) = transition.targets
    source = transition.source
    chain = (source,) if transition.internal else ()
    candidates = [*chain, *(a for a in chart.ancestors(source) if chart.is_descendant(a, parent))]
    variants = []
    for candidate in candidates:
        if chart.states[candidate].kind is not Kind.COMPOUND:
            continue
        conditions = _all_recorded_below(chart, region_of, last, history, parent, candidate)
        if conditions is not None:
            variants.append(Variant(conditions, candidate, (Restore(history, candidate),)))
    return variants


def _all_recorded_below(
    chart: Chart,
    region_of: tuple[int, ...],
    last: tuple[int, ...],
    history: int,
    parent: int,
    candidate: int,
) -> tuple[Within, ...] | None:
    region = region_of[candidate]
    conditions = [Within(history, region, candidate + 1, last[candidate])]
    for ancestor in (candidate, *chart.ancestors(candidate)):
        if ancestor == parent:
            break
        above = chart.states[ancestor].parent
        if above is not None and chart.states[above].kind is Kind.PARALLEL:
            regions = [c for c in chart.states[above].children if not chart.states[c].is_history]
            if len(regions) > 1:
                return None
    return tuple(conditions)
