"""The candidates for each state and event, in the order in which they are tried.

Appendix D, selectTransitions, as far as it is known when compiling: for each state and event the
candidates, whether a state defers the event instead, and whether several of them can be taken at
once or exclude each other.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from functools import cached_property

from fsmkit.chart.analysis.effects import can_fail, can_stop, has_effect
from fsmkit.chart.chart import Transition
from fsmkit.chart.structure import can_be_together
from fsmkit.document.document import Kind, Trigger
from fsmkit.plan.operations import Variant
from fsmkit.plan.regions import Region, Regions


class Concurrency(Enum):
    """How many transitions one event can take, and whether they interact."""

    NONE = auto()
    SINGLE_REGION = auto()
    """At most one transition; all sources are in one region."""
    INDEPENDENT = auto()
    """Several transitions, each within a region of its own."""
    PREEMPTING = auto()
    """Transitions that may preempt each other."""


@dataclass(frozen=True, slots=True)
class Defer:
    """The state defers the event: the search ends."""


Candidate = Transition | Defer
Candidates = tuple[Candidate, ...]
Groups = list[tuple[list[int], Candidates]]
"""States, and the candidates in each of them."""
DEFER = Defer()
MANY = 60
"""The number of sources in several regions from which on they are not compared in pairs."""


@dataclass(frozen=True)
class Selection:
    """The candidates of a chart.

    ``is_uniform``: all are selected by the general algorithm, as if they may preempt each other.
    """

    plan: Regions
    variants: tuple[tuple[Variant, ...], ...]
    is_uniform: bool = False

    # --- candidates ---------------------------------------------------------------------------

    @cached_property
    def by_event(self) -> dict[int, list[Transition]]:
        """The transitions by event, in document order."""
        found: dict[int, list[Transition]] = {}
        for transition in self.plan.chart.transitions:
            if transition.trigger is Trigger.EVENT:
                for event in transition.events:
                    found.setdefault(event, []).append(transition)
        return found

    @cached_property
    def _own(self) -> dict[int | None, dict[int, list[Candidate]]]:
        """The candidates of each state by event; None for eventless transitions."""
        found: dict[int | None, dict[int, list[Candidate]]] = {}
        for state in self.plan.chart.states:
            for transition in map(self.plan.chart.transitions.__getitem__, state.transitions):
                for cause in _causes(transition):
                    found.setdefault(cause, {}).setdefault(state.index, []).append(transition)
            for event in self.deferred_by(state.index):
                found.setdefault(event, {}).setdefault(state.index, []).append(DEFER)
        return found

    def candidates_of(self, state: int, event: int | None) -> Candidates:
        """Return a state's own candidates for an event, up to the first certain one.

        For None, return its eventless transitions.
        """
        return _open(self._own.get(event, {}).get(state, ()))

    def candidates(self, leaf: int, event: int | None) -> Candidates:
        """Return the candidates of an atomic state and its ancestors, to the first certain one."""
        found: list[Candidate] = []
        own = self._own.get(event, {})
        for state in (*self.plan.chains[leaf], 0):
            if state in own:
                found += _open(own[state])
                if is_sure(found[-1]):
                    break
        return tuple(found)

    def by_state(self, event: int | None) -> Groups:
        """Return the candidates of each state, descendants first: only one path is active."""
        states = sorted(self._own.get(event, ()), key=self._inner_first.__getitem__)
        return [([state], self.candidates_of(state, event)) for state in states]

    def by_leaf(self, event: int | None) -> Groups:
        """Return the candidates of each atomic state and its ancestors, with equal ones joined."""
        groups: Groups = []
        for leaf in self._leaves_below(self._own.get(event, ())):
            tried = self.candidates(leaf, event)
            if groups and groups[-1][1] == tried:
                groups[-1][0].append(leaf)
            else:
                groups.append(([leaf], tried))
        return groups

    @cached_property
    def _leaves(self) -> list[int]:
        return [state.index for state in self.plan.chart.states if state.is_leaf]

    def _leaves_below(self, states: Iterable[int]) -> list[int]:
        """Return the atomic states among some states and their descendants, in document order."""
        found: list[int] = []
        end = 0
        for state in sorted(states):
            last = self.plan.ends[state]
            first = bisect_left(self._leaves, max(state, end))
            end = max(end, last + 1)
            found += self._leaves[first : bisect_left(self._leaves, end)]
        return found

    @cached_property
    def _inner_first(self) -> tuple[int, ...]:
        """The position of each state in an order in which descendants precede their ancestors."""
        ends = self.plan.ends
        order = sorted(range(len(ends)), key=lambda state: (ends[state], -state))
        places = [0] * len(order)
        for place, state in enumerate(order):
            places[state] = place
        return tuple(places)

    def leaf_states(self, region: Region) -> list[int]:
        """Return the states that can be the deepest active ones of a region."""
        kinds = (Kind.ATOMIC, Kind.FINAL, Kind.CHOICE, Kind.PARALLEL)
        return [s for s in region.states if self.plan.chart.states[s].kind in kinds]

    def transitions_of(self, state: int, trigger: Trigger) -> list[Transition]:
        """Return the transitions of a state by priority, without those that others always hide."""
        kept: list[Transition] = []
        closed: set[int | None] = set()
        for transition in map(
            self.plan.chart.transitions.__getitem__, self.plan.chart.states[state].transitions
        ):
            causes = _causes(transition)
            if transition.trigger is not trigger or closed.issuperset(causes):
                continue
            kept.append(transition)
            if transition.guard is None:
                closed.update(causes)
        return kept

    def chain(self, trigger: Trigger) -> Chain:
        """Return the states with candidates, each with its next ancestor that has any."""
        needed = self._needed(trigger)
        first, links = [0] * len(self.plan.parents), []
        for state in self.plan.chart.states[1:]:
            outer = first[self.plan.parents[state.index]]
            first[state.index] = outer
            if state.index in needed:
                links.append((state.index, outer))
                first[state.index] = state.index
        return Chain(tuple(first), tuple(links))

    def _needed(self, trigger: Trigger) -> frozenset[int]:
        """Return the states whose candidates are tried while a state at or below them is active."""
        needed: set[int] = set()
        is_event = trigger is Trigger.EVENT
        for leaf in self._leaves:
            for state in self.plan.chains[leaf]:
                if state in needed:
                    break
                own = [t for t in self.transitions_of(state, trigger) if self.may_preempt(t)]
                if own or (is_event and self.deferred_by(state)):
                    needed.add(state)
                if not is_event and any(t.guard is None for t in own):
                    break  # one of them is taken: the states above are not tried
        return frozenset(needed)

    def can_stop_below(self, state: int, event: int) -> bool:
        """Whether an earlier guard of a descendant can stop the machine."""
        sources = self._stopping.get(event, ())
        first = bisect_left(sources, state + 1)
        return first < len(sources) and sources[first] <= self.plan.ends[state]

    @cached_property
    def _stopping(self) -> dict[int, list[int]]:
        """For each event the sources of transitions whose guards can stop the machine."""
        return {
            event: sorted(t.source for t in found if t.guard is not None and can_stop(t.guard))
            for event, found in self.by_event.items()
        }

    # --- deferral -----------------------------------------------------------------------------

    @cached_property
    def deferred(self) -> frozenset[int]:
        """The events that some state defers, which the selection has to detect."""
        return frozenset(e for state in self.plan.chart.states for e in state.defer)

    def deferred_by(self, state: int) -> tuple[int, ...]:
        """Return the events that a state defers unconditionally when it is reached."""
        shared = self.plan.shared_deferral[state]
        return tuple(e for e in self.plan.chart.states[state].defer if e not in shared)

    def answers_instead(self, event: int) -> list[tuple[int, list[int]]]:
        """Return the states that defer an event which regions below them may handle.

        Each comes with the transitions on it at or below these regions.
        """
        states = [s for s, events in enumerate(self.plan.shared_deferral) if event in events]
        return [
            (
                state,
                [
                    t.index
                    for t in self.by_event.get(event, ())
                    if state <= t.source <= self.plan.ends[state]
                ],
            )
            for state in states
        ]

    # --- concurrency --------------------------------------------------------------------------

    @cached_property
    def eventless(self) -> Concurrency:
        """The concurrency of eventless transitions."""
        found = self._concurrency(
            [t for t in self.plan.chart.transitions if t.trigger is Trigger.EVENTLESS]
        )
        return Concurrency.PREEMPTING if found is Concurrency.INDEPENDENT else found

    @cached_property
    def _by_event(self) -> dict[int, Concurrency]:
        return {
            event: Concurrency.PREEMPTING if event in self.deferred else self._concurrency(found)
            for event, found in self.by_event.items()
        }

    def concurrency(self, event: int) -> Concurrency:
        """Return the concurrency of the transitions on an event."""
        otherwise = Concurrency.PREEMPTING if event in self.deferred else Concurrency.NONE
        return self._by_event.get(event, otherwise)

    def _concurrency(self, transitions: Sequence[Transition]) -> Concurrency:
        if not transitions:
            return Concurrency.NONE
        if self.is_uniform:
            return Concurrency.PREEMPTING
        regions = self.regions(transitions)
        if len(regions) == 1:
            return Concurrency.SINGLE_REGION
        if self.are_nested(regions) or not all(map(self._stays_within, transitions)):
            return Concurrency.PREEMPTING
        return Concurrency.INDEPENDENT

    def regions(self, transitions: Iterable[Transition]) -> list[int]:
        """Return the regions with the sources of transitions."""
        return sorted({self.plan.region_of[t.source] for t in transitions})

    def are_nested(self, regions: Iterable[int]) -> bool:
        """Whether one of some regions is within another."""
        return any(not self._around(region).isdisjoint(regions) for region in regions)

    def _around(self, region: int) -> frozenset[int]:
        """Return the regions that contain a region."""
        chain = (*self.plan.chains[self.plan.regions[region].top], 0)
        return frozenset(self.plan.region_of[a] for a in chain) - {region}

    def _stays_within(self, transition: Transition) -> bool:
        first, *others = self.variants[transition.index]
        domain = first.domain
        region_of = self.plan.region_of
        is_inside = domain is None or region_of[domain] == region_of[transition.source]
        return not others and is_pure(transition) and is_inside

    def may_preempt(self, transition: Transition) -> bool:
        """Whether a transition is among those that may preempt each other."""
        if transition.trigger is Trigger.EVENTLESS:
            return self.eventless is Concurrency.PREEMPTING
        return any(self.concurrency(e) is Concurrency.PREEMPTING for e in transition.events)

    @cached_property
    def preempting(self) -> frozenset[int]:
        """The events whose transitions may preempt each other."""
        found = self._by_event.items()
        return frozenset(event for event, each in found if each is Concurrency.PREEMPTING)

    @cached_property
    def has_straight(self) -> bool:
        """Whether the transitions on some event cannot preempt each other."""
        return len(self.preempting) < len(self._by_event)

    @cached_property
    def is_general(self) -> bool:
        """Whether the general algorithm selects some transitions, as these may preempt others."""
        shapes = (self.eventless, *self._by_event.values())
        is_timed = any(t.trigger is not Trigger.INITIAL for t in self.plan.chart.transitions)
        is_general = Concurrency.PREEMPTING in shapes or bool(self.deferred)
        return is_general or (self.is_uniform and is_timed)

    @cached_property
    def remembered(self) -> tuple[int, ...]:
        """The guards that are memoized, because several atomic states try them."""
        covering: set[int] = set()
        for state in self.plan.chart.states:
            if self.plan.inner[state.index]:
                covering |= {0, *self.plan.chains[state.index]}
        return tuple(
            t.index
            for t in self.plan.chart.transitions
            if t.source in covering and not is_pure(t) and self.may_preempt(t)
        )

    def is_one_answer(self, sources: Sequence[int]) -> bool:
        """Whether no two of some states can take a transition for the same event."""
        if self.plan.is_single:
            return True
        region_of, chart = self.plan.region_of, self.plan.chart
        if len(sources) > MANY and len({region_of[source] for source in sources}) > 1:
            return False
        return all(
            region_of[one] == region_of[other] or not can_be_together(chart, one, other)
            for one in sources
            for other in sources
        ) and all(len(self.variants[t]) == 1 for s in sources for t in chart.states[s].transitions)


@dataclass(frozen=True, slots=True)
class Chain:
    """The states with candidates, from the innermost outward.

    ``first``: for each state the first such state at or above it, 0 for none; ``links``: these
    states in document order, each with the next one above it, 0 for none.
    """

    first: tuple[int, ...]
    links: tuple[tuple[int, int], ...]


def is_sure(candidate: Candidate) -> bool:
    """Whether the search always ends at a candidate: it has no guard, or defers the event."""
    return isinstance(candidate, Defer) or candidate.guard is None


def is_pure(transition: Transition) -> bool:
    """Whether a guard can neither fail nor have a side effect."""
    guard = transition.guard
    return guard is None or not (can_fail(guard) or has_effect(guard))


def _causes(transition: Transition) -> tuple[int | None, ...]:
    """Return the events of a transition; None for an eventless one."""
    if transition.trigger is Trigger.EVENTLESS:
        return (None,)
    return transition.events if transition.trigger is Trigger.EVENT else ()


def _open(candidates: Sequence[Candidate]) -> Candidates:
    """Return candidates up to the first certain one."""
    closing = (place for place, each in enumerate(candidates) if is_sure(each))
    return tuple(candidates[: next(closing, len(candidates)) + 1])
