"""Invoked machines as part of the state of their invoker (SCXML 6.4).

The steps of an invoked machine are part of its invoker's macrosteps, so an exploration has one
machine. Waiting events, armed timers and expired ones count for it, at any depth. In all lists a
machine precedes those in its slots, in the order of the chart.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import replace
from typing import assert_never

from fsmkit.chart.chart import Chart
from fsmkit.chart.walk import charts_within
from fsmkit.diagnostics import fail
from fsmkit.document.document import Trigger
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter.run import is_deferred, next_deadline

BEFORE_ALL = -1
"""A deadline before those of all timers of a settled state whose deadlines do not count."""


def running_within(chart: Chart, snapshot: snap.Snapshot) -> Iterator[tuple[Chart, snap.Snapshot]]:
    """Yield a machine and the running machines in it."""
    yield chart, snapshot
    for invocation, child in zip(chart.invocations, snapshot.invoked, strict=True):
        if child is not None:
            yield from running_within(invocation.chart, child)


def effects_within(
    chart: Chart, done: snap.Macrostep, path: str = ""
) -> Iterator[tuple[str, Chart, snap.Effect]]:
    """Yield the effects of a macrostep in order; ``path``: the slots, each with a colon."""
    for effect in done.effects:
        if isinstance(effect, snap.InvokedMacrostep):
            invocation = chart.invocations[effect.invocation]
            inner = f"{path}{invocation.id}: "
            yield from effects_within(invocation.chart, effect.macrostep, inner)
        else:
            yield path, chart, effect


def require_explorable(chart: Chart) -> None:
    """Reject the features of a chart with invocations that are not explored."""
    if not chart.invocations:
        return
    results = {operation.name: operation.result for operation in chart.operations}
    for one in charts_within(chart):
        for transition in one.transitions:
            is_spontaneous = transition.trigger is Trigger.SOMETIMES and one is not chart
            if is_spontaneous or transition.least is not None:
                what = "`sometimes`" if is_spontaneous else "a delay that is an interval"
                where = "an invoked chart" if one is not chart else "a chart that invokes others"
                raise fail(
                    "not-explored-yet",
                    f"{what} in {where} is not explored",
                    transition.span,
                    help="make it a machine of its own in a system",
                )
        for operation in one.operations:
            if results.setdefault(operation.name, operation.result) != operation.result:
                raise fail(
                    "not-explored-yet",
                    f"`{operation.name}` returns other types in charts that run together",
                    operation.span,
                    help="rename one of them",
                )


def require_alone(chart: Chart, what: str, way_out: str) -> None:
    """Reject a chart that invokes others."""
    for invocation in chart.invocations:
        raise fail(
            "not-explored-yet",
            f"`{invocation.id}` is invoked by `{chart.name}`: {what}",
            invocation.span,
            help=way_out,
        )


def settled(
    chart: Chart, snapshot: snap.Snapshot, *, untimed: bool, in_order: bool = False
) -> snap.Snapshot:
    """Return a machine, and those in it, with everything cleared that is not state.

    ``in_order``: the order in which timers were armed is state although their deadlines are not.
    """
    if not snapshot.running:
        fault = snapshot.fault
        if fault is not None and fault.startswith("error."):
            fault = "error"
        return replace(
            snapshot,
            history=(),
            queue=(),
            deferred=(),
            timers=(),
            now=0,
            fault=fault,
            invoked=(None,) * len(chart.invocations),
        )
    timers = snapshot.timers
    if untimed and timers:
        timers = tuple(snap.Timer(0, t.what) for t in timers)
        timers = timers if in_order else tuple(sorted(timers, key=_untimed_order))
    invoked = snapshot.invoked
    if any(invoked):
        invoked = tuple(
            None if child is None else settled(invocation.chart, child, untimed=untimed)
            for invocation, child in zip(chart.invocations, invoked, strict=True)
        )
    return replace(snapshot, timers=timers, now=0, invoked=invoked)


def waiting_count(chart: Chart, snapshot: snap.Snapshot) -> int:
    """Return the number of events that can be taken from queues now."""
    return sum(
        len(s.queue) + sum(not is_deferred(c, s, o.event) for o in s.deferred)
        for c, s in running_within(chart, snapshot)
    )


def timers_within(chart: Chart, snapshot: snap.Snapshot) -> list[tuple[Chart, snap.Timer]]:
    """Return all armed timers."""
    return [(c, timer) for c, s in running_within(chart, snapshot) for timer in s.timers]


def timer_of(chart: Chart, snapshot: snap.Snapshot, place: int) -> tuple[Chart, snap.Timer]:
    """Return the timer that a step fires, and the chart of the machine that armed it."""
    armed = timers_within(chart, snapshot)
    if place > 0 or not chart.invocations:
        return armed[place]
    return min(armed, key=lambda one: one[1].deadline)


def is_due(snapshot: snap.Snapshot) -> bool:
    """Whether a timer has expired, in a settled machine or in one that runs in it."""
    deadline = next_deadline(snapshot)
    return deadline is not None and deadline <= 0


def invoked_elapsed(snapshot: snap.Snapshot, ticks: int) -> tuple[snap.Snapshot | None, ...]:
    """Return the machines in the slots after some ticks."""
    return tuple(
        None
        if child is None
        else replace(
            child,
            timers=tuple(snap.Timer(t.deadline - ticks, t.what) for t in child.timers),
            invoked=invoked_elapsed(child, ticks),
        )
        for child in snapshot.invoked
    )


def with_first(snapshot: snap.Snapshot, place: int) -> snap.Snapshot:
    """Return a machine in which one of the timers within is the next to fire."""
    if place < len(snapshot.timers):
        timers = list(snapshot.timers)
        first = replace(timers.pop(place), deadline=BEFORE_ALL)
        return replace(snapshot, timers=(first, *timers))
    place -= len(snapshot.timers)
    for slot, child in enumerate(snapshot.invoked):
        if child is None:
            continue
        count = _armed(child)
        if place < count:
            invoked = (*snapshot.invoked[:slot], with_first(child, place))
            return replace(snapshot, invoked=(*invoked, *snapshot.invoked[slot + 1 :]))
        place -= count
    raise IndexError(place)


def _armed(snapshot: snap.Snapshot) -> int:
    return len(snapshot.timers) + sum(_armed(c) for c in snapshot.invoked if c is not None)


def active_configuration(snapshot: snap.Snapshot) -> Hashable:
    """Return the observable configuration: the active states, also those of invoked machines."""
    inner = tuple(
        None if child is None else active_configuration(child) for child in snapshot.invoked
    )
    return snapshot.configuration, snapshot.running, inner


def timer_name(chart: Chart, snapshot: snap.Snapshot, place: int) -> Hashable:
    """Return the identity of a timer among those of a machine and of its slots."""
    if place < len(snapshot.timers):
        match snapshot.timers[place].what:
            case snap.Timeout(transition):
                return transition
            case snap.Delayed(occurrence):
                return "sent", occurrence.event
            case _ as never:
                assert_never(never)
    place -= len(snapshot.timers)
    for invocation, child in zip(chart.invocations, snapshot.invoked, strict=True):
        if child is None:
            continue
        if place < _armed(child):
            return invocation.index, timer_name(invocation.chart, child, place)
        place -= _armed(child)
    raise IndexError(place)


def _untimed_order(timer: snap.Timer) -> tuple[int, int, str]:
    """Return the order of timers without deadlines: by transition, then delayed events."""
    match timer.what:
        case snap.Timeout(transition):
            return 0, transition, ""
        case snap.Delayed(occurrence):
            return 1, occurrence.event, repr(timer.what)
        case _:
            assert_never(timer.what)
