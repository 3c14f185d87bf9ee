"""How the transitions on an event can be taken, known from where they begin and what they leave."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from enum import Enum, auto

from fsmkit.chart.analysis.effects import can_fail, has_effect
from fsmkit.chart.chart import Transition
from fsmkit.document.document import Trigger
from fsmkit.plan import Plan


class Shape(Enum):
    """How the transitions of an event can be taken."""

    NONE = auto()
    ONE = auto()
    """At most one, all begin in one region."""
    APART = auto()
    """Several at once, each within a region of its own."""
    ANY = auto()
    """They may preempt each other."""


class Shapes:
    """The shapes of a chart."""

    def __init__(self, plan: Plan, *, is_small: bool = False) -> None:
        """Find how each event is answered, and how eventless transitions are taken.

        ``is_small``: all are selected in the same way, whatever is known of them.
        """
        self._is_small = is_small
        self.chart = plan.chart
        self.plan = plan
        self._known: dict[int, Shape] = {}
        self.deferred = frozenset(e for state in self.chart.states for e in state.defer)
        """Events that some state defers: that is found out together with what they enable."""
        self.by_event = self._sorted(Trigger.EVENT)
        """The transitions by event, in document order."""
        eventless = [t for t in self.chart.transitions if t.trigger is Trigger.EVENTLESS]
        shape = self._shape(eventless)
        self.eventless = Shape.ANY if shape is Shape.APART else shape

    def _sorted(self, trigger: Trigger) -> dict[int, list[Transition]]:
        """Return the transitions by event, in document order."""
        found: dict[int, list[Transition]] = {}
        for transition in self.chart.transitions:
            if transition.trigger is trigger:
                for event in transition.events:
                    found.setdefault(event, []).append(transition)
        return found

    def _shape(self, transitions: Sequence[Transition]) -> Shape:
        if not transitions:
            return Shape.NONE
        if self._is_small:
            return Shape.ANY
        regions = self.regions(transitions)
        if len(regions) == 1:
            return Shape.ONE
        if any(not self._above(region).isdisjoint(regions) for region in regions):
            return Shape.ANY
        return Shape.APART if all(map(self._stays_within, transitions)) else Shape.ANY

    def shape(self, event: int) -> Shape:
        """Return how an event is answered."""
        if event in self.deferred:
            return Shape.ANY
        if event not in self._known:
            self._known[event] = self._shape(self.by_event.get(event, ()))
        return self._known[event]

    @property
    def has_straight(self) -> bool:
        """Whether there is straight code for any event."""
        return any(self.shape(event) is not Shape.ANY for event in self.by_event)

    def regions(self, transitions: Iterable[Transition]) -> list[int]:
        """Return the regions in which transitions begin."""
        return sorted({self.plan.region_of[t.source] for t in transitions})

    def _above(self, region: int) -> frozenset[int]:
        """Return the regions in which a region lies."""
        top = self.plan.regions[region].top
        return frozenset(self.plan.region_of[a] for a in self.chart.ancestors(top)) - {region}

    def _stays_within(self, transition: Transition) -> bool:
        move = self.plan.moves[transition.index]
        domain = move.variants[0].domain
        own = self.plan.region_of[transition.source]
        guard = transition.guard
        is_pure = guard is None or not (can_fail(guard) or has_effect(guard))
        return move.is_static and is_pure and (domain is None or self.plan.region_of[domain] == own)

    def may_preempt(self, transition: Transition) -> bool:
        """Whether a transition is among those that may preempt each other."""
        if transition.trigger is Trigger.EVENTLESS:
            return self.eventless is Shape.ANY
        return any(self.shape(event) is Shape.ANY for event in transition.events)

    @property
    def is_general(self) -> bool:
        """Whether something is left for `selection`."""
        shapes = [self.eventless, *map(self.shape, self.by_event)]
        is_timed = any(t.trigger is not Trigger.INITIAL for t in self.chart.transitions)
        is_general = Shape.ANY in shapes or bool(self.deferred)
        return is_general or (self._is_small and is_timed)
