"""Lookup tables for the procedures of the interpreter, computed once per Chart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.chart.content import samples_inputs
from fsmkit.chart.structure import (
    domain_of,
    forgotten_histories,
    has_history_target,
    shared_deferral,
)
from fsmkit.document.document import Trigger
from fsmkit.language import default_value
from fsmkit.runtime.interpreter.snapshot import Snapshot

MEMO = "_interpreter_index"


@dataclass(slots=True)
class EntrySet:
    """The result of computeEntrySet."""

    to_enter: set[int] = field(default_factory=set)
    for_default_entry: set[int] = field(default_factory=set)
    default_history_content: dict[int, Transition] = field(default_factory=dict)
    """By the parent of the history."""

    def reaches_below(self, chart: Chart, state: int) -> bool:
        """Whether a state strictly below is to be entered."""
        last = chart.states[state].last_descendant
        if last - state < len(self.to_enter):
            return any(other in self.to_enter for other in range(state + 1, last + 1))
        return any(state < other <= last for other in self.to_enter)


class Index:
    """Tables by state, transition and event index; nothing here depends on a snapshot."""

    def __init__(self, chart: Chart) -> None:
        """Compute the tables of a chart."""
        states = chart.states
        values = [*chart.data, *chart.outputs]
        self.chain = tuple((state.index, *chart.ancestors(state.index)) for state in states)
        """Each state and its proper ancestors, innermost first."""
        self.by_event = tuple(_by_event(chart, state) for state in states)
        """For each state the transitions that match an event, in priority order."""
        self.eventless = tuple(_of(chart, state, Trigger.EVENTLESS) for state in states)
        self.timed = tuple(_timed(chart, state) for state in states)
        """For each state the transitions whose timers entering it arms."""
        self.defers = tuple(frozenset(state.defer) for state in states)
        self.shared_deferral = shared_deferral(chart)
        """The deferred events for which regions below a state may have transitions."""
        self.invocations = _invocations(chart)
        """For each state the invocations that leaving it cancels."""
        self.children = tuple(_children(chart, state, histories=False) for state in states)
        """getChildStates: without histories."""
        self.histories = tuple(_children(chart, state, histories=True) for state in states)
        self.has_history = any(self.histories)
        self.forgotten = forgotten_histories(chart)
        """For each state the histories that entering it clears."""
        self.leaves = frozenset(state.index for state in states if state.is_leaf)
        self.has_history_target = tuple(has_history_target(chart, t) for t in chart.transitions)
        self.domains = tuple(
            None if dynamic else domain_of(chart, transition)
            for transition, dynamic in zip(chart.transitions, self.has_history_target, strict=True)
        )
        """The domain of each transition without a history among its targets; else None."""
        self.slots = {variable.name: place for place, variable in enumerate(values)}
        """Index of a variable in ``Snapshot.data``, or ``-1 - index`` in ``inputs``."""
        self.slots |= {variable.name: -1 - place for place, variable in enumerate(chart.inputs)}
        self.field_slots = tuple(
            {part.name: place for place, part in enumerate(event.fields)} for event in chart.events
        )
        self.blank = tuple(
            tuple(default_value(part.type) for part in event.fields) for event in chart.events
        )
        """The payload of each event that is raised without one."""
        self.samples_inputs = samples_inputs(chart)
        """Whether the guard of an eventless transition reads an input."""
        self.initial = Snapshot(
            frozenset(),
            tuple(variable.init.value for variable in values),
            tuple(variable.init.value for variable in chart.inputs),
            invoked=(None,) * len(chart.invocations),
        )
        self.entry_sets: dict[tuple[int, ...], EntrySet] = {}
        """Known results of computeEntrySet, by transitions."""


def index_of(chart: Chart) -> Index:
    """Return the tables of a chart; they live as long as it does, like a cached property."""
    found = chart.__dict__.get(MEMO)
    if found is None:
        found = chart.__dict__[MEMO] = Index(chart)
    assert isinstance(found, Index)  # noqa: S101  (narrows what the dictionary holds)
    return found


def _invocations(chart: Chart) -> tuple[tuple[int, ...], ...]:
    found: list[tuple[int, ...]] = [()] * len(chart.states)
    for invocation in chart.invocations:
        found[invocation.state] = (*found[invocation.state], invocation.index)
    return tuple(found)


def _of(chart: Chart, state: State, *triggers: Trigger) -> tuple[Transition, ...]:
    found = (chart.transitions[index] for index in state.transitions)
    return tuple(transition for transition in found if transition.trigger in triggers)


def _timed(chart: Chart, state: State) -> tuple[Transition, ...]:
    found = (chart.transitions[index] for index in state.transitions)
    return tuple(transition for transition in found if transition.has_timer)


def _by_event(chart: Chart, state: State) -> Mapping[int, tuple[Transition, ...]]:
    found: dict[int, tuple[Transition, ...]] = {}
    for transition in _of(chart, state, Trigger.EVENT):
        for event in transition.events:
            found[event] = (*found.get(event, ()), transition)
    return found


def _children(chart: Chart, state: State, *, histories: bool) -> tuple[int, ...]:
    return tuple(child for child in state.children if chart.states[child].is_history is histories)
