"""Decide temporal properties of a finite graph, for the oracle (``core/liveness/liveness.h``)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Container, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from math import inf

from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.system.freezes import Hold
from fsmkit.system.properties.property import (
    OverGraph,
    Property,
    evaluated,
    goal_place,
    temporal_properties,
)
from fsmkit.verify.statespace.actions import Action, Mover, Step
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.exploration import Answer
from fsmkit.verify.statespace.sessions import timer_name, timers_within


@dataclass(frozen=True, slots=True)
class Arc:
    """A step. ``action``: its fairness class, None without one; ``ticks``: its duration."""

    to: int
    ordinal: int
    internal: bool
    action: Hashable | None = None
    ticks: int = 0


Graph = Sequence[Sequence[Arc]]


@dataclass(frozen=True, slots=True)
class Lasso:
    """The state where a violation is decided, the ordinals to a cycle, and those around it."""

    state: int
    path: tuple[int, ...] = ()
    cycle: tuple[int, ...] = ()


def cannot_reach(graph: Graph, good: Sequence[bool]) -> list[int]:
    """Return the states from which no good state can be reached."""
    found = _back(graph, (n for n, is_good in enumerate(good) if is_good), lambda _: True)
    return [state for state in range(len(graph)) if state not in found]


def _back(graph: Graph, goals: Iterable[int], inside: Callable[[int], bool]) -> set[int]:
    before: list[list[int]] = [[] for _ in graph]
    for state, arcs in enumerate(graph):
        for arc in arcs:
            before[arc.to].append(state)
    found = set(goals)
    waiting = list(found)
    while waiting:
        for state in before[waiting.pop()]:
            if state not in found and inside(state):
                found.add(state)
                waiting.append(state)
    return found


@dataclass(slots=True)
class Obligations:
    """The states whose obligation may stay unmet, and the continuation from each."""

    graph: Graph
    query: Sequence[bool]
    answered: Sequence[bool]
    timeless: bool
    armed: Callable[[int], frozenset[Hashable]] = lambda _: frozenset()
    """The actions that are possible at a state without a step there (``fsm_model.armed``)."""
    ends: set[int] = field(default_factory=set)
    """States where a run may end."""
    cores: list[tuple[frozenset[int], bool]] = field(default_factory=list)
    """Components in which a fair run may stay; whether they never come to a stable state."""

    def violating_states(self) -> list[int]:
        """Return the states with an obligation that may stay unmet."""
        open_ = {n for n, done in enumerate(self.answered) if not done}
        self.ends = {n for n in open_ if self._is_stable(n) and not self._owed(n)}
        for component in components(self.graph, open_):
            if any(map(self._is_stable, component)) and self._is_fair(component, unstable=False):
                self.cores.append((component, False))
        unstable = {n for n in open_ if not self._is_stable(n)} if self.timeless else set()
        for component in components(self.graph, unstable):
            if self._is_fair(component, unstable=True):
                self.cores.append((component, True))
        goals = self.ends.union(*(component for component, _ in self.cores))
        found = _back(self.graph, goals, open_.__contains__)
        return [n for n in sorted(found) if self.query[n]]

    def _is_stable(self, state: int) -> bool:
        return not any(arc.internal for arc in self.graph[state])

    def _owed(self, state: int) -> set[Hashable]:
        found = {arc.action for arc in self.graph[state] if arc.action is not None}
        return found | self.armed(state)

    def _is_fair(self, component: frozenset[int], *, unstable: bool) -> bool:
        inner = [arc for state in component for arc in self.graph[state] if arc.to in component]
        counted = [state for state in component if unstable or self._is_stable(state)]
        always = set.intersection(*map(self._owed, counted)) if counted else set()
        return bool(inner) and not always - {arc.action for arc in inner}

    def lasso(self, state: int) -> Lasso:
        """Return a run from such a state."""
        goals = self.ends.union(*(component for component, _ in self.cores))
        path: tuple[int, ...] = ()
        at = state
        if at not in goals:
            inside = [not done for done in self.answered]
            path, at = require_walk(
                self.graph, at, lambda arc: inside[arc.to], lambda arc: arc.to in goals
            )
        if at in self.ends:
            return Lasso(state, path)
        component, unstable = next(c for c in self.cores if at in c[0])
        return Lasso(state, path, self._round(at, component, unstable=unstable))

    def _round(self, first: int, component: frozenset[int], *, unstable: bool) -> tuple[int, ...]:
        def counts(state: int) -> bool:
            return unstable or self._is_stable(state)

        left = set.union(*map(self._owed, component))
        left, seen = (left & self._owed(first), True) if counts(first) else (left, False)
        cycle: tuple[int, ...] = ()
        at = first
        while left or not seen:
            now = frozenset(left)

            def news(arc: Arc, now: frozenset[Hashable] = now, seen: bool = seen) -> bool:
                new_state = counts(arc.to) and (not seen or bool(now - self._owed(arc.to)))
                return arc.action in now or new_state

            path, _ = require_walk(self.graph, at, lambda arc: arc.to in component, news)
            for ordinal in path:
                arc = self.graph[at][ordinal]
                left.discard(arc.action)
                at = arc.to
                if counts(at):
                    left &= self._owed(at)
                    seen = True
            cycle += path
        if not cycle or at != first:
            cycle += require_walk(
                self.graph, at, lambda arc: arc.to in component, lambda a: a.to == first
            )[0]
        return cycle


@dataclass(slots=True)
class Delays:
    """The longest time until the end from each state, along all paths."""

    graph: Graph
    holds: Sequence[bool]
    ended: Sequence[bool]
    initial: Container[int]
    longest: dict[int, float] = field(default_factory=dict)

    def measure(self) -> None:
        """Fill in ``longest``: ticks, or infinity."""
        open_ = {n for n, done in enumerate(self.ended) if not done}
        for component in reversed(components(self.graph, open_)):
            longest = 0.0
            for state in component:
                arcs = self.graph[state]
                if not any(arc.internal or arc.ticks > 0 for arc in arcs):
                    longest = inf
                for arc in arcs:
                    if arc.to in component:
                        longest = max(longest, inf if arc.ticks > 0 else 0)
                    else:
                        longest = max(longest, arc.ticks + self.longest.get(arc.to, 0))
            self.longest.update(dict.fromkeys(component, longest))

    def start_states(self) -> Iterator[tuple[int | None, int]]:
        """Yield the states in which the time starts, each with a predecessor, None at the start."""
        for state, arcs in enumerate(self.graph):
            if state in self.initial and self.holds[state] and not self.ended[state]:
                yield None, state
            for arc in arcs if not self.holds[state] else ():
                if self.holds[arc.to] and not self.ended[arc.to]:
                    yield state, arc.to

    def path_exceeding(
        self, ticks: int, path_to: Callable[[int], tuple[int, ...]]
    ) -> tuple[int, ...]:
        """Return a path that takes longer than ``ticks``."""
        path_exceeding = [(b, to) for b, to in self.start_states() if self.longest[to] > ticks]
        paths = [
            (path_to(to) if b is None else (*path_to(b), self._step(b, to)), to)
            for b, to in path_exceeding
        ]
        path, at = min(paths, key=lambda found: len(found[0]))
        passed = 0
        while passed <= ticks and not self.ended[at]:
            now = self.longest[at]

            def fits(arc: Arc, now: float = now) -> bool:
                return arc.ticks + self.longest.get(arc.to, 0) == now

            on = walk(self.graph, at, fits, lambda arc: arc.ticks > 0)
            if on is None:
                break
            path, at = (*path, *on[0]), on[1]
            passed += next(arc.ticks for arcs in self.graph for arc in arcs if arc.ticks > 0)
        return path

    def _step(self, state: int, to: int) -> int:
        return next(arc.ordinal for arc in self.graph[state] if arc.to == to)


def walk(
    graph: Graph, start: int, allowed: Callable[[Arc], bool], ends: Callable[[Arc], bool]
) -> tuple[tuple[int, ...], int] | None:
    """Return a shortest nonempty path to an end, and its last state; None without one."""
    origin: dict[int, tuple[int, ...]] = {start: ()}
    waiting = deque([start])
    while waiting:
        at = waiting.popleft()
        for arc in graph[at]:
            if not allowed(arc):
                continue
            if ends(arc):
                return (*origin[at], arc.ordinal), arc.to
            if arc.to not in origin:
                origin[arc.to] = (*origin[at], arc.ordinal)
                waiting.append(arc.to)
    return None


def require_walk(
    graph: Graph, start: int, allowed: Callable[[Arc], bool], ends: Callable[[Arc], bool]
) -> tuple[tuple[int, ...], int]:
    """Return such a path, which must exist."""
    found = walk(graph, start, allowed, ends)
    if found is None:
        raise AssertionError("such a path exists")
    return found


def components(graph: Graph, inside: set[int]) -> list[frozenset[int]]:
    """Return the strongly connected components of a part of a graph (Kosaraju's algorithm)."""
    order: list[int] = []
    met: set[int] = set()
    for root in inside:
        if root in met:
            continue
        met.add(root)
        stack = [(root, iter(graph[root]))]
        while stack:
            state, arcs = stack[-1]
            for arc in arcs:
                if arc.to in inside and arc.to not in met:
                    met.add(arc.to)
                    stack.append((arc.to, iter(graph[arc.to])))
                    break
            else:
                order.append(state)
                stack.pop()
    before: dict[int, list[int]] = {state: [] for state in inside}
    for state in inside:
        for arc in graph[state]:
            if arc.to in inside:
                before[arc.to].append(state)
    found: list[frozenset[int]] = []
    left = set(inside)
    for root in reversed(order):
        if root not in left:
            continue
        component = {root}
        waiting = [root]
        left.discard(root)
        while waiting:
            for state in before[waiting.pop()]:
                if state in left:
                    left.discard(state)
                    component.add(state)
                    waiting.append(state)
        found.append(frozenset(component))
    return found


# --- systems --------------------------------------------------------------------------------------


def action_of(closed: ClosedSystem, step: Step, mover: Mover, before: Snapshot) -> Hashable | None:
    """Return the fairness class of a machine's step (``fsm_model.fair``)."""
    if step.action is Action.ELAPSE:
        return "time"
    if step.action is Action.OCCUR:
        what = closed.possible[step.argument]
        is_owed = what.fair
        if what.spontaneous:
            is_owed = what.fair and closed.system.machines[what.machine].environment
        return ("event", what.machine, what.event) if is_owed else None
    if mover is Mover.INTERNAL:
        return "machine", step.machine
    if step.action is not Action.FIRE or mover is not Mover.TIME:
        return None
    name = timer_name(closed.charts[step.machine], before, step.argument)
    return "timer", step.machine, name


def armed_between_turns(closed: ClosedSystem, snapshots: Sequence[Snapshot]) -> frozenset[Hashable]:
    """Return the armed timers of machines in a cyclic order; they are fair in every turn."""
    schedule = closed.system.schedule
    if schedule is None or not closed.untimed:
        return frozenset()
    return frozenset(
        ("timer", machine, timer_name(closed.charts[machine], snapshots[machine], place))
        for machine, hold in enumerate(closed.holds(snapshots))
        if machine in schedule.order and hold is Hold.RUNS
        for place, (chart, timer) in enumerate(
            timers_within(closed.charts[machine], snapshots[machine])
        )
        if not closed.never_fires(chart, timer)
    )


@dataclass(frozen=True, slots=True)
class TemporalQuery:
    """A property over a finite graph; states are numbered in the order they were found."""

    graph: Graph
    holds: list[bool]
    """Where the condition holds."""
    goal: list[bool]
    """Where the goal holds, of a property that has one."""
    ticks: int
    path_to: Callable[[int], tuple[int, ...]]
    initial: Container[int]
    timeless: bool
    armed: Callable[[int], frozenset[Hashable]]


def _recoverable(number: int, query: TemporalQuery) -> Answer:
    lost = cannot_reach(query.graph, query.holds)
    return Answer(number, True, bool(lost), query.path_to(min(lost)) if lost else ())


def _within(number: int, query: TemporalQuery) -> Answer:
    delays = Delays(query.graph, query.holds, query.goal, query.initial)
    delays.measure()
    times = [delays.longest[to] for _, to in delays.start_states()]
    greatest = max(times, default=inf)
    violated = bool(times) and greatest > query.ticks
    path = delays.path_exceeding(query.ticks, query.path_to) if violated else ()
    return Answer(number, True, violated, path, greatest=None if greatest == inf else int(greatest))


def _leads_to(number: int, query: TemporalQuery) -> Answer:
    open_ = [a and not b for a, b in zip(query.holds, query.goal, strict=True)]
    unanswered = Obligations(query.graph, open_, query.goal, query.timeless, query.armed)
    violating_states = unanswered.violating_states()
    if not violating_states:
        return Answer(number, True)
    lasso = unanswered.lasso(min(violating_states))
    return Answer(number, True, True, (*query.path_to(lasso.state), *lasso.path), lasso.cycle)


PROCEDURES = {"recoverable": _recoverable, "within": _within, "leads-to": _leads_to}
"""How the oracle decides over a graph, by the name of the procedure (`OverGraph`)."""


def answers(
    closed: ClosedSystem,
    graph: Graph,
    where: Callable[[Property], list[bool]],
    path_to: Callable[[int], tuple[int, ...]],
    initial: Container[int],
    armed: Callable[[int], frozenset[Hashable]],
) -> tuple[Answer, ...]:
    """Decide all temporal properties; states are numbered in the order they were found."""
    properties = closed.system.properties
    all_evaluated = evaluated(properties)
    found = []
    for number in temporal_properties(properties, untimed=closed.untimed):
        property_, decided = properties[number], properties[number].kind.decided
        if not isinstance(decided, OverGraph):
            continue
        holds = where(property_)
        has_goal = property_.goal is not None
        goal = where(all_evaluated[goal_place(properties, number)]) if has_goal else []
        query = TemporalQuery(
            graph, holds, goal, property_.ticks, path_to, initial, closed.is_timeless, armed
        )
        found.append(PROCEDURES[decided.procedure](number, query))
    return tuple(found)
