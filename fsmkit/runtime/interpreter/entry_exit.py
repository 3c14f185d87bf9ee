"""Exit and enter states (Appendix D: exitStates, enterStates and their helpers)."""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.chart.chart import State, Transition
from fsmkit.document.document import Kind
from fsmkit.language import ContentError, RangeFault, Value, default_value, evaluate
from fsmkit.runtime.interpreter import timers
from fsmkit.runtime.interpreter.content import execute_block, execute_content
from fsmkit.runtime.interpreter.globals import Globals
from fsmkit.runtime.interpreter.index import EntrySet
from fsmkit.runtime.interpreter.invocation import cancel_invoked
from fsmkit.runtime.interpreter.snapshot import Entered, Exited, Occurrence
from fsmkit.runtime.interpreter.structure import (
    compute_exit_set,
    default_transition,
    get_effective_target_states,
    get_proper_ancestors,
    get_transition_domain,
    is_in_final_state,
)


def exit_states(g: Globals, enabled: Iterable[Transition]) -> tuple[int, ...]:
    """Record histories, run exit handlers and leave, innermost first (Appendix D, exitStates)."""
    exits = sorted(compute_exit_set(g, enabled), reverse=True)
    for state in exits:
        for history in g.index.histories[state]:
            g.history[history] = _recorded_states(g, history, state)
    for state in exits:
        leave(g, state)
        g.configuration.discard(state)
    return tuple(exits)


def leave(g: Globals, state: int) -> None:
    """Cancel timers, run the exit handlers in document order (SCXML 3.9), cancel invocations."""
    g.effects.append(Exited(state))
    if g.index.timed[state]:
        timers.disarm(g, state)
    for block in g.chart.states[state].on_exit:
        execute_block(g, block)
    g.states_to_invoke.discard(state)
    for slot in g.index.invocations[state]:
        cancel_invoked(g, slot)


def _recorded_states(g: Globals, history: int, parent: int) -> frozenset[int]:
    """Return the active states that a history records when its parent is exited (SCXML 3.10)."""
    if g.chart.states[history].kind is Kind.SHALLOW_HISTORY:
        return frozenset(g.configuration.intersection(g.index.children[parent]))
    last = g.chart.states[parent].last_descendant
    return frozenset(state for state in g.index.leaves & g.configuration if parent < state <= last)


def enter_states(g: Globals, enabled: Iterable[Transition]) -> tuple[int, ...]:
    """Enter states, outermost first, with their content (Appendix D, enterStates)."""
    entry_set = compute_entry_set(g, enabled)
    entries = sorted(entry_set.to_enter)
    for index in entries:
        state = g.chart.states[index]
        g.configuration.add(index)
        for history in g.index.forgotten[index]:
            g.history.pop(history, None)
        g.effects.append(Entered(index))
        if g.index.timed[index]:
            timers.arm(g, index)
        if state.invokes:
            g.states_to_invoke.add(index)
        for block in state.on_entry:
            execute_block(g, block)
        if index in entry_set.for_default_entry:
            execute_content(g, default_transition(g, index))
        if index in entry_set.default_history_content:
            execute_content(g, entry_set.default_history_content[index])
        if state.kind is Kind.FINAL:
            _enter_final(g, state)
    return tuple(entries)


def _enter_final(g: Globals, state: State) -> None:
    """End the machine, or generate the done events of the parents (SCXML 3.7)."""
    parent = state.parent
    if parent is None or parent == 0:
        g.running = False
        g.finished = True
        return
    _raise_done(g, parent, state)
    grandparent = g.chart.states[parent].parent
    if (
        grandparent is not None
        and g.chart.states[grandparent].kind is Kind.PARALLEL
        and is_in_final_state(g, grandparent)
    ):
        _raise_done(g, grandparent, None)


def _raise_done(g: Globals, state: int, final: State | None) -> None:
    """Put ``done.state.id`` into the internal queue, with the final's data (SCXML 5.5)."""
    event = g.chart.event_index.get(f"done.state.{g.chart.states[state].id}")
    if event is None:
        return
    g.enqueue_internal(Occurrence(event, done_payload(g, event, final)))


def done_payload(g: Globals, event: int, final: State | None) -> tuple[Value, ...]:
    """Return the values of a final state's donedata, one for each field (SCXML 5.5)."""
    fields = g.chart.events[event].fields
    payload = []
    for place, part in enumerate(fields):
        expression = final.done_data[place] if final and place < len(final.done_data) else None
        value = default_value(part.type)
        if expression is not None:
            try:
                value = evaluate(expression, g)
            except RangeFault:
                g.stop("range")
            except ContentError as error:
                g.error("error.execution", str(error))
        payload.append(value)
    return tuple(payload)


# --- the entry set ----------------------------------------------------------------------------


def compute_entry_set(g: Globals, enabled: Iterable[Transition]) -> EntrySet:
    """Return the states to enter (Appendix D, computeEntrySet).

    Without histories the result depends on the transitions alone and is computed once per set.
    """
    if g.index.has_history:
        return _compute_entry_set(g, enabled)
    known = g.index.entry_sets
    key = tuple([transition.index for transition in enabled])
    found = known.get(key)
    if found is None:
        found = known[key] = _compute_entry_set(g, enabled)
    return found


def _compute_entry_set(g: Globals, enabled: Iterable[Transition]) -> EntrySet:
    found = EntrySet()
    domains: set[int] = set()
    for transition in enabled:
        for target in transition.targets:
            add_descendant_states_to_enter(g, target, found)
        domain = get_transition_domain(g, transition)
        for target in get_effective_target_states(g, transition):
            add_ancestor_states_to_enter(g, target, domain, found)
        domains |= {domain} if domain is not None else set()
    # A history targeted from within its parent adds all states between the parent and its own, with
    # all regions. Those above the domain were not exited, so they are not entered.
    above = g.index.chain
    found.to_enter = {s for s in found.to_enter if not domains.isdisjoint(above[s][1:])}
    return found


def add_descendant_states_to_enter(g: Globals, index: int, found: EntrySet) -> None:
    """Add a state and its default descendants (Appendix D, addDescendantStatesToEnter)."""
    state = g.chart.states[index]
    if state.is_history:
        _add_history(g, state, found)
        return
    found.to_enter.add(index)
    match state.kind:
        case Kind.COMPOUND:
            found.for_default_entry.add(index)
            targets = default_transition(g, index).targets
            _add_all(g, targets, index, found)
        case Kind.PARALLEL:
            _add_regions(g, index, found)
        case _:
            pass


def _add_history(g: Globals, history: State, found: EntrySet) -> None:
    """Add the recorded value of a history, or its default (SCXML 3.10)."""
    parent = history.parent
    assert parent is not None, history  # noqa: S101  (a chart is sound)
    recorded = g.history.get(history.index)
    if recorded is not None:
        _add_all(g, sorted(recorded), parent, found)
    else:
        default = default_transition(g, history.index)
        found.default_history_content[parent] = default
        _add_all(g, default.targets, parent, found)


def _add_all(g: Globals, targets: Iterable[int], ancestor: int, found: EntrySet) -> None:
    targets = tuple(targets)
    for target in targets:
        add_descendant_states_to_enter(g, target, found)
    for target in targets:
        add_ancestor_states_to_enter(g, target, ancestor, found)


def add_ancestor_states_to_enter(
    g: Globals, state: int, ancestor: int | None, found: EntrySet
) -> None:
    """Add the ancestors below ``ancestor`` (Appendix D, addAncestorStatesToEnter).

    For each parallel ancestor, also add the regions that no other target enters.
    """
    for index in get_proper_ancestors(g, state, ancestor):
        found.to_enter.add(index)
        if g.chart.states[index].kind is Kind.PARALLEL:
            _add_regions(g, index, found)


def _add_regions(g: Globals, parallel: int, found: EntrySet) -> None:
    for child in g.index.children[parallel]:
        if not found.reaches_below(g.chart, child):
            add_descendant_states_to_enter(g, child, found)
