"""Live-variable analysis over the atomic states of a chart.

A variable is *live* in a configuration if on some way from there it is read before it is surely
written; else it is *dead*, and two states that differ in it only have the same future (Bozga,
Fernandez, Ghirvu: State space reduction based on live variables analysis, SAS 1999).

The analysis is static and errs to the side of live:

* It ignores when guards hold: any transition whose source is active may be taken.
* A variable is live in a configuration if it is live in one of the atomic states. Other regions
  never make a variable dead.
* Only a write of the whole variable ends its life, if nothing before it in its block can fail.
* A history can enter every state below its parent.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from fsmkit.chart.analysis.accesses import NONE, Accesses, Names, accesses
from fsmkit.chart.analysis.reachability import entered
from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.chart.content import all_statements, variables
from fsmkit.chart.statements import Block, Destination, Raise, Send
from fsmkit.chart.structure import domain_of, has_history_target
from fsmkit.document.document import Direction, Kind, Trigger


@dataclass(frozen=True, slots=True)
class _TransitionAccesses:
    """The accesses of one transition; ``entered``: atomic states with the variables written."""

    sources: tuple[tuple[int, Names], ...]
    """Atomic states that it can leave, with the variables that leaving each surely writes."""
    reads: Names
    written: Names
    """Variables that its content surely writes."""
    entered: tuple[tuple[int, Names], ...]


def live_variables(
    chart: Chart, names: Names, observed: frozenset[int] = frozenset()
) -> Mapping[str, frozenset[int]]:
    """Return for each variable of ``names`` the atomic states in which it may be live.

    ``observed`` are transitions for which a caller checks whether their macrosteps change anything.
    If such a macrostep may return to its configuration, the variables that it writes count as read.
    """
    tree = _Tree(chart, names)
    live = {leaf: set(reads) for leaf, reads in tree.reads_while_active().items()}
    steps = [tree.accesses_of(transition) for transition in tree.taken]
    for step in steps:
        for leaf, _ in step.sources:
            live[leaf] |= step.reads
    for leaf, written in tree.written_in_place(observed):
        live[leaf] |= written
    _propagate(live, steps)
    return {
        name: frozenset(leaf for leaf, found in live.items() if name in found) for name in names
    }


def _propagate(live: dict[int, set[str]], steps: list[_TransitionAccesses]) -> None:
    """Propagate live variables backwards from targets to sources, up to a fixed point."""
    changed = True
    while changed:
        changed = False
        for step in steps:
            ahead: set[str] = set()
            for leaf, written in step.entered:
                ahead |= live[leaf] - written
            ahead -= step.written
            for leaf, written in step.sources:
                more = ahead - written - live[leaf]
                if more:
                    live[leaf] |= more
                    changed = True


class _Tree:
    """The reads and writes of exits, transition content and entries."""

    def __init__(self, chart: Chart, names: Names) -> None:
        self.chart, self.names = chart, names
        self.leaves = [state.index for state in chart.states if state.is_leaf]
        self.exits = [self._blocks(state.on_exit) for state in chart.states]
        self.entries = [self._blocks(state.on_entry) for state in chart.states]
        self.contents = [self._content(transition) for transition in chart.transitions]
        self.taken = [t for t in chart.transitions if t.trigger is not Trigger.INITIAL]
        """All but initial and default transitions, which are part of entering."""

    def _blocks(self, blocks: Iterable[Block]) -> Accesses:
        """Return the accesses of consecutive handlers; an error in one does not skip the next."""
        found = Accesses()
        for block in blocks:
            found = found.then(accesses(block))
        return found.restricted_to(self.names)

    def _content(self, transition: Transition) -> Accesses:
        """Return the accesses of content; reading fields that all its events have cannot fail."""
        fields: Names = NONE
        if transition.trigger is Trigger.EVENT and transition.events:
            each = [{f.name for f in self.chart.events[e].fields} for e in transition.events]
            fields = frozenset(set.intersection(*each))
        return accesses(transition.content, fields).restricted_to(self.names)

    def below(self, state: int) -> list[int]:
        """Return the atomic states at or below a state."""
        last = self.chart.states[state].last_descendant
        return self.leaves[bisect_left(self.leaves, state) : bisect_right(self.leaves, last)]

    def _path(self, leaf: int, domain: int | None) -> Iterator[int]:
        """Yield a state and its ancestors below a domain; nothing if the domain is unknown."""
        for state in (leaf, *self.chart.ancestors(leaf)):
            if domain is None or not self.chart.is_descendant(state, domain):
                return
            yield state

    # --- what is read ----------------------------------------------------------------------------

    def reads_while_active(self) -> Mapping[int, Names]:
        """Return by atomic state the variables that can be read while it is active or left."""
        found: dict[int, Names] = dict.fromkeys(self.leaves, NONE)
        for state in self.chart.states:
            reads = self.exits[state.index].reads
            reads |= variables((state.invokes, state.done_data)) & self.names
            for leaf in self.below(state.index) if reads else ():
                found[leaf] |= reads
        return found

    def accesses_of(self, transition: Transition) -> _TransitionAccesses:
        """Return the accesses of a transition."""
        content = self.contents[transition.index]
        entered = self.entered(transition)
        ahead: Names = NONE
        for state in entered:
            ahead |= self._entering(self.chart.states[state]).reads
        domain = self._domain(transition)
        return _TransitionAccesses(
            tuple((s, self._certain(self.exits, s, domain)) for s in self.below(transition.source)),
            (variables(transition.guard) & self.names) | content.reads | (ahead - content.certain),
            content.certain,
            tuple(
                (s, self._certain(self.entries, s, domain))
                for s in sorted(entered)
                if self.chart.states[s].is_leaf
            ),
        )

    def _certain(self, by_state: list[Accesses], leaf: int, domain: int | None) -> Names:
        found: Names = NONE
        for state in self._path(leaf, domain):
            found |= by_state[state].certain
        return found

    def _entering(self, state: State) -> Accesses:
        """Return the accesses of entering a state, including its default or initial transition."""
        found = self.entries[state.index]
        if state.initial is not None:
            found = found.then(self.contents[state.initial])
        return found.then(Accesses(variables(state.done_data) & self.names))

    # --- what is entered -------------------------------------------------------------------------

    def _domain(self, transition: Transition) -> int | None:
        """Return the domain of a transition, or None if it depends on a history."""
        if has_history_target(self.chart, transition):
            return None
        return domain_of(self.chart, transition)

    def entered(self, transition: Transition) -> frozenset[int]:
        """Return the states that a transition can enter, and the histories on the path."""
        wanted = frozenset(transition.targets)
        domain = self._domain(transition)
        while True:
            found = entered(self.chart, wanted, domain)
            more = wanted.union(*(self._beside(state) for state in found))
            if more == wanted:
                return found
            wanted = more

    def _beside(self, number: int) -> range:
        """Return the states that a history can enter; an empty range for other states."""
        state = self.chart.states[number]
        parent = self.chart.states[state.parent or 0]
        return range(parent.index + 1, parent.last_descendant + 1) if state.is_history else range(0)

    # --- what is seen of a step that changes nothing else ----------------------------------------

    def written_in_place(self, observed: frozenset[int]) -> Iterator[tuple[int, Names]]:
        """Yield atomic states, with the variables that a macrostep back to them can write."""
        raised = self._raised() if observed else frozenset()
        follow = {t.index for t in self.taken if self._follows(t, raised)}
        late = {t.index for t in self.taken if self._starts_macrostep(t)}
        for number in sorted(observed | late) if observed else ():
            transition = self.chart.transitions[number]
            sources = self.below(transition.source)
            reached, written = self._macrostep(transition, set(follow))
            if not transition.targets or not reached.isdisjoint(sources):
                yield from ((leaf, written) for leaf in sources)

    def _starts_macrostep(self, transition: Transition) -> bool:
        """Whether a macrostep can start with an eventless transition: none ends in a choice."""
        is_choice = self.chart.states[transition.source].kind is Kind.CHOICE
        return transition.trigger is Trigger.EVENTLESS and not is_choice

    def _macrostep(self, first: Transition, follow: set[int]) -> tuple[set[int], Names]:
        """Return the atomic states that a macrostep can visit and the variables it can write.

        In a chart with regions it may visit any.
        """
        reached: set[int] = set() if first.targets else set(self.below(first.source))
        if any(state.kind is Kind.PARALLEL for state in self.chart.states):
            reached = set(self.leaves)
        pending, written = [first], NONE
        while pending:
            transition = pending.pop()
            written |= self._writes(transition)
            reached |= {s for s in self.entered(transition) if self.chart.states[s].is_leaf}
            for number in sorted(follow):
                later = self.chart.transitions[number]
                if not reached.isdisjoint(self.below(later.source)):
                    follow.remove(number)
                    pending.append(later)
        return reached, written

    def _writes(self, transition: Transition) -> Names:
        found = self.contents[transition.index].written
        if transition.targets:
            for left in self.exits:
                found |= left.written
        for number in self.entered(transition):
            found |= self._entering(self.chart.states[number]).written
        return found

    def _raised(self) -> frozenset[int]:
        """Return the events that can come from within a macrostep."""
        chart = self.chart
        found = {
            statement.event
            for statement in all_statements(chart)
            if isinstance(statement, Raise)
            or (isinstance(statement, Send) and statement.destination is Destination.INTERNAL)
        }
        found |= {e.index for e in chart.events if Direction.IN not in e.directions}
        return frozenset(found)

    @staticmethod
    def _follows(transition: Transition, raised: frozenset[int]) -> bool:
        """Whether a transition can be taken in a macrostep after its first transition."""
        return transition.trigger is Trigger.EVENTLESS or not raised.isdisjoint(transition.events)
