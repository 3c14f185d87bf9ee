"""``possible-loop``: eventless transitions that lead back to themselves while nothing changes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

from fsmkit.chart.analysis.exclusion import Fact, can_hold_together
from fsmkit.chart.analysis.reachability import entered, reachable_states
from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.checks.dead_transition import is_unguarded
from fsmkit.chart.content import variables, written
from fsmkit.chart.statements import Block
from fsmkit.chart.structure import lcca
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Trigger
from fsmkit.language import EventField, InState, Invalid
from fsmkit.language.statements.tree import statements
from fsmkit.language.walk import calls, nodes, root

LONGEST = 12
"""Transitions of a cycle: a longer one is not looked for."""
MOST_STEPS = 1000
"""Steps of the search in one chart."""
MOST_EFFORT = 300_000
"""The most guards that are examined in one chart, and pairs that are compared."""
Following = tuple[tuple[Transition, tuple[Fact, ...]], ...]
"""The transitions that can be taken next, each with its required facts."""


def check(chart: Chart, findings: Findings) -> None:
    """Report each transition once, with the other ones of its cycle.

    A cycle may end if a guard reads a variable that its content changes; it is not reported. A
    cycle without any guard is an ``endless-loop``.
    """
    reached = reachable_states(chart)
    eventless = [
        t for t in chart.transitions if t.trigger is Trigger.EVENTLESS and t.source in reached
    ]
    if not eventless:
        return
    search = _Search(chart, {t.index: t for t in eventless})
    reported: set[int] = set()
    for first in eventless:
        cycle = None if first.index in reported else search.cycle(first)
        if cycle is None or all(map(is_unguarded, cycle)):
            continue
        reported |= {t.index for t in cycle}
        names = " -> ".join(f"`{chart.states[t.source].id}`" for t in (*cycle, first))
        for place, transition in enumerate(cycle):
            others = (*cycle[place + 1 :], *cycle[:place])
            findings.add(
                "possible-loop",
                f"while the guards hold, the machine never comes to rest: {names}",
                transition.span,
                secondary=[(other.span, "and from here") for other in others],
                help="let something on the way change what a guard reads, make the guards "
                "exclude each other, or wait for an event",
            )


@dataclass
class _Search:
    """Looks for cycles. ``all``: the eventless transitions of states that can be reached."""

    chart: Chart
    all: dict[int, Transition]
    steps: int = 0
    effort: int = 0
    _next: dict[tuple[tuple[int, ...], int], Following] = field(default_factory=dict)

    def cycle(self, first: Transition) -> tuple[Transition, ...] | None:
        """Return a cycle that starts with `first` and whose guards can all hold at once, if any."""
        if self.steps > MOST_STEPS or not self._is_steady(first):
            return None
        for facts in self._conditions.get(first.index, ()):
            found = self._onward((first,), facts)
            if found is not None:
                return found
        return None

    @cached_property
    def _conditions(self) -> dict[int, list[tuple[Fact, ...]]]:
        """The required condition of each transition, by the transitions before it."""
        found: dict[int, list[tuple[Fact, ...]]] = {}
        places = dict.fromkeys(map(self._place, self.all.values()))
        for place in places:
            for following, facts in self._following(place):
                known = found.setdefault(following.index, [])
                if len(known) < LONGEST and facts not in known:
                    known.append(facts)
        return found

    def _onward(
        self, path: tuple[Transition, ...], facts: tuple[Fact, ...]
    ) -> tuple[Transition, ...] | None:
        self.steps += 1
        if len(path) > LONGEST or self.steps > MOST_STEPS or self.effort > MOST_EFFORT:
            return None
        if not self._can_hold(facts):
            return None
        following = self._following(self._place(path[-1]))
        for transition, needed in following:
            if transition.index == path[0].index:
                whole = self._joined(facts, needed)
                if self._can_hold(whole):
                    return path if self._never_changes(path, whole) else None
        taken = {t.index for t in path}
        for transition, needed in following:
            if transition.index in taken or not self._is_steady(transition):
                continue
            found = self._onward((*path, transition), self._joined(facts, needed))
            if found is not None:
                return found
        return None

    def _joined(self, facts: tuple[Fact, ...], needed: tuple[Fact, ...]) -> tuple[Fact, ...]:
        """Return the facts of both, without duplicates of the same guard."""
        self.effort += len(facts) + len(needed)
        known = {(id(guard), value) for guard, value in facts}
        return (*facts, *(fact for fact in needed if (id(fact[0]), fact[1]) not in known))

    def _can_hold(self, facts: tuple[Fact, ...]) -> bool:
        """Whether guards can hold at once; False if the decision exceeds the effort limit."""
        self.effort += len(facts) ** 2
        return self.effort <= MOST_EFFORT and can_hold_together(self.chart, facts)

    def _is_steady(self, transition: Transition) -> bool:
        """Whether the guard can hold, and has one value as long as no variable changes."""
        guard = transition.guard
        if guard is None:
            return True
        moving = any(isinstance(n, InState | EventField | Invalid) for n in nodes(guard))
        return not moving and not calls(guard)

    def _place(self, transition: Transition) -> tuple[tuple[int, ...], int]:
        """Return the targets and the domain, which determine the transitions that can follow."""
        if not transition.targets:
            return (), transition.source
        return transition.targets, lcca(self.chart, (transition.source, *transition.targets))

    def _following(self, place: tuple[tuple[int, ...], int]) -> Following:
        """Return the next transitions and their facts: the guard holds, no earlier one does."""
        if place not in self._next:
            self._next[place] = tuple(self._found(*place))
        return self._next[place]

    def _found(
        self, targets: tuple[int, ...], domain: int
    ) -> Iterator[tuple[Transition, tuple[Fact, ...]]]:
        chart = self.chart
        if any(chart.states[target].is_history for target in targets):
            return  # its targets are known only at run time
        inside = entered(chart, targets, domain) if targets else frozenset({domain})
        for state in sorted(inside | {domain, *chart.ancestors(domain)}):
            below = [b for b in sorted(inside) if chart.is_descendant(b, state)]
            before = [t for each in below for t in self._of(each)]
            if any(map(is_unguarded, before)):
                continue
            for candidate in self._of(state):
                self.effort += 1 + len(before)
                if self.effort > MOST_EFFORT:
                    return
                guards = [(t.guard, False) for t in before if t.guard is not None]
                if candidate.guard is not None:
                    guards.insert(0, (candidate.guard, True))
                yield candidate, tuple(guards)
                if is_unguarded(candidate):
                    break
                before.append(candidate)

    def _of(self, state: int) -> list[Transition]:
        return [self.all[n] for n in self.chart.states[state].transitions if n in self.all]

    def _never_changes(self, path: tuple[Transition, ...], facts: tuple[Fact, ...]) -> bool:
        """Whether no content along the path writes a variable that the guards read."""
        read = variables(tuple(expr for expr, _ in facts))
        return read.isdisjoint(self._changed(path))

    def _changed(self, path: tuple[Transition, ...]) -> set[str]:
        """Return the variables that the path and eventless transitions of other regions write."""
        chart = self.chart
        blocks: list[Block] = [t.content for t in self.all.values()]
        domains = [lcca(chart, (t.source, *t.targets)) for t in path if t.targets]
        for state in chart.states:
            if any(chart.is_descendant(state.index, domain) for domain in domains):
                blocks += [*state.on_entry, *state.on_exit]
                if state.initial is not None:
                    blocks.append(chart.transitions[state.initial].content)
        return {root(place).name for b in blocks for s in statements(b) for place in written(s)}
