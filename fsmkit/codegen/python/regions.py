"""Independent regions, whose transitions for one event can run one region after the other.

Appendix D exits all states first, then runs all content, then enters. The result is the same region
by region, if no region reads or writes what another writes and nothing observes the order.
"""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.chart.analysis.effects import can_fail, has_effect, is_plain
from fsmkit.chart.chart import State, Transition
from fsmkit.chart.content import variables, written
from fsmkit.chart.statements import Block
from fsmkit.codegen.python.relations import LONG
from fsmkit.codegen.python.selection import is_needing_memo
from fsmkit.document.document import Kind
from fsmkit.language import EventField, EventName, InState
from fsmkit.language.statements.tree import statements
from fsmkit.language.walk import nodes
from fsmkit.plan import Enter, Plan
from fsmkit.plan.operations import Leave
from fsmkit.plan.selection import Groups

Names = frozenset[str]


def independent(plan: Plan, groups: Groups) -> list[Groups] | None:
    """Return the candidates of each region for an event, or None if regions are dependent."""
    by_region: dict[int, Groups] = {}
    for states, steps in groups:
        by_region.setdefault(plan.region_of[states[0]], []).append((states, steps))
    regions = sorted(by_region)
    if plan.selection.are_nested(regions):
        return None
    if not all(_is_apart(plan, by_region[region]) for region in regions):
        return None
    used = [_used(plan, by_region[region]) for region in regions]
    for place, (_, changed) in enumerate(used):
        others = used[:place] + used[place + 1 :]
        if any(changed & (read | also) for read, also in others):
            return None
    return [by_region[region] for region in regions]


def _is_apart(plan: Plan, groups: Groups) -> bool:
    """Whether the candidates of a region stay inside of it and only compute."""
    sources = {states[0] for states, _ in groups}
    if any(not sources.isdisjoint(plan.chains[source][1:]) for source in sources):
        return False
    return all(
        isinstance(step, Transition) and _is_inside(plan, step) and _is_pure(plan, step)
        for _, steps in groups
        for step in steps
    )


def _is_inside(plan: Plan, transition: Transition) -> bool:
    """Whether the states that a transition exits and enters are known and in the region."""
    reaction, *others = plan.reactions[transition.index]
    return not others and (
        reaction.is_listed
        and len(reaction.enter) <= LONG
        and all(isinstance(op, Enter) for op in reaction.enter)
    )


def _touched(plan: Plan, transition: Transition) -> Iterator[State]:
    """Yield the states that a transition exits or enters."""
    (reaction,) = plan.reactions[transition.index]
    for op in (*reaction.leave, *reaction.enter):
        if isinstance(op, Leave | Enter):
            yield plan.chart.states[op.state]


def _blocks(plan: Plan, transition: Transition) -> Iterator[Block]:
    """Yield the blocks that a transition runs."""
    yield transition.content
    (reaction,) = plan.reactions[transition.index]
    for op in reaction.enter:
        if isinstance(op, Enter):
            yield from (plan.chart.transitions[default].content for default in op.defaults)
    for state in _touched(plan, transition):
        yield from state.on_exit
        yield from state.on_entry


def _is_pure(plan: Plan, transition: Transition) -> bool:
    """Whether a transition only reads and writes variables, and cannot fail."""
    if is_needing_memo(plan.chart, transition):
        return False
    for state in _touched(plan, transition):
        timed = any(plan.chart.transitions[t].timer is not None for t in state.transitions)
        if timed or state.kind is Kind.FINAL or state.invokes:
            return False
    guard, blocks = transition.guard, tuple(_blocks(plan, transition))
    asked = (InState, EventField, EventName)
    return (
        not (can_fail(guard) or has_effect(guard))
        and all(map(is_plain, blocks))
        and not any(isinstance(node, asked) for node in nodes((guard, blocks)))
    )


def _used(plan: Plan, groups: Groups) -> tuple[Names, Names]:
    """Return the variables that a region reads and those that it writes for an event."""
    steps = [step for _, tried in groups for step in tried if isinstance(step, Transition)]
    blocks = tuple(block for step in steps for block in _blocks(plan, step))
    changed = tuple(place for block in blocks for s in statements(block) for place in written(s))
    return variables((tuple(step.guard for step in steps), blocks)), variables(changed)
