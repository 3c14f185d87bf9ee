"""Facts of the tree of states: relations of Appendix D, deferral and regions, histories."""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.chart.chart import Chart, Transition
from fsmkit.document.document import Kind, Trigger


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


def has_history_target(chart: Chart, transition: Transition) -> bool:
    """Whether a target is a history, so that the effective targets depend on the run."""
    return any(chart.states[target].is_history for target in transition.targets)


def domain_of(chart: Chart, transition: Transition) -> int | None:
    """Return the domain of a transition without history targets; None if it has no target.

    Appendix D, getTransitionDomain: the transition leaves and enters states below the domain only.
    """
    if not transition.targets:
        return None
    if is_internal(chart, transition):
        return transition.source
    return lcca(chart, (transition.source, *transition.targets))


def shared_deferral(chart: Chart) -> tuple[frozenset[int], ...]:
    """Return by state the events it defers that states in regions below it have transitions on.

    An event is deferred if an active state defers it and neither that state nor an active one
    below it has an enabled transition for it (UML 2.5.1, p. 309); then no region takes it. Whether
    such an event is deferred is known only after all these regions were checked. For any other
    event it is known as soon as the state is reached from one atomic state below it.
    """
    if not any(state.defer for state in chart.states):
        return (frozenset(),) * len(chart.states)
    found: list[set[int]] = [set() for _ in chart.states]
    for transition in chart.transitions:
        events = frozenset(transition.events)
        is_in_region = False
        for above in chart.ancestors(transition.source) if events else ():
            is_in_region = is_in_region or chart.states[above].kind is Kind.PARALLEL
            if is_in_region:
                found[above] |= events.intersection(chart.states[above].defer)
    return tuple(map(frozenset, found))


def forgotten_histories(chart: Chart) -> tuple[tuple[int, ...], ...]:
    """Return for each state those of its histories that entering it makes forget.

    A history is recorded when its parent is left (SCXML 3.10, Appendix D exitStates), before its
    value is read. A transition reads it only if it, or the default of a history, has it as a target
    (getEffectiveTargetStates). An initial transition does so while the parent is entered. If the
    source is not inside the parent, and the transition is not an internal one of the parent, the
    domain is above the parent (getTransitionDomain). The parent is then left if it is active. So if
    no transition from within reads the history, its value is never read while the parent is active.
    Every runtime clears it then, and machines that differ in nothing else are equal.
    """
    kept: set[int] = set()
    for transition in chart.transitions:
        if transition.trigger is not Trigger.INITIAL:
            read = _histories_among(chart, transition.targets)
            kept |= {history for history in read if _is_from_within(chart, transition, history)}
    return tuple(
        tuple(c for c in state.children if chart.states[c].is_history and c not in kept)
        for state in chart.states
    )


def _histories_among(chart: Chart, targets: Iterable[int]) -> set[int]:
    """Return the histories among targets, and those that their defaults lead to."""
    found: set[int] = set()
    waiting = list(targets)
    while waiting:
        state = chart.states[waiting.pop()]
        if state.is_history and state.index not in found:
            found.add(state.index)
            assert state.initial is not None  # noqa: S101  (a chart is sound)
            waiting += chart.transitions[state.initial].targets
    return found


def _is_from_within(chart: Chart, transition: Transition, history: int) -> bool:
    """Whether a transition to a history may keep its parent active."""
    parent, source = chart.states[history].parent, transition.source
    assert parent is not None  # noqa: S101  (a chart is sound)
    is_internal = transition.internal and chart.states[source].kind is Kind.COMPOUND
    return chart.is_descendant(source, parent) or (is_internal and source == parent)
