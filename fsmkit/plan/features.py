"""The mechanisms that the machine of a chart needs, known before printing."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.chart.analysis.effects import done_event, outcomes, reads_event
from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.content import all_statements, samples_inputs
from fsmkit.chart.statements import CallOperation, Destination, Log, Raise, Reply, Send
from fsmkit.document.document import Kind, Trigger


@dataclass(frozen=True, slots=True)
class Features:
    """The mechanisms of a machine; code for absent ones is omitted."""

    regions: bool
    """Several atomic states can be active at once."""
    timeouts: bool
    periods: bool
    """Periodic transitions (`every`)."""
    timed_guards: bool
    alternatives: bool
    """Several transitions share one timer."""
    delays: frozenset[Destination]
    """The targets of delayed sends."""
    deferral: bool
    eventless: bool
    samples_inputs: bool
    """The guard of an eventless transition reads an input, so it is evaluated in each `run`."""
    raises: bool
    """Events enter the internal queue by `raise`, a `send` to it, or ``done.state``."""
    fails: bool
    """Content or a guard may fail or leave a range: an error event, or a fault."""
    ends: bool
    """A final state of the root can be entered."""
    calls: bool
    """A step calls the host: operations, outgoing events."""
    logs: bool
    replies: bool
    reads_event: bool
    """The current event is read where several events are possible: its name, type or a field."""
    reads_payload: bool
    """A field of the current event is read."""
    error_faults: bool
    """An unhandled error event stops the machine."""
    payload: bool

    @property
    def follows(self) -> bool:
        """Whether an event can have effects in the same step beside its own transitions."""
        return self.eventless or self.raises or self.fails or self.ends


def payload_of(chart: Chart, transition: Transition) -> dict[str, int] | None:
    """Return the positions of the current event's fields, or None if they depend on the event."""
    if transition.trigger is not Trigger.EVENT or not transition.events:
        return None
    places = [
        {part.name: place for place, part in enumerate(chart.events[event].fields)}
        for event in transition.events
    ]
    return places[0] if all(each == places[0] for each in places) else None


def features_of(chart: Chart) -> Features:
    """Return the mechanisms of a machine, without those of the machines in its slots."""
    found = tuple(all_statements(chart))
    evaluated = outcomes((chart.states, chart.transitions, chart.script))
    within = evaluated | outcomes(tuple(event.finalize for event in chart.events))
    sends = [statement for statement in found if isinstance(statement, Send)]
    kinds = {statement.__class__ for statement in found}
    destinations = {send.destination for send in sends}
    triggers = {transition.trigger for transition in chart.transitions}
    return Features(
        regions=any(state.kind is Kind.PARALLEL for state in chart.states),
        timeouts=bool(chart.alternatives),
        periods=Trigger.EVERY in triggers,
        timed_guards=any(t.guard is not None and t.timer is not None for t in chart.transitions),
        alternatives=any(len(waiting) > 1 for waiting in chart.alternatives.values()),
        delays=frozenset(s.destination for s in sends if s.delay is not None),
        deferral=any(state.defer for state in chart.states),
        eventless=Trigger.EVENTLESS in triggers,
        samples_inputs=samples_inputs(chart),
        raises=Destination.INTERNAL in destinations
        or Raise in kinds
        or any(done_event(chart, state) is not None for state in chart.states),
        fails=evaluated.can_stop or within.can_end,
        ends=any(chart.states[child].kind is Kind.FINAL for child in chart.root.children),
        calls=Destination.PORT in destinations or CallOperation in kinds or within.calls,
        logs=Log in kinds,
        replies=Reply in kinds,
        reads_event=within.reads_event_name
        or reads_event((chart.states, chart.script))
        or any(
            reads_event((t.guard, t.content)) and payload_of(chart, t) is None
            for t in chart.transitions
        ),
        reads_payload=within.reads_event,
        error_faults=not chart.lenient
        and any(e.name.startswith("error.") and not e.directions for e in chart.events),
        payload=any(event.fields for event in chart.events),
    )
