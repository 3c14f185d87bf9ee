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

from fsmkit.chart.analysis.effects import Effects, of_blocks, of_entry, of_guard, union
from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.chart.content import all_statements
from fsmkit.chart.statements import Block, Cancel, Raise, Send
from fsmkit.document.document import Kind, Trigger
from fsmkit.language import InState
from fsmkit.language.statements.tree import statements
from fsmkit.language.walk import subexpressions
from fsmkit.plan import Plan
from fsmkit.plan.exits import possible_below

WAITING = Effects(writes=frozenset({"\0"}))
"""The effect of starting a timer: of two timers with equal deadlines the older fires first."""


def delayed(block: Block) -> bool:
    """Whether content sends a delayed event or cancels one, so the host can observe the time."""
    found = statements(block)
    return any(isinstance(s, Cancel) or (isinstance(s, Send) and s.delay) for s in found)


@dataclass(frozen=True)
class Order:
    """Determines where a chart's steps and the library's steps have the same order."""

    plan: Plan

    @property
    def chart(self) -> Chart:
        """The chart."""
        return self.plan.chart

    def domain(self, transition: Transition) -> int | None:
        """Return the state below which all exits and entries lie (getTransitionDomain)."""
        return self.plan.variants[transition.index][-1].domain

    def path(self, above: int, below: int) -> tuple[int, ...]:
        """Return the states from strictly below one down to another."""
        chain = (*self.plan.chains[below], 0)
        return tuple(reversed(chain[: chain.index(above)]))

    # --- exits and entries ------------------------------------------------------------------

    def dest(self, transition: Transition) -> int:
        """Return the state that is the destination of a transition in the library.

        For a history, it is the parent, whose ``initial`` is replaced for one entry. For an initial
        state that is no child, it is that state; the library also enters those between.
        """
        (target,) = transition.targets
        if self.chart.states[target].is_history:
            return self.plan.parents[target]
        deepest = state = target
        while (initial := self._initial(state)) is not None:
            (inner,) = initial.targets
            if self.plan.parents[inner] != state:
                deepest = inner
            state = inner
        return deepest

    def _initial(self, index: int) -> Transition | None:
        """Return the initial transition of a compound state."""
        state = self.chart.states[index]
        is_one = state.kind is Kind.COMPOUND and state.initial is not None
        return self.chart.transitions[state.initial or 0] if is_one else None

    def exits(self, transition: Transition) -> tuple[State, ...]:
        """Return every state that a transition may leave, in document order."""
        if not transition.targets or transition.trigger is Trigger.INITIAL:
            return ()
        left = possible_below(self.plan, self.plan.reactions[transition.index][-1])
        return tuple(self.chart.states[state] for state in left)

    def entries(self, transition: Transition) -> tuple[State, ...]:
        """Return the states that a transition enters, in the order of the library."""
        domain = self.domain(transition)
        if domain is None:
            return ()
        target = self.dest(transition)
        found = [*self.path(domain, target)]
        if self.chart.states[transition.targets[0]].is_history:  # any of them
            found += sorted(self.plan.descendants(target), key=self._depth)
            return tuple(self.chart.states[index] for index in found)
        level = [target]
        while level:
            level = [child for state in level for child in self.defaults(state)]
            found += level
        return tuple(self.chart.states[index] for index in found)

    def defaults(self, index: int) -> tuple[int, ...]:
        """Return the default children of a state, which are entered without a specific target."""
        state = self.chart.states[index]
        if state.kind is Kind.PARALLEL:
            return self.plan.substates[index]
        initial = self._initial(index)
        return () if initial is None else self.path(index, initial.targets[0])[:1]

    def timers(self, index: int) -> tuple[Transition, ...]:
        """Return the timed transitions of a state, in document order."""
        own = (self.chart.transitions[each] for each in self.chart.states[index].transitions)
        return tuple(t for t in own if t.has_timer)

    @cached_property
    def occurring(self) -> frozenset[int]:
        """The events that can occur; error events only if content raises them."""
        raised = {s.event for s in all_statements(self.chart) if isinstance(s, Raise | Send)}
        return frozenset(
            event.index
            for event in self.chart.events
            if event.directions or event.name.startswith("done.state.") or event.index in raised
        )

    @cached_property
    def is_plain(self) -> bool:
        """Whether the order of the library and that of Appendix D are indistinguishable."""
        moving = [t for t in self.chart.transitions if t.trigger is not Trigger.INITIAL]
        initial = self.chart.transitions[self.chart.root.initial or 0]
        return (
            all(map(self.place_of_content, moving))
            and not any(map(self.confused_exits, moving))
            and not any(map(self.confused_entries, (*moving, initial)))
            and all(self._is_same(*pair) for pair in pairs(self.chart, self.occurring))
        )

    def _is_same(self, one: Transition, two: Transition) -> bool:
        """Whether the library has the same effect if one event enables both transitions."""
        if self.plan.are_orthogonal(one.source, two.source):
            guards = [t for t in (one, two) if of_guard(t).is_visible]
            return (
                self.is_within_region(one, two.source)
                and self.is_within_region(two, one.source)
                and len(guards) < 2
                and not any(map(self.tests_states, (one, two)))
                and self.do_commute(one, two)
            )
        if not self.plan.is_below(two.source, one.source):
            return True
        is_one_taken = bool(one.targets and two.targets) and not of_guard(one).is_visible
        return is_one_taken or not self.is_parallel_between(one.source, two.source)

    def tests_states(self, transition: Transition) -> bool:
        """Whether a guard tests which states are active."""
        guard = transition.guard
        return guard is not None and any(isinstance(p, InState) for p in subexpressions(guard))

    # --- effects ----------------------------------------------------------------------------

    @cached_property
    def exit_effects(self) -> tuple[Effects, ...]:
        """The effects of exiting each state."""
        return tuple(self.of_content(*state.on_exit) for state in self.chart.states)

    @cached_property
    def entry_effects(self) -> tuple[Effects, ...]:
        """The effects of entering each state."""
        return tuple(
            of_entry(self.chart, state)
            | self.of_content(*state.on_entry)
            | (WAITING if self.timers(state.index) or self.clears(state) else Effects())
            for state in self.chart.states
        )

    def of_content(self, *blocks: Block) -> Effects:
        """Return the effects of content, including effects on the order of timers."""
        found = of_blocks(blocks)
        is_told = any(map(delayed, blocks))
        return found | WAITING | Effects(is_visible=True) if is_told else found

    def clears(self, state: State) -> bool:
        """Whether entering a state ends the machine while delayed events may be pending."""
        is_end = state.index in self.plan.endings
        return is_end and any(isinstance(s, Send) and s.delay for s in all_statements(self.chart))

    def place_of_content(self, transition: Transition) -> str | None:
        """Return the callback that can hold content, ``before`` or ``after``; None for neither.

        In a chart, content runs between exits and entries.
        """
        content = self.of_content(transition.content)
        exits = union(self.exit_effects[s.index] for s in self.exits(transition))
        if content.commutes(exits):
            return "before"
        entries = union(self.entry_effects[s.index] for s in self.entries(transition))
        return "after" if content.commutes(entries) else None

    def confused_exits(self, transition: Transition) -> bool:
        """Whether the library would exit two states in a distinguishably different order."""
        for early, late in combinations(self.exits(transition), 2):
            is_first = self._depth(early.index) >= self._depth(late.index)
            if is_first and self.plan.are_orthogonal(early.index, late.index):
                both = self.exit_effects[early.index], self.exit_effects[late.index]
                if not both[0].commutes(both[1]):
                    return True
        return False

    def confused_entries(self, transition: Transition) -> bool:
        """Whether the library would enter two states in a distinguishably different order."""
        for first, second in combinations(self.entries(transition), 2):
            if first.index > second.index:
                both = self.entry_effects[first.index], self.entry_effects[second.index]
                if not both[0].commutes(both[1]):
                    return True
        return False

    # --- several transitions on one event ---------------------------------------------------

    def is_within_region(self, transition: Transition, other: int) -> bool:
        """Whether a transition exits only states of its own region, beside another state."""
        domain = self.domain(transition)
        parallel = self.plan.meeting(transition.source, other)
        return domain is None or self.plan.is_below(domain, parallel)

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
        return -self._depth(transition.source), transition.source

    def _depth(self, state: int) -> int:
        return len(self.plan.chains[state])

    def _parts(self, transition: Transition) -> tuple[Effects, Effects, Effects]:
        return (
            union(self.exit_effects[s.index] for s in self.exits(transition)),
            self.of_content(transition.content),
            union(self.entry_effects[s.index] for s in self.entries(transition)),
        )

    def is_parallel_between(self, ancestor: int, descendant: int) -> bool:
        """Whether a state is parallel, or contains a parallel ancestor of another."""
        kinds = self.chart.states
        between = (ancestor, *self.path(ancestor, descendant)[:-1])
        return any(kinds[state].kind is Kind.PARALLEL for state in between)


def pairs(chart: Chart, occurring: frozenset[int]) -> Iterator[tuple[Transition, Transition]]:
    """Yield transitions of different states, in document order, that one event may enable.

    Or that need none.
    """
    taken = [t for t in chart.transitions if t.trigger in (Trigger.EVENT, Trigger.EVENTLESS)]
    for one, two in combinations(sorted(taken, key=lambda t: (t.source, t.index)), 2):
        if one.source == two.source or one.trigger is not two.trigger:
            continue
        if one.trigger is Trigger.EVENTLESS or set(one.events) & set(two.events) & occurring:
            yield one, two
