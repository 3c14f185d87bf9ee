"""Compute domains, exit sets and effective targets, given recorded histories (Appendix D)."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import replace

from fsmkit.chart.chart import Transition
from fsmkit.chart.structure import domain_of
from fsmkit.document.document import Kind
from fsmkit.runtime.interpreter.globals import Globals


def get_transition_domain(g: Globals, transition: Transition) -> int | None:
    """Return the compound state below which all exits and entries lie (getTransitionDomain).

    None for a targetless transition. Never a parallel state (findLCCA).
    """
    if not g.index.has_history_target[transition.index]:
        return g.index.domains[transition.index]
    targets = get_effective_target_states(g, transition)
    return domain_of(g.chart, replace(transition, targets=tuple(targets)))


def get_effective_target_states(g: Globals, transition: Transition) -> list[int]:
    """Return the targets, with histories dereferenced (Appendix D, getEffectiveTargetStates)."""
    targets: dict[int, None] = {}
    for target in transition.targets:
        if not g.chart.states[target].is_history:
            targets[target] = None
        elif target in g.history:
            targets |= dict.fromkeys(sorted(g.history[target]))
        else:
            default = default_transition(g, target)
            targets |= dict.fromkeys(get_effective_target_states(g, default))
    return list(targets)


def default_transition(g: Globals, state: int) -> Transition:
    """Return the initial transition of a compound state, or the default of a history."""
    initial = g.chart.states[state].initial
    assert initial is not None, state  # noqa: S101  (a chart is sound)
    return g.chart.transitions[initial]


def compute_exit_set(g: Globals, transitions: Iterable[Transition]) -> set[int]:
    """Return the active states below the domains of the transitions (computeExitSet)."""
    active = sorted(g.configuration)
    exits: set[int] = set()
    for transition in transitions:
        exits.update(active_below(g, get_transition_domain(g, transition), active))
    return exits


def active_below(g: Globals, domain: int | None, active: Sequence[int]) -> Sequence[int]:
    """Return the active states below `domain`, in document order."""
    below = places_below(g, domain, active)
    return active[below.start : below.stop]


def places_below(g: Globals, domain: int | None, active: Sequence[int]) -> range:
    """Return where, among the active states in document order, those below a domain are."""
    if domain is None:
        return range(0)
    last = g.chart.states[domain].last_descendant
    return range(bisect_right(active, domain), bisect_right(active, last))


def get_proper_ancestors(g: Globals, state: int, limit: int | None) -> tuple[int, ...]:
    """Return the ancestors below ``limit``, nearest first (Appendix D, getProperAncestors).

    Return all ancestors, including the root, if the limit is None or no proper ancestor.
    """
    ancestors = g.index.chain[state][1:]
    if limit in ancestors:
        return ancestors[: ancestors.index(limit)]
    return ancestors if limit is None else ()


def is_in_final_state(g: Globals, state: int) -> bool:
    """Whether a compound state is at a final child, a parallel one in all regions (Appendix D)."""
    children = g.index.children[state]
    match g.chart.states[state].kind:
        case Kind.COMPOUND:
            return any(
                g.chart.states[child].kind is Kind.FINAL and child in g.configuration
                for child in children
            )
        case Kind.PARALLEL:
            return all(is_in_final_state(g, child) for child in children)
        case _:
            return False
