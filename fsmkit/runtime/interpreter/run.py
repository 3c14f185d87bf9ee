"""Serve the host: post, run and dispatch.

`run` consists of three single steps, which an explorer takes one at a time: `step_eventless`,
`step_event` and `step_timer`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import assert_never

from fsmkit.chart.chart import Chart
from fsmkit.chart.statements import Destination
from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.language import Value
from fsmkit.language.units import duration_text
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter.content import deliver
from fsmkit.runtime.interpreter.globals import Globals, Receiver
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.runtime.interpreter.invocation import absorb, receiver, settle
from fsmkit.runtime.interpreter.macrostep import close_within, settle_invoked, step


def post(
    chart: Chart, snapshot: snap.Snapshot, occurrence: snap.Occurrence
) -> snap.Snapshot | None:
    """Append an event to the external queue; None if it is full or the machine does not run."""
    if not snapshot.running or not has_room(chart, snapshot):
        return None
    return _with_queue(snapshot, (*snapshot.queue, occurrence))


def has_room(chart: Chart, snapshot: snap.Snapshot) -> bool:
    """Return whether the external queue, including deferred events, has a free entry."""
    return len(snapshot.queue) + len(snapshot.deferred) < chart.capacities.queue


MOST_AT_ONCE = 10_000
"""Steps at one time before it counts as standing still, unless there are as many timers."""
LAST = 64
"""Number of macrosteps whose states the livelock error names."""


def run(
    chart: Chart, snapshot: snap.Snapshot, now: int, host: snap.Host
) -> tuple[snap.Macrostep, ...]:
    """Process all events and timers up to the time `now`; the package describes the order.

    Return the macrosteps. The last one's ``after`` is the final snapshot. Without macrosteps only
    the time changes (see `at_time`). Raises `FsmkitError` (``livelock``) if timers without delay
    follow each other endlessly; SCXML 3.13 sets no bound on them.
    """
    done: list[snap.Macrostep] = []
    current = at_time(snapshot, now)
    if index_of(chart).samples_inputs:
        tried = step_eventless(chart, current, host)
        if tried is not None:
            done.append(tried)
            current = tried.after
    allowance = len(current.queue) + len(current.deferred) + chart.capacities.microsteps
    at_once = 0
    while current.running:
        following = step_event(chart, current, host) if allowance > 0 else None
        if following is not None:
            allowance -= 1
        elif _is_due(current, now):
            following = step_timer(chart, current, host)
            allowance = chart.capacities.microsteps
            at_once = at_once + 1 if done and following and done[-1].at == following.at else 0
            if at_once > max_steps_at_one_time(chart):
                raise livelock_error(chart, done)
        if following is None:
            break
        done.append(following)
        current = following.after
    if done and current.now != now:
        done[-1] = replace(done[-1], after=at_time(current, now))
    return tuple(done)


def max_steps_at_one_time(chart: Chart) -> int:
    """Return the number of timers that may fire in succession at one time."""
    return max(MOST_AT_ONCE, 2 * len(chart.transitions))


def livelock_error(chart: Chart, done: Sequence[snap.Macrostep]) -> FsmkitError:
    """Return the ``livelock`` error for an endless series of macrosteps at one time.

    `done` holds the last of them.
    """
    small = [one for step in done[-LAST:] for one in step.microsteps]
    taken = sorted({number for one in small for number in one.transitions})
    entered = [state for one in small for state in one.entered]
    leaves = (s for s in sorted(done[-1].after.configuration) if chart.states[s].is_leaf)
    names = dict.fromkeys(chart.states[state].id for state in entered or leaves)
    return fail(
        "livelock",
        f"time stands still at {duration_text(done[-1].at * chart.capacities.tick)}: "
        f"`{chart.name}` takes more than {max_steps_at_one_time(chart):,} steps at one time, in "
        f"{', '.join(f'`{name}`' for name in names)}",
        chart.transitions[taken[0]].span if taken else None,
        help="give one of the delays a length, or let one of the steps wait for an event",
    )


def step_eventless(chart: Chart, snapshot: snap.Snapshot, host: snap.Host) -> snap.Macrostep | None:
    """Try eventless transitions, as after a change of inputs; None where nothing happened."""
    tried = step(chart, snapshot, None, host)
    return tried if tried.microsteps else None


def _is_due(snapshot: snap.Snapshot, now: int) -> bool:
    deadline = next_deadline(snapshot)
    return deadline is not None and deadline <= now


def step_event(
    chart: Chart, snapshot: snap.Snapshot, host: snap.Host, *, invoker: Receiver | None = None
) -> snap.Macrostep | None:
    """Take one event, a recalled one first, and run its macrostep; None if there is no event.

    If only invoked machines have queued events, let them continue.
    """
    if not snapshot.running:
        return None
    for place, occurrence in enumerate(snapshot.deferred):
        if not is_deferred(chart, snapshot, occurrence.event):
            rest = snapshot.deferred[:place] + snapshot.deferred[place + 1 :]
            before = snapshot.with_queues(snapshot.now, snapshot.queue, rest, snapshot.timers)
            return step(chart, before, occurrence, host, is_external=False, invoker=invoker)
    if snapshot.queue:
        before = _with_queue(snapshot, snapshot.queue[1:])
        return step(chart, before, snapshot.queue[0], host, invoker=invoker)
    return settle_invoked(chart, snapshot, host, invoker) if any(snapshot.invoked) else None


def step_timer(
    chart: Chart, snapshot: snap.Snapshot, host: snap.Host, *, invoker: Receiver | None = None
) -> snap.Macrostep | None:
    """Fire the first timer at its deadline, even before that time; None if no timer is armed."""
    deadline = next_deadline(snapshot)
    if not snapshot.running or deadline is None:
        return None
    if not snapshot.timers or snapshot.timers[0].deadline > deadline:
        return _step_timer_within(chart, snapshot, deadline, host, invoker)
    timer, later = snapshot.timers[0], snapshot.timers[1:]
    before = snapshot.with_queues(timer.deadline, snapshot.queue, snapshot.deferred, later)
    match timer.what:
        case snap.Timeout():
            return step(chart, before, timer.what, host, invoker=invoker)
        case snap.Delayed(occurrence, Destination.INTERNAL):
            return step(
                chart, before, occurrence, host, may_defer=False, is_external=False, invoker=invoker
            )
        case snap.Delayed(destination=Destination.INVOKED | Destination.INVOKER):
            return _step_passing(chart, before, timer.what, host, invoker)
        case snap.Delayed(occurrence, Destination.PORT, _, peer):
            g = Globals(chart, before, host, invoker)
            g.emit(occurrence, peer)
            return _port_macrostep(before, timer.what, g.freeze(), *g.effects)
        case snap.Delayed(occurrence):
            if not has_room(chart, before):
                return _port_macrostep(before, timer.what, before, snap.Overflowed("queue"))
            after = _with_queue(before, (*before.queue, occurrence))
            return _port_macrostep(before, timer.what, after)
        case _:
            assert_never(timer.what)


def _step_timer_within(
    chart: Chart, snapshot: snap.Snapshot, deadline: int, host: snap.Host, invoker: Receiver | None
) -> snap.Macrostep:
    """Fire the first timer of an invoked machine."""
    before = at_time(snapshot, deadline)
    g = Globals(chart, before, host, invoker)
    for invocation in chart.invocations:
        child = snapshot.invoked[invocation.index]
        if child is not None and next_deadline(child) == deadline:
            done = step_timer(invocation.chart, child, host, invoker=receiver(g, invocation))
            if done is not None:
                absorb(g, invocation, done)
            break
    if g.fault is None:
        settle(g)
    return close_within(g, before)


def _step_passing(
    chart: Chart,
    before: snap.Snapshot,
    what: snap.Delayed,
    host: snap.Host,
    invoker: Receiver | None,
) -> snap.Macrostep:
    """Let a delayed event go to the invoker or to an invoked machine; its absence is an error."""
    if what.destination is Destination.INVOKED and not any(
        before.invoked[slot] is not None for slot in what.invocations
    ):
        error = snap.Occurrence(chart.event_index["error.communication"])
        return step(chart, before, error, host, may_defer=False, is_external=False, invoker=invoker)
    g = Globals(chart, before, host, invoker)
    deliver(g, what.occurrence, what)
    settle(g)
    return close_within(g, before)


def dispatch(
    chart: Chart, snapshot: snap.Snapshot, occurrence: snap.Occurrence, now: int, host: snap.Host
) -> tuple[snap.Macrostep, bool, Value | None]:
    """Process one event at once, ahead of the queue; it is never deferred.

    Return the macrostep, whether the event enabled a transition, and the value of the last
    ``reply``, if there was one.
    """
    done = step(chart, at_time(snapshot, now), occurrence, host, may_defer=False)
    handled = any(
        small.event is not None and small.event is occurrence and small.transitions
        for small in done.microsteps
    )
    return done, handled, done.reply


def is_deferred(chart: Chart, snapshot: snap.Snapshot, event: int) -> bool:
    """Whether an active state defers an event."""
    defers = index_of(chart).defers
    return any(event in defers[state] for state in snapshot.configuration)


def next_deadline(snapshot: snap.Snapshot) -> int | None:
    """Return the first deadline of this machine and the machines it invokes, or None."""
    first = snapshot.timers[0].deadline if snapshot.timers else None
    if not any(snapshot.invoked):
        return first
    within = [next_deadline(child) for child in snapshot.invoked if child is not None]
    return min((due for due in (first, *within) if due is not None), default=None)


def at_time(snapshot: snap.Snapshot, now: int) -> snap.Snapshot:
    """Return the machine at another time."""
    if snapshot.now == now:
        return snapshot
    return snapshot.with_queues(now, snapshot.queue, snapshot.deferred, snapshot.timers)


def _with_queue(snapshot: snap.Snapshot, queue: tuple[snap.Occurrence, ...]) -> snap.Snapshot:
    return snapshot.with_queues(snapshot.now, queue, snapshot.deferred, snapshot.timers)


def _port_macrostep(
    before: snap.Snapshot, what: snap.Delayed, after: snap.Snapshot, *effects: snap.Effect
) -> snap.Macrostep:
    microsteps = (snap.Microstep(None, (), (), (), effects),) if effects else ()
    return snap.Macrostep(before, what, microsteps, after, before.now)
