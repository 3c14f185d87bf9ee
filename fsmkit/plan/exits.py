"""Exit sets of transitions, and the histories that record them: Appendix D, exitStates.

While the source of a transition is active, all its ancestors are. Which of its descendants are
active, and which states of other regions, is known at run time only.
"""

from __future__ import annotations

from bisect import bisect_right

from fsmkit.document.document import Kind
from fsmkit.plan.operations import Kept, Leave, LeaveBelow, LeaveRegion, Reaction, Record
from fsmkit.plan.regions import Regions

LISTED = 16
"""The number of states from which on they are not exited one by one."""

Exits = tuple[Leave | LeaveRegion | LeaveBelow, ...]


def exits(plan: Regions, source: int, domain: int) -> Exits:
    """Return the operations that exit states below a domain, innermost first."""
    path: list[int] = []
    for state in plan.chains[source]:
        if state == domain:
            break
        path.append(state)
    is_deepest = plan.chart.states[source].kind is not Kind.COMPOUND
    is_one_region = plan.region_of[source] == plan.region_of[domain]
    if source == domain or not (is_deepest and is_one_region and len(path) < LISTED):
        return (LeaveBelow(domain, path[-1] if path else domain),)
    inner = (LeaveRegion(region.index) for region in reversed(plan.inner[source]))
    return (*inner, *map(Leave, path))


def records(plan: Regions, source: int, domain: int, leave: Exits) -> tuple[Record, ...]:
    """Return the histories to record before states below a domain are exited, in order.

    ``leave``: the exits. If they list states, these are all active states of the domain's region.
    They are all active states of the machine unless the exits contain regions.
    """
    if not plan.every_history:
        return ()
    found = []
    around, states = plan.chains[source], plan.chart.states
    is_whole = all(isinstance(op, Leave) for op in leave)
    is_listed = is_whole or not isinstance(leave[0], LeaveBelow)
    for history in _reachable(plan, source):
        parent = plan.parents[history]
        if not domain < parent <= plan.ends[domain]:
            continue
        is_sure = parent in around
        is_beside = is_listed and plan.region_of[parent] == plan.region_of[domain]
        if not is_sure and (is_whole or is_beside):
            continue
        kept = None
        if is_sure and is_whole:
            is_deep = states[history].kind is Kind.DEEP_HISTORY
            kept = source if is_deep else around[around.index(parent) - 1]
        found.append(Record(history, parent, is_sure, kept))
    return tuple(found)


def _reachable(plan: Regions, source: int) -> list[int]:
    """Return the histories of all states that may be active together with a state, in order.

    The regions are its own, and those around it and within it.
    """
    every, end = plan.every_history, plan.ends[source]
    first, last = bisect_right(every, source), bisect_right(every, end)
    if not plan.is_single:
        around, region_of = plan.chains[source], plan.region_of
        return [
            history
            for at, history in enumerate(every)
            if first <= at < last
            or plan.parents[history] in around
            or region_of[plan.parents[history]] != region_of[source]
        ]
    own = (history for state in plan.chains[source] for history in plan.histories[state])
    return sorted({*own, *every[first:last]})


def recording_domains(plan: Regions, history: int) -> tuple[int, ...]:
    """Return the domains below which a history is recorded, innermost first."""
    states, around = plan.chart.states, plan.chains[plan.parents[history]]
    compound = (state for state in around[1:] if states[state].kind is Kind.COMPOUND)
    return (*compound, 0) if around else ()


def kept_parts(plan: Regions, history: int) -> tuple[Kept, ...]:
    """Return the parts of each region that a history records."""
    parent, regions = plan.parents[history], plan.recorded_regions[history]
    if plan.chart.states[history].kind is Kind.DEEP_HISTORY:
        return tuple(Kept(region, None) for region in regions)
    if plan.chart.states[parent].kind is Kind.PARALLEL:
        return tuple(Kept(region, (plan.regions[region].top,)) for region in regions)
    return tuple(Kept(region, plan.substates[parent]) for region in regions)


def recordable(plan: Regions, history: int) -> tuple[int, ...]:
    """Return the states that a history can record: atomic ones, or children of its parent."""
    parent, states = plan.parents[history], plan.chart.states
    if states[history].kind is Kind.DEEP_HISTORY:
        return tuple(state for state in plan.descendants(parent) if states[state].is_leaf)
    return plan.substates[parent]


def possible_below(plan: Regions, reaction: Reaction) -> list[int]:
    """Return the states below a domain that can be active while the source is.

    These are its ancestors, its descendants, and the states of other regions.
    """
    source, domain = plan.chart.transitions[reaction.transition].source, reaction.domain
    found = list(plan.descendants(source))
    for state in plan.chains[source]:
        if state == domain:
            break
        found.append(state)
        parent = plan.parents[state]
        if plan.chart.states[parent].kind is Kind.PARALLEL:
            for beside in plan.substates[parent]:
                if beside != state:
                    found += (beside, *plan.descendants(beside))
    return sorted(found)
