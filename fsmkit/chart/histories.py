"""Which histories are forgotten while their parent is active, since nothing can read them then."""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.chart.chart import Chart, Transition
from fsmkit.document.document import Kind, Trigger


def forgotten_histories(chart: Chart) -> tuple[tuple[int, ...], ...]:
    """Return for each state those of its histories that entering it makes forget.

    A history is recorded when its parent is left (SCXML 3.10, Appendix D exitStates), before what
    it holds is asked for. A transition asks for it only where it, or the default of a history, has
    it as a target (getEffectiveTargetStates); an initial transition does so while the parent is
    entered. If the source lies neither inside the parent nor is an internal one of the parent
    itself, the domain lies above the parent (getTransitionDomain), which is then left if it is
    active. So where no transition from within asks, the value is never read while the parent is
    active: on every runtime it is none then, and machines that differ in nothing else are equal.
    """
    kept: set[int] = set()
    for transition in chart.transitions:
        if transition.trigger is not Trigger.INITIAL:
            asked = _asked(chart, transition.targets)
            kept |= {history for history in asked if _is_from_within(chart, transition, history)}
    return tuple(
        tuple(c for c in state.children if chart.states[c].is_history and c not in kept)
        for state in chart.states
    )


def _asked(chart: Chart, targets: Iterable[int]) -> set[int]:
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
