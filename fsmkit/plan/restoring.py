"""The entries of a recorded history: by the number of each region, or by sets of states."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.document.document import Kind
from fsmkit.plan.entries import entry_by_default
from fsmkit.plan.operations import Enter, Ops, Restore, Resume
from fsmkit.plan.regions import Region, Regions


@dataclass(frozen=True, slots=True)
class Restored:
    """The states that a deep history enters below a state, as sets.

    ``sure``: those that were active if anything was recorded; ``between``: other composite states,
    each of which is entered if one of the states below it was active.
    """

    inside: tuple[int, ...]
    sure: frozenset[int]
    between: tuple[tuple[int, tuple[int, ...]], ...]


def resumed(plan: Regions, restore: Restore) -> tuple[Resume, ...]:
    """Return the entries of a history, by the numbers that it recorded."""
    history, below = restore.history, restore.below
    if plan.chart.states[history].kind is Kind.SHALLOW_HISTORY:
        cases = ((child, entry_by_default(plan.chart, child)) for child in plan.substates[below])
        return (Resume(history, plan.region_of[below], tuple(cases)),)
    if plan.chart.states[below].kind is Kind.PARALLEL:
        return tuple(_region(plan, history, region, 0) for region in plan.inner[below])
    return (_region(plan, history, plan.regions[plan.region_of[below]], below),)


def _region(plan: Regions, history: int, region: Region, below: int) -> Resume:
    """Return the entries of a region, strictly below one of its states; all for 0."""
    cases: list[tuple[int, Ops]] = []
    for leaf in region.states:
        is_inside = not below or below < leaf <= plan.last_below[below]
        if is_inside and plan.chart.states[leaf].kind is not Kind.COMPOUND:
            path = [leaf]
            while (state := plan.region_parents[path[-1]]) and state != below:
                path.append(state)
            inner = (_region(plan, history, each, 0) for each in plan.inner[leaf])
            cases.append((leaf, (*map(Enter, reversed(path)), *inner)))
    return Resume(history, region.index, tuple(cases))


def restored_regions(plan: Regions, restore: Restore) -> list[tuple[int, int]]:
    """Return the regions that a deep history restores, each with the state before its first."""
    below, found = restore.below, []
    for region in plan.recorded_regions[restore.history]:
        top = plan.regions[region].top
        if region == plan.region_of[below] and plan.chart.states[below].kind is Kind.COMPOUND:
            found.append((region, below))
        elif below < top <= plan.ends[below]:
            found.append((region, top - 1))
    return found


def restored(plan: Regions, restore: Restore) -> Restored:
    """Return the entries of a deep history, as sets of states."""
    inside = plan.descendants(restore.below)
    sure = _sure(plan, restore)
    deeper = ((state, plan.descendants(state)) for state in inside if state not in sure)
    return Restored(inside, sure, tuple((state, below) for state, below in deeper if below))


def _sure(plan: Regions, restore: Restore) -> frozenset[int]:
    """Return the composite states that were active if the history is recorded."""
    if plan.parents[restore.history] != restore.below:
        return frozenset()
    found, todo = set(), [restore.below]
    while todo:
        state = todo.pop()
        if plan.chart.states[state].kind is Kind.PARALLEL:
            found |= {region for region in plan.substates[state] if plan.substates[region]}
            todo += plan.substates[state]
    return frozenset(found)
