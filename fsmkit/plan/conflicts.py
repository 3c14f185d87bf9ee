"""Conflicts between transitions, as sets: Appendix D, removeConflictingTransitions.

Exit sets intersect if one domain is the other or its ancestor: both are active and compound.
"""

from __future__ import annotations

from collections.abc import Sequence

from fsmkit.document.document import Kind
from fsmkit.plan.operations import Reaction
from fsmkit.plan.plan import Plan
from fsmkit.plan.regions import Regions

Bits = int
"""A set of transitions or of states, by their numbers."""


def static_domain(reactions: Sequence[Reaction]) -> int | None:
    """Return the domain of a transition; None for no domain or one known at run time only."""
    return reactions[0].domain if len(reactions) == 1 else None


def outer_transitions(plan: Plan) -> tuple[Bits, ...]:
    """Return for each transition those whose sources are ancestors of its source."""
    by_source = [0] * len(plan.parents)
    for transition in plan.chart.transitions:
        by_source[transition.source] |= 1 << transition.index
    found = [0] * len(by_source)
    for state, parent in enumerate(plan.parents[1:], 1):
        found[state] = found[parent] | by_source[parent]
    return tuple(found[transition.source] for transition in plan.chart.transitions)


def conflicts(plan: Plan) -> tuple[Bits, ...]:
    """Return for each transition those with an exit set that statically intersects its own."""
    domains = [static_domain(reactions) for reactions in plan.reactions]
    by_domain = dict.fromkeys(sorted({d for d in domains if d is not None}), 0)
    for index, domain in enumerate(domains):
        if domain is not None:
            by_domain[domain] |= 1 << index
    met = related(plan, by_domain)
    return tuple(0 if domain is None else met[domain] for domain in domains)


def conflicts_by_domain(plan: Plan) -> dict[int, Bits]:
    """Return for each possible domain the transitions whose exit sets intersect it."""
    own = dict.fromkeys(possible_domains(plan), 0)
    for index, reactions in enumerate(plan.reactions):
        domain = static_domain(reactions)
        if domain is not None:
            own[domain] |= 1 << index
    return related(plan, own)


def related_domains(plan: Plan) -> dict[int, Bits]:
    """Return for each possible domain itself, its ancestors and its descendants."""
    return related(plan, {state: 1 << state for state in possible_domains(plan)})


def possible_domains(plan: Plan) -> list[int]:
    """Return the root and the compound states."""
    states = plan.chart.states
    return [s.index for s in states if s.index == 0 or s.kind is Kind.COMPOUND]


def related(plan: Regions, sets: dict[int, Bits]) -> dict[int, Bits]:
    """Return for each state the union of its set and those of its ancestors and descendants.

    ``sets`` has states in document order; absent states have the empty set.
    """
    found = dict.fromkeys(sets, 0)
    around: list[int] = []
    for state, own in sets.items():
        while around and state > plan.ends[around[-1]]:
            around.pop()
        found[state] |= own
        for ancestor in around:
            found[ancestor] |= own
            found[state] |= sets[ancestor]
        around.append(state)
    return found
