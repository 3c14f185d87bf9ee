"""The transitions of the configuration, and the further parts that a chart needs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from fsmkit.chart.analysis.effects import Effects
from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.chart.content import all_statements, reads_input
from fsmkit.chart.statements import Cancel, Send
from fsmkit.codegen.transitions.names import ModelNames, model_names
from fsmkit.codegen.transitions.order import Order
from fsmkit.document.document import Trigger
from fsmkit.plan import lower


@dataclass(frozen=True, slots=True)
class Entry:
    """A transition of the configuration; ``index`` is that in the chart, None for the start.

    ``callback`` runs its content at ``place``; ``recall`` is the history that is entered.
    """

    trigger: str
    source: str
    dest: str | None
    index: int | None
    condition: str | None = None
    callback: str | None = None
    place: str = "before"
    recall: int | None = None


@dataclass(frozen=True)
class Moves:
    """The transitions of one chart, under the names of the library."""

    chart: Chart
    names: ModelNames
    order: Order

    @property
    def initial(self) -> Transition:
        """The initial transition of the chart."""
        assert self.chart.root.initial is not None  # noqa: S101  (a chart is sound)
        return self.chart.transitions[self.chart.root.initial]

    @cached_property
    def has_start(self) -> bool:
        """Whether the start has effects: the library enters initial states without callbacks."""
        entered = self.order.entries(self.initial)
        effects = self.order.entry_effects
        return bool({"always", "timers"} & self.facts or self.chart.script) or (
            bool(self.initial.content)
            or any(any(s.on_entry) or effects[s.index] != Effects() for s in entered)
        )

    @cached_property
    def facts(self) -> frozenset[str]:
        """The parts of `Steps` that the chart needs."""
        found = {t.trigger.value for t in self.chart.transitions}
        eventless = [t for t in self.chart.transitions if t.trigger is Trigger.EVENTLESS]
        needed = {
            "always": bool(eventless),
            "order": not self.order.is_plain,
            "timers": bool({"after", "every"} & found) or self._sends_later,
            "inputs": any(reads_input(t.guard) for t in eventless),
            "history": bool(self.histories),
            "leaves": bool(self.histories) or not self.order.is_plain,
        }
        return frozenset(name for name, is_needed in needed.items() if is_needed)

    @property
    def _sends_later(self) -> bool:
        """Whether content sends a delayed event or cancels one."""
        content = all_statements(self.chart)
        return any(isinstance(s, Cancel) or (isinstance(s, Send) and s.delay) for s in content)

    @property
    def histories(self) -> tuple[State, ...]:
        """The histories that are targets of transitions."""
        wanted = {target for t in self.chart.transitions for target in t.targets}
        return tuple(s for s in self.chart.states if s.is_history and s.index in wanted)

    def entries(self) -> Iterator[Entry]:
        """Yield the transitions in the order of the configuration: by state and priority."""
        if self.has_start:
            callback = "begin" if self.chart.script or self.initial.content else None
            dest = self.names.paths[self.order.dest(self.initial)]
            yield Entry(self.names.start, self.names.initial, dest, None, callback=callback)
        for state in self.chart.states:
            for index in state.transitions:
                transition = self.chart.transitions[index]
                for trigger in self._triggers(transition):
                    yield self._entry(transition, trigger)

    def _triggers(self, transition: Transition) -> Iterator[str]:
        if transition.trigger is Trigger.EVENTLESS:
            yield self.names.always
        elif transition.index in self.names.timed:
            yield self.names.timed[transition.index]
        for event in dict.fromkeys(transition.events):
            if event in self.order.occurring:
                yield self.chart.events[event].name

    def _entry(self, transition: Transition, trigger: str) -> Entry:
        name = self.names.names.transitions[transition.index]
        targets = [self.chart.states[target] for target in transition.targets]
        return Entry(
            trigger,
            self.names.paths[transition.source],
            self.names.paths[self.order.dest(transition)] if targets else None,
            transition.index,
            None if transition.guard is None else f"guard_{name}",
            f"do_{name}" if transition.content else None,
            (self.order.place_of_content(transition) or "before")
            if self.order.is_plain
            else "after",
            next((state.index for state in targets if state.is_history), None),
        )

    def taken(self) -> Iterator[Transition]:
        """Yield the transitions that have a trigger."""
        for transition in self.chart.transitions:
            if any(self._triggers(transition)):
                yield transition


def moves_of(chart: Chart) -> Moves:
    """Return the transitions of a chart."""
    plan = lower(chart)
    return Moves(chart, model_names(plan), Order(plan))
