"""One macrostep (Appendix D: interpret, mainEventLoop, microstep, exitInterpreter)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from fsmkit.chart.chart import Chart
from fsmkit.language import Value
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter import timers
from fsmkit.runtime.interpreter.content import execute_block, execute_transition_content
from fsmkit.runtime.interpreter.entry_exit import done_payload, enter_states, exit_states, leave
from fsmkit.runtime.interpreter.globals import Globals, Receiver
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.runtime.interpreter.invocation import forward, settle
from fsmkit.runtime.interpreter.selection import (
    Enabled,
    select_eventless_transitions,
    select_timeout,
    select_transitions,
)
from fsmkit.runtime.interpreter.structure import default_transition

NOTHING: Mapping[int, Value] = MappingProxyType({})


def initial(chart: Chart) -> snap.Snapshot:
    """Return a machine that has not been started."""
    return index_of(chart).initial


def start(
    chart: Chart,
    now: int,
    host: snap.Host,
    inputs: tuple[Value, ...] | None = None,
    *,
    given: Mapping[int, Value] = NOTHING,
    invoker: Receiver | None = None,
) -> snap.Macrostep:
    """Start or restart: run the script and enter the initial states (Appendix D, interpret).

    An invoker passes values of data by position, and what takes the events for it.
    """
    before = initial(chart)
    before = replace(before, now=now, inputs=before.inputs if inputs is None else inputs)
    if given:
        data = tuple(given.get(place, value) for place, value in enumerate(before.data))
        before = replace(before, data=data)
    g = Globals(chart, before, host, invoker)
    g.running = True
    g.configuration.add(0)
    execute_block(g, chart.script)
    entry = default_transition(g, 0)
    execute_block(g, entry.content)
    g.budget -= 1
    entered = enter_states(g, (entry,))
    g.close_microstep(None, entered=entered)
    main_event_loop(g)
    return snap.Macrostep(before, snap.Start(), tuple(g.microsteps), g.freeze(), now)


def step(
    chart: Chart,
    snapshot: snap.Snapshot,
    event: snap.Occurrence | snap.Timeout | None,
    host: snap.Host,
    *,
    may_defer: bool = True,
    is_external: bool = True,
    invoker: Receiver | None = None,
) -> snap.Macrostep:
    """Run one macrostep: an event or timeout (no longer in its queue), or eventless transitions.

    The time is ``snapshot.now``; for a timeout that must be its deadline. A machine that is not
    running does nothing. ``is_external``: the event has just left the external queue. ``invoker``
    takes the events for the machine that invoked this one.
    """
    if not snapshot.running:
        return snap.Macrostep(snapshot, event, (), snapshot, snapshot.now)
    g = Globals(chart, snapshot, host, invoker)
    match event:
        case snap.Occurrence():
            if is_external and chart.invocations:
                finalize(g, event)
                forward(g, event)
            react(g, event, may_defer=may_defer)
        case snap.Timeout(transition):
            timers.rearm(g, event)
            enabled = select_timeout(g, transition)
            if not enabled and not timers.postpone(g, event):
                g.effects.append(snap.SpentTimeout(transition))
            take(g, event, enabled)
        case None:
            pass
    main_event_loop(g)
    return snap.Macrostep(snapshot, event, tuple(g.microsteps), g.freeze(), snapshot.now)


def cancel(chart: Chart, snapshot: snap.Snapshot, now: int, host: snap.Host) -> snap.Macrostep:
    """End an invoked machine whose invoker left the state that holds it (SCXML 6.4.3)."""
    g = Globals(chart, snapshot, host)
    g.now = now
    g.is_cancelled = True
    g.running = False
    exit_interpreter(g)
    return snap.Macrostep(snapshot, snap.Cancellation(), tuple(g.microsteps), g.freeze(), now)


def settle_invoked(
    chart: Chart, snapshot: snap.Snapshot, host: snap.Host, invoker: Receiver | None
) -> snap.Macrostep | None:
    """Let invoked machines process their queued events; return None if no event is queued."""
    g = Globals(chart, snapshot, host, invoker)
    settle(g)
    return close_within(g, snapshot) if g.effects else None


def close_within(g: Globals, before: snap.Snapshot) -> snap.Macrostep:
    """Return a macrostep in which only invoked machines did something."""
    end_macrostep(g)
    return snap.Macrostep(before, snap.InvokedRun(), tuple(g.microsteps), g.freeze(), g.now)


def finalize(g: Globals, event: snap.Occurrence) -> None:
    """Run the finalize of the invocation that sent an event, if it is active (SCXML 6.5)."""
    declared = g.chart.events[event.event]
    slot = declared.invocation
    if slot is not None and g.chart.invocations[slot].state in g.configuration:
        g.event = event
        execute_block(g, declared.finalize)


def main_event_loop(g: Globals) -> None:
    """Run to a stable configuration and start its invocations (Appendix D, mainEventLoop)."""
    run_to_completion(g)
    while g.states_to_invoke and g.running and g.fault is None:
        for state in sorted(g.states_to_invoke):
            for block in g.chart.states[state].invokes:
                execute_block(g, block)
        g.states_to_invoke.clear()
        if g.internal:  # invoking may have raised errors
            run_to_completion(g)
    if g.running and g.fault is None and g.chart.invocations:
        settle(g)
    end_macrostep(g)


def run_to_completion(g: Globals) -> None:
    """Run to a stable configuration (Appendix D, the inner loop of mainEventLoop).

    Each round takes one set of eventless transitions or one internal event. The number of rounds
    is bounded, so that an endless macrostep becomes a fault.
    """
    while g.running and g.fault is None:
        enabled = select_eventless_transitions(g)
        if g.fault is not None or not (enabled or g.internal):
            break
        if g.budget <= 0:
            g.stop("microsteps")
        elif enabled:
            take(g, None, enabled)
        else:
            react(g, g.internal.popleft(), may_defer=False)


def end_macrostep(g: Globals) -> None:
    """Stop the machine if it is final or has a fault, and close the open microstep."""
    if g.fault is not None:
        g.running = g.finished = False
    elif not g.running:
        exit_interpreter(g)
    if g.effects:
        g.close_microstep(None)


def react(g: Globals, event: snap.Occurrence, *, may_defer: bool) -> None:
    """Take the transitions that an event enables; else defer it or report it as unhandled.

    An event is not deferred if guards called operations whose posts filled the queue.
    """
    g.event = event
    enabled, is_deferred = select_transitions(g, event.event)
    if is_deferred and may_defer and g.has_room:
        g.deferred.append(event)
        g.effects.append(snap.Deferred(event.event))
    elif not enabled:
        g.effects.append(snap.Unhandled(event.event))
        declared = g.chart.events[event.event]
        is_platform_error = declared.name.startswith("error.") and not declared.directions
        if is_platform_error and not g.chart.lenient:
            g.stop(declared.name)
    take(g, event, enabled)


def take(g: Globals, event: snap.Occurrence | snap.Timeout | None, enabled: Enabled) -> None:
    """Spend one round of the macrostep on a selection, and close it as a microstep."""
    g.budget -= 1
    if not enabled or g.fault is not None:
        if g.effects:
            g.close_microstep(event)
        return
    microstep(g, event, enabled)


def microstep(g: Globals, event: snap.Occurrence | snap.Timeout | None, enabled: Enabled) -> None:
    """Exit, run the transitions' content, enter (Appendix D, microstep)."""
    exited = exit_states(g, enabled)
    execute_transition_content(g, enabled)
    entered = enter_states(g, enabled)
    transitions = tuple(sorted(transition.index for transition in enabled))
    g.close_microstep(event, transitions, exited, entered)


def exit_interpreter(g: Globals) -> None:
    """Leave all states, innermost first (Appendix D, exitInterpreter).

    The configuration stays: it shows in which final state the machine ended.
    """
    left = sorted(g.configuration - {0}, reverse=True)
    for state in left:
        leave(g, state)
    g.internal.clear()
    g.queue.clear()
    g.deferred.clear()
    g.timers.clear()
    if g.chart.done is not None and g.finished and not g.is_cancelled:
        final = next(s for s in left if g.chart.states[s].parent == 0)
        payload = done_payload(g, g.chart.done, g.chart.states[final])
        g.enqueue_at_invoker(snap.Occurrence(g.chart.done, payload))
    g.close_microstep(None, exited=tuple(left))
