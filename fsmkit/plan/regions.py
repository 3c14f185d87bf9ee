"""The states of a chart in numbers: regions, and what lies around and inside of each state.

A *region* is a part of the chart in which one path of states is active: the root, and each child
of a parallel state. States have one number, their place in document order (`State.index`), in
the Chart, in generated code and in saved machines; histories have theirs among them. A machine
keeps for each region the number of its deepest active state, 0 while nothing of it is active. So
a state is active exactly if the number of its region lies between its own and that of its last
descendant there, also in the midst of a step, when its children are left already or not entered
yet.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property

from fsmkit.chart.chart import Chart
from fsmkit.chart.structure import forgotten_histories, shared_deferral
from fsmkit.document.document import Kind


@dataclass(frozen=True, slots=True)
class Region:
    """A region: ``states`` in document order, below ``top``, a child of parallel state ``owner``.

    The region of the root contains its descendants. The root is in no region: its number is 0,
    which means that no state is active.
    """

    index: int
    top: int
    owner: int | None
    states: tuple[int, ...]


@dataclass(frozen=True)
class Regions:
    """The regions of a chart, and its states by them."""

    chart: Chart
    regions: tuple[Region, ...]
    region_of: tuple[int, ...]
    """The region of each state; for a history, that of its parent."""
    last_below: tuple[int, ...]
    """For each state the last of its descendants in its own region, or itself."""

    @cached_property
    def is_single(self) -> bool:
        """Whether there is one region only, so one transition is taken at a time."""
        return len(self.regions) == 1

    @cached_property
    def is_flat(self) -> bool:
        """Whether no state contains another."""
        return not any(self.parents)

    @cached_property
    def inner(self) -> tuple[list[Region], ...]:
        """For each parallel state its regions in document order; for other states none."""
        found: tuple[list[Region], ...] = tuple([] for _ in self.chart.states)
        for region in self.regions:
            if region.owner is not None:
                found[region.owner].append(region)
        return found

    # --- around a state -----------------------------------------------------------------------

    @cached_property
    def chains(self) -> tuple[tuple[int, ...], ...]:
        """For each state itself and its ancestors without the root, innermost first."""
        return tuple(
            () if state.index == 0 else (state.index, *self.chart.ancestors(state.index)[:-1])
            for state in self.chart.states
        )

    @cached_property
    def parents(self) -> tuple[int, ...]:
        """The parent of each state; 0 for the root, too."""
        return tuple(state.parent or 0 for state in self.chart.states)

    @cached_property
    def region_parents(self) -> tuple[int, ...]:
        """The parent of each state within its region; 0 for none."""
        of = self.region_of
        return tuple(p if of[p] == of[s] else 0 for s, p in enumerate(self.parents))

    # --- inside of a state --------------------------------------------------------------------

    @cached_property
    def ends(self) -> tuple[int, ...]:
        """For each state its last descendant, or itself."""
        return tuple(state.last_descendant for state in self.chart.states)

    @cached_property
    def substates(self) -> tuple[tuple[int, ...], ...]:
        """The children of each state, without histories (getChildStates)."""
        states = self.chart.states
        return tuple(tuple(c for c in s.children if not states[c].is_history) for s in states)

    @cached_property
    def histories(self) -> tuple[tuple[int, ...], ...]:
        """The histories of each state."""
        states = self.chart.states
        return tuple(tuple(c for c in s.children if states[c].is_history) for s in states)

    @cached_property
    def defaults(self) -> tuple[tuple[int, ...], ...]:
        """For each state its initial transition and its histories' defaults that have content."""
        states, transitions = self.chart.states, self.chart.transitions
        found = []
        for state in states:
            parts = (state, *(states[history] for history in self.histories[state.index]))
            own = (part.initial for part in parts if part.initial is not None)
            found.append(tuple(t for t in own if transitions[t].content))
        return tuple(found)

    @cached_property
    def every_history(self) -> tuple[int, ...]:
        """All histories, in document order."""
        return tuple(state.index for state in self.chart.states if state.is_history)

    def descendants(self, state: int) -> tuple[int, ...]:
        """Return all descendants of a state, without histories."""
        states, last = self.chart.states, self.ends[state]
        return tuple(s for s in range(state + 1, last + 1) if not states[s].is_history)

    def numbers_within(self, region: int, first: int, last: int) -> tuple[int, ...]:
        """Return the states of a region whose numbers lie in a range."""
        return tuple(state for state in self.regions[region].states if first <= state <= last)

    def is_below(self, state: int, ancestor: int) -> bool:
        """Whether a state is a descendant of another."""
        return ancestor < state <= self.ends[ancestor]

    def meeting(self, one: int, other: int) -> int:
        """Return the innermost state that is or contains both states."""
        around = (s for s in self.chains[one] if s <= other <= self.ends[s])
        return next(around, 0)

    def are_orthogonal(self, one: int, other: int) -> bool:
        """Whether two states are in different regions of one parallel state."""
        meeting = self.meeting(one, other)
        return meeting not in (one, other) and self.chart.states[meeting].kind is Kind.PARALLEL

    def are_exclusive(self, one: int, other: int) -> bool:
        """Whether two states of one region exclude each other: neither contains the other."""
        if self.region_of[one] != self.region_of[other]:
            return False
        first, second = sorted((one, other))
        return second > self.last_below[first]

    def last_region(self, state: int) -> int:
        """Return the last region within a state, or the state's own region."""
        return bisect_right(self.regions, self.ends[state], key=lambda region: region.top) - 1

    def finals(self, state: int) -> tuple[tuple[int, ...], ...]:
        """Return for each compound region its final states, one of which must be active.

        See Appendix D, isInFinalState. A region without final states has an empty entry, so the
        condition never holds.
        """
        states = self.chart.states
        if states[state].kind is Kind.PARALLEL:
            return tuple(each for inner in self.substates[state] for each in self.finals(inner))
        return (tuple(s for s in self.substates[state] if states[s].kind is Kind.FINAL),)

    @cached_property
    def endings(self) -> tuple[int, ...]:
        """The final states that end the machine."""
        states = self.chart.states
        return tuple(s for s in self.substates[0] if states[s].kind is Kind.FINAL)

    # --- histories and deferral ---------------------------------------------------------------

    @cached_property
    def recorded_regions(self) -> tuple[tuple[int, ...], ...]:
        """For each history the regions whose numbers it records, its parent's own first."""
        states = self.chart.states
        return tuple(self._recorded(s.index) if s.is_history else () for s in states)

    def _recorded(self, history: int) -> tuple[int, ...]:
        parent = self.parents[history]
        own = (self.region_of[parent],) if self.chart.states[parent].kind is Kind.COMPOUND else ()
        # regions are in document order of their tops: those below the parent stand side by side
        first = bisect_right(self.regions, parent, key=lambda region: region.top)
        inner = range(first, self.last_region(parent) + 1)
        if self.chart.states[history].kind is Kind.DEEP_HISTORY:
            return (*own, *inner)
        return own or tuple(inner[:1])  # all regions of a parallel state are always active

    @cached_property
    def forgotten(self) -> tuple[tuple[int, ...], ...]:
        """For each state its histories that are empty while it is active."""
        return forgotten_histories(self.chart)

    def is_forgotten(self, history: int) -> bool:
        """Whether a history is empty while its parent is active."""
        return history in self.forgotten[self.parents[history]]

    @cached_property
    def shared_deferral(self) -> tuple[frozenset[int], ...]:
        """For each state its deferred events that regions below it may handle."""
        return shared_deferral(self.chart)


def regions_of(chart: Chart) -> Regions:
    """Return the regions of a chart."""
    region_of = [0] * len(chart.states)
    tops: list[tuple[int, int | None]] = [(0, None)]
    members: list[list[int]] = [[]]
    for state in chart.states[1:]:
        parent = state.parent
        assert parent is not None  # noqa: S101
        if chart.states[parent].kind is Kind.PARALLEL and not state.is_history:
            region_of[state.index] = len(tops)
            tops.append((state.index, parent))
            members.append([])
        else:
            region_of[state.index] = region_of[parent]
        if not state.is_history:
            members[region_of[state.index]].append(state.index)
    regions = tuple(
        Region(index, top, owner, tuple(members[index])) for index, (top, owner) in enumerate(tops)
    )
    return Regions(chart, regions, tuple(region_of), _last_below(chart, region_of))


def _last_below(chart: Chart, region_of: list[int]) -> tuple[int, ...]:
    last = list(range(len(chart.states)))
    for state in reversed(chart.states[1:]):
        parent = state.parent
        inside = parent is not None and region_of[parent] == region_of[state.index]
        if parent is not None and inside and not state.is_history:
            last[parent] = max(last[parent], last[state.index])
    return tuple(last)
