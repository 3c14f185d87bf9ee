"""Select the transitions that an event, a timeout or no event enables (SCXML 3.13, Appendix D)."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence

from fsmkit.chart.chart import Transition
from fsmkit.document.document import Trigger
from fsmkit.language import ContentError, RangeFault, evaluate
from fsmkit.runtime.interpreter.globals import Globals
from fsmkit.runtime.interpreter.structure import get_transition_domain, places_below

Enabled = tuple[Transition, ...]
"""An optimal enabled set, in the order of the states that selected its members."""


def select_eventless_transitions(g: Globals) -> Enabled:
    """Return the optimal set of eventless transitions (Appendix D, selectEventlessTransitions)."""
    table = g.index.eventless
    enabled: dict[int, Transition] = {}
    g.guards = {}
    for leaf in atomic_states(g):
        for state in g.index.chain[leaf]:
            found = first_enabled(g, table[state])
            if found is not None:
                enabled.setdefault(found.index, found)
                break
    return remove_conflicting_transitions(g, tuple(enabled.values()))


def select_transitions(g: Globals, event: int) -> tuple[Enabled, bool]:
    """Return the optimal set that an event enables (Appendix D, selectTransitions).

    The second result is whether the event is deferred; then the set is empty (see
    `chart.deferral`). The search skips the ancestors of a state that certainly defers the event.
    """
    table, defers, shared = g.index.by_event, g.index.defers, g.index.shared_deferral
    enabled: dict[int, Transition] = {}
    is_deferred = False
    g.guards = {}
    for leaf in atomic_states(g):
        for state in g.index.chain[leaf]:
            found = first_enabled(g, table[state].get(event, ()))
            if found is not None:
                enabled.setdefault(found.index, found)
                break
            if event in defers[state] and event not in shared[state]:
                is_deferred = True
                break
    selected = tuple(enabled.values())
    if is_deferred or any(
        event in shared[state] and not _is_answered(g, state, selected) for state in g.configuration
    ):
        return (), True
    return remove_conflicting_transitions(g, selected), False


def _is_answered(g: Globals, state: int, enabled: Sequence[Transition]) -> bool:
    """Whether a state, or one below it, has an enabled transition."""
    last = g.chart.states[state].last_descendant
    return any(state <= transition.source <= last for transition in enabled)


def select_timeout(g: Globals, timer: int) -> Enabled:
    """Return the first enabled transition that waits for a timer; none if no guard is true.

    A spontaneous transition (``sometimes``) is its own only alternative, while its state is active.
    """
    g.guards = {}
    alone = g.chart.transitions[timer]
    if alone.trigger is Trigger.SOMETIMES and alone.source not in g.configuration:
        return ()
    for transition in g.chart.alternatives.get(timer, (alone,)):
        if condition_match(g, transition):
            return (transition,)
        if g.fault is not None:
            break
    return ()


def atomic_states(g: Globals) -> list[int]:
    """Return the active atomic states in document order."""
    return sorted(g.index.leaves & g.configuration)


def first_enabled(g: Globals, transitions: Sequence[Transition]) -> Transition | None:
    """Return the first transition whose guard is true."""
    for transition in transitions:
        if condition_match(g, transition):
            return transition
    return None


def condition_match(g: Globals, transition: Transition) -> bool:
    """Evaluate a guard, once in a selection (Appendix D, conditionMatch; SCXML 5.9.1).

    A guard that cannot be evaluated is false, and ``error.execution`` is raised.
    """
    if transition.guard is None:
        return True
    known = g.guards.get(transition.index)
    if known is None:
        known = g.guards[transition.index] = _evaluate_guard(g, transition)
    return known


def _evaluate_guard(g: Globals, transition: Transition) -> bool:
    guard = transition.guard
    if guard is None:
        return True
    try:
        if g.watch is not None:
            return bool(g.watch(g.chart, transition, g))
        return bool(evaluate(guard, g))
    except RangeFault:
        g.stop("range")
    except ContentError as error:
        g.error("error.execution", str(error))
    return False


def remove_conflicting_transitions(g: Globals, enabled: Sequence[Transition]) -> Enabled:
    """Return the transitions that are not preempted (Appendix D, removeConflictingTransitions).

    Two transitions conflict if their exit sets intersect. The descendant's transition wins over
    its ancestor's; otherwise the one selected first wins.
    """
    if len(enabled) < 2:
        return tuple(enabled)
    filtered: dict[int, Transition] = {}
    active = sorted(g.configuration)
    # The exit sets of those that are left, as places among the active states: no two of them meet,
    # so they lie one behind the other.
    starts: list[int] = []
    exits: list[tuple[int, Transition]] = []
    for t1 in enabled:
        exit_set = places_below(g, get_transition_domain(g, t1), active)
        if not exit_set:
            filtered[t1.index] = t1
            continue
        end = bisect_left(starts, exit_set.stop)
        begin = bisect_right(starts, exit_set.start)
        if begin and exits[begin - 1][0] > exit_set.start:
            begin -= 1
        others = [t2 for _, t2 in exits[begin:end]]
        if all(g.chart.is_descendant(t1.source, t2.source) for t2 in others):
            for t2 in others:
                del filtered[t2.index]
            filtered[t1.index] = t1
            starts[begin:end] = [exit_set.start]
            exits[begin:end] = [(exit_set.stop, t1)]
    return tuple(filtered.values())
