"""``possible-loop``: eventless transitions that lead back to themselves while nothing changes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

from fsmkit.analysis.exclusion import Fact, can_hold_together
from fsmkit.analysis.reachability import entered, reachable_states
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


def check(chart: Chart, findings: Findings) -> None:
    """Report each transition once, with the other ones of its cycle.

    A cycle of which a guard reads what content on it changes may end, so it is none of these. One
    without any guard is an ``endless-loop``.
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
    _next: dict[int, tuple[tuple[Transition, tuple[Fact, ...]], ...]] = field(default_factory=dict)

    def cycle(self, first: Transition) -> tuple[Transition, ...] | None:
        """Return a cycle that begins with a transition, and whose guards can all hold at once."""
        if self.steps > MOST_STEPS or not self._is_steady(first):
            return None
        for facts in self._ways.get(first.index, ()):
            found = self._onward((first,), facts)
            if found is not None:
                return found
        return None

    @cached_property
    def _ways(self) -> dict[int, list[tuple[Fact, ...]]]:
        """What must hold for each transition, by the transitions after which it is looked at."""
        found: dict[int, list[tuple[Fact, ...]]] = {}
        for transition in self.all.values():
            for following, facts in self._following(transition):
                known = found.setdefault(following.index, [])
                if len(known) < LONGEST and facts not in known:
                    known.append(facts)
        return found

    def _onward(
        self, path: tuple[Transition, ...], facts: tuple[Fact, ...]
    ) -> tuple[Transition, ...] | None:
        self.steps += 1
        if len(path) > LONGEST or self.steps > MOST_STEPS:
            return None
        if not can_hold_together(self.chart, facts):
            return None
        following = self._following(path[-1])
        for transition, needed in following:
            whole = (*facts, *(fact for fact in needed if fact not in facts))
            if transition.index == path[0].index and can_hold_together(self.chart, whole):
                return path if self._never_changes(path, whole) else None
        taken = {t.index for t in path}
        for transition, needed in following:
            if transition.index in taken or not self._is_steady(transition):
                continue
            whole = (*facts, *(fact for fact in needed if fact not in facts))
            found = self._onward((*path, transition), whole)
            if found is not None:
                return found
        return None

    def _is_steady(self, transition: Transition) -> bool:
        """Whether the guard can hold, and has one value as long as no variable changes."""
        guard = transition.guard
        if guard is None:
            return True
        moving = any(isinstance(n, InState | EventField | Invalid) for n in nodes(guard))
        return not moving and not calls(guard)

    def _following(self, transition: Transition) -> tuple[tuple[Transition, tuple[Fact, ...]], ...]:
        """Return what can be taken next, and what must hold: its guard, and no guard before it."""
        if transition.index not in self._next:
            self._next[transition.index] = tuple(self._found(transition))
        return self._next[transition.index]

    def _found(self, transition: Transition) -> Iterator[tuple[Transition, tuple[Fact, ...]]]:
        chart = self.chart
        if any(chart.states[target].is_history for target in transition.targets):
            return  # where that leads is known only at run time
        if transition.targets:
            domain = lcca(chart, (transition.source, *transition.targets))
            inside = entered(chart, transition.targets, domain)
            active = inside | {domain, *chart.ancestors(domain)}
        else:
            inside = frozenset({transition.source})
            active = inside | set(chart.ancestors(transition.source))
        for state in sorted(active):
            before = [
                t
                for below in sorted(inside)
                if chart.is_descendant(below, state)
                for t in self._of(below)
            ]
            for candidate in self._of(state):
                facts = self._facts(candidate, before)
                if facts is not None:
                    yield candidate, facts
                before.append(candidate)

    def _of(self, state: int) -> list[Transition]:
        return [self.all[n] for n in self.chart.states[state].transitions if n in self.all]

    def _facts(self, candidate: Transition, before: list[Transition]) -> tuple[Fact, ...] | None:
        """Return what must hold for a transition; None if one before it is always taken."""
        if any(t.guard is None or is_unguarded(t) for t in before):
            return None
        facts = [(t.guard, False) for t in before if t.guard is not None]
        if candidate.guard is not None:
            facts.insert(0, (candidate.guard, True))
        return tuple(facts)

    def _never_changes(self, path: tuple[Transition, ...], facts: tuple[Fact, ...]) -> bool:
        """Whether nothing that the guards read is changed by what may be done meanwhile."""
        read = variables(tuple(expr for expr, _ in facts))
        return read.isdisjoint(self._changed(path))

    def _changed(self, path: tuple[Transition, ...]) -> set[str]:
        """Return what is written on the way, and by eventless transitions of other regions."""
        chart = self.chart
        blocks: list[Block] = [t.content for t in self.all.values()]
        domains = [lcca(chart, (t.source, *t.targets)) for t in path if t.targets]
        for state in chart.states:
            if any(chart.is_descendant(state.index, domain) for domain in domains):
                blocks += [*state.on_entry, *state.on_exit]
                if state.initial is not None:
                    blocks.append(chart.transitions[state.initial].content)
        return {root(place).name for b in blocks for s in statements(b) for place in written(s)}
