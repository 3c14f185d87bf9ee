"""The order in which the library does things, beside that of SCXML's Appendix D.

The library (0.9, `extensions/nesting.py`) tries the active states of an event from the deepest
level up, each level in document order, and takes every transition that it finds at once:
``before``, exits, entries, ``after``. It leaves what is active below the deepest active ancestor
of the destination, deepest first, and enters defaults level by level.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

from fsmkit.analysis.effects import Effects, of_blocks, of_entry, of_guard, union
from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.chart.structure import are_orthogonal, can_be_together, is_internal, lcca, meeting
from fsmkit.document.document import Kind, Trigger


@dataclass(frozen=True)
class Order:
    """Where a chart's steps and the library's have the same order."""

    chart: Chart

    # --- the tree ---------------------------------------------------------------------------

    def domain(self, transition: Transition) -> int | None:
        """Return the state below which all exits and entries lie (getTransitionDomain)."""
        if not transition.targets:
            return None
        if transition.trigger is Trigger.INITIAL or is_internal(self.chart, transition):
            return transition.source
        return lcca(self.chart, (transition.source, *transition.targets))

    def path(self, above: int, below: int) -> tuple[int, ...]:
        """Return the states from strictly below one down to another."""
        chain = (below, *self.chart.ancestors(below))
        return tuple(reversed(chain[: chain.index(above)]))

    # --- exits and entries ------------------------------------------------------------------

    def exits(self, transition: Transition) -> tuple[State, ...]:
        """Return every state that a transition may leave, in document order."""
        domain = self.domain(transition)
        if domain is None or transition.trigger is Trigger.INITIAL:
            return ()
        below = self.chart.states[domain + 1 : self.chart.states[domain].last_descendant + 1]
        return tuple(s for s in below if can_be_together(self.chart, s.index, transition.source))

    def entries(self, transition: Transition) -> tuple[State, ...]:
        """Return the states that a transition enters, in the order of the library."""
        domain = self.domain(transition)
        if domain is None:
            return ()
        (target,) = transition.targets
        found = [*self.path(domain, target)]
        level = [target]
        while level:
            level = [child for state in level for child in self.defaults(state)]
            found += level
        return tuple(self.chart.states[index] for index in found)

    def defaults(self, index: int) -> tuple[int, ...]:
        """Return the children that are entered with a state unless a target says otherwise."""
        state = self.chart.states[index]
        if state.kind is Kind.PARALLEL:
            return state.children
        return () if state.initial is None else self.chart.transitions[state.initial].targets

    # --- effects ----------------------------------------------------------------------------

    @cached_property
    def exit_effects(self) -> tuple[Effects, ...]:
        """What leaving each state does."""
        return tuple(of_blocks(state.on_exit) for state in self.chart.states)

    @cached_property
    def entry_effects(self) -> tuple[Effects, ...]:
        """What entering each state does."""
        return tuple(of_entry(self.chart, state) for state in self.chart.states)

    def place_of_content(self, transition: Transition) -> str | None:
        """Return the callback that content can be, ``before`` or ``after``; None for neither.

        In a chart content stands between exits and entries.
        """
        content = of_blocks((transition.content,))
        exits = union(self.exit_effects[s.index] for s in self.exits(transition))
        if content.commutes(exits):
            return "before"
        entries = union(self.entry_effects[s.index] for s in self.entries(transition))
        return "after" if content.commutes(entries) else None

    def confused_exits(self, transition: Transition) -> tuple[State, State] | None:
        """Return two states that the library would leave in the other order."""
        for early, late in combinations(self.exits(transition), 2):
            if early.depth >= late.depth and are_orthogonal(self.chart, early.index, late.index):
                both = self.exit_effects[early.index], self.exit_effects[late.index]
                if not both[0].commutes(both[1]):
                    return early, late
        return None

    def confused_entries(self, transition: Transition) -> tuple[State, State] | None:
        """Return two states that the library would enter in the other order."""
        for first, second in combinations(self.entries(transition), 2):
            if first.index > second.index:
                both = self.entry_effects[first.index], self.entry_effects[second.index]
                if not both[0].commutes(both[1]):
                    return second, first
        return None

    # --- several transitions on one event ---------------------------------------------------

    def is_within_region(self, transition: Transition, other: int) -> bool:
        """Whether a transition leaves nothing outside of its region, beside another state."""
        domain = self.domain(transition)
        parallel = meeting(self.chart, transition.source, other)
        return domain is None or self.chart.is_descendant(domain, parallel)

    def do_commute(self, one: Transition, two: Transition) -> bool:
        """Whether both can be taken one after the other, as the library does, on one event.

        Appendix D evaluates both guards, then does all exits, all content, all entries.
        """
        first, second = sorted((one, two), key=self._turn)
        a, b = self._parts(first), self._parts(second)
        if not of_guard(second).commutes(union(a)):
            return False
        # the parts of the first that Appendix D would do after those of the second
        late_content = first.index > second.index
        is_left_late = first.source < second.source
        return all(
            mine.commutes(its)
            for i, mine in enumerate(a)
            for j, its in enumerate(b)
            if i > j
            or (i == j == 0 and is_left_late)
            or (i == j == 1 and late_content)
            or (i == j == 2 and first.source > second.source)
        )

    def _turn(self, transition: Transition) -> tuple[int, int]:
        return -self.chart.states[transition.source].depth, transition.source

    def _parts(self, transition: Transition) -> tuple[Effects, Effects, Effects]:
        return (
            union(self.exit_effects[s.index] for s in self.exits(transition)),
            of_blocks((transition.content,)),
            union(self.entry_effects[s.index] for s in self.entries(transition)),
        )

    def is_parallel_between(self, ancestor: int, descendant: int) -> bool:
        """Whether a state is, or holds on the way to another, a parallel state."""
        kinds = self.chart.states
        between = (ancestor, *self.path(ancestor, descendant)[:-1])
        return any(kinds[state].kind is Kind.PARALLEL for state in between)


def pairs(chart: Chart, occurring: frozenset[int]) -> Iterator[tuple[Transition, Transition, int]]:
    """Yield transitions of different states, in document order, and an event that both take."""
    taken = [t for t in chart.transitions if t.trigger is Trigger.EVENT]
    for one, two in combinations(sorted(taken, key=lambda t: (t.source, t.index)), 2):
        shared = set(one.events) & set(two.events) & occurring
        if shared and one.source != two.source:
            yield one, two, min(shared)
