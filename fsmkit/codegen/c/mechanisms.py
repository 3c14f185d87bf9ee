"""The mechanisms in the C of a machine, decided by its Plan before printing.

The pieces of C that machines share test them (`codegen.c.pieces`: ``#if LOOPS``). A member of the
struct exists only with the mechanism that uses it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.options import Options
from fsmkit.plan import Plan


@dataclass(frozen=True, slots=True)
class Mechanisms:
    """The mechanisms of a machine; code for absent ones is omitted."""

    queued: bool
    """Events wait in a queue: `post`, `step_event`."""
    counted: bool
    """Ignored events, and events that find a queue full, are counted."""
    defers: bool
    delays: bool
    """Events are sent with a delay."""
    deadlines: bool
    """A deadline alone can make the machine step."""
    now: bool
    """The machine stores the time."""
    polls: bool
    """`step_eventless` can take a step without an event."""
    runs: bool
    """The machine has the function `run`."""
    raises: bool
    """Events enter the internal queue."""
    eventless: bool
    loops: bool
    """A macrostep can have several microsteps."""
    stops: bool
    """A fault can stop the machine."""
    ends: bool
    """The machine can finish, or its invoker can end it."""
    settles: bool
    guarded: bool
    """A step calls the host, which may call back: such a call is rejected."""
    begins: bool
    rests: bool
    event: bool
    """The current event is stored during the step."""
    replies: bool
    external: bool
    """An external event has effects before its selection: `autoforward`, `finalize`."""
    running: bool
    """A flag records whether the machine runs; otherwise the number of an active state shows it."""
    checked: bool
    """The reaction of a stopped machine is decided before the event is looked up."""

    @property
    def facts(self) -> dict[str, bool]:
        """Whether the machine has a mechanism, by the name in the conditions of pieces."""
        return {each.name.upper(): getattr(self, each.name) for each in fields(self)}


def mechanisms_of(plan: Plan, options: Options, *, is_family: bool, has_slots: bool) -> Mechanisms:
    """Return the mechanisms of a machine.

    ``is_family``: it invokes or is invoked, which needs most mechanisms. ``has_slots``: it contains
    machines that it invokes, whose deadlines are its own.
    """
    chart, features = plan.chart, plan.features
    without = frozenset() if is_family else options.without
    delays = bool(features.delays)
    deadlines = has_slots or features.timeouts or delays
    queued = "queue" not in without
    polls = features.samples_inputs or queued
    raises = is_family or features.raises or features.fails
    loops = raises or features.eventless
    ends = is_family or features.ends
    guarded = is_family or features.calls or delays
    event = is_family or features.reads_event or features.reads_payload
    running = loops or ends
    return Mechanisms(
        queued=queued,
        counted="counters" not in without,
        defers=features.deferral,
        delays=delays,
        deadlines=deadlines,
        now=is_family or deadlines,
        polls=polls,
        runs=polls or is_family or deadlines,
        raises=raises,
        eventless=features.eventless,
        loops=loops,
        stops=loops,
        ends=ends,
        settles=loops or ends,
        guarded=guarded,
        begins=loops or guarded,
        rests=loops or guarded or event,
        event=event,
        replies=features.replies,
        external=_has_external(chart),
        running=running,
        checked=running or features.deferral or options.is_small or not plan.is_single,
    )


def _has_external(chart: Chart) -> bool:
    return any(i.autoforward for i in chart.invocations) or any(e.finalize for e in chart.events)
