"""Which mechanisms the C of a machine holds: decided by its Plan before a line is printed.

The pieces of C that all machines share ask for them (`codegen.c.pieces`: ``#if LOOPS``), and a
member of the struct is there with the mechanism that uses it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.options import Options
from fsmkit.plan import Plan


@dataclass(frozen=True, slots=True)
class Mechanisms:
    """What the machine does at all: what it does not, it need not be ready for."""

    queued: bool
    """Events wait in a queue: `post`, `step_event`."""
    counted: bool
    """Events that nothing answers or that find a queue full are counted."""
    defers: bool
    delays: bool
    """Events are sent later."""
    deadlines: bool
    """Time alone can make the machine step."""
    now: bool
    """The machine knows the time."""
    polls: bool
    """`step_eventless` can do something that no event began."""
    runs: bool
    """There is `run`."""
    raises: bool
    """Events enter the internal queue."""
    eventless: bool
    loops: bool
    """A macrostep can have several microsteps."""
    stops: bool
    """A fault can stop the machine."""
    ends: bool
    """It comes to its end, or what invoked it ends it."""
    settles: bool
    guarded: bool
    """A step calls the host, which may call back: such a call is refused."""
    begins: bool
    rests: bool
    event: bool
    """The event at hand is kept for the step."""
    replies: bool
    external: bool
    """Something happens with an external event before it is answered: `autoforward`, `finalize`."""
    running: bool
    """A flag says whether the machine runs; the number of an active state says it elsewhere."""
    checked: bool
    """What a stopped machine does with an event is decided before it is looked for."""

    @property
    def facts(self) -> dict[str, bool]:
        """By the name that a condition of a piece has for it: whether there is a mechanism."""
        return {each.name.upper(): getattr(self, each.name) for each in fields(self)}


def mechanisms_of(plan: Plan, options: Options, *, is_family: bool, has_slots: bool) -> Mechanisms:
    """Return the mechanisms of a machine; one that invokes or is invoked (a family) has the most.

    ``has_slots``: machines that it invokes lie in it, and their deadlines are its own.
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
