"""The search in Python over the reference interpreter: the oracle of the engine in C.

Local states are interned, and a local step is taken once for each local state and action. Hundreds
of thousands of global states are therefore feasible. The order of all results is that of ``core``.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from itertools import count

from fsmkit.system.properties.property import (
    Property,
    evaluated,
    temporal_properties,
)
from fsmkit.verify.engines.python.evaluate import evaluate_property
from fsmkit.verify.engines.python.temporal import Arc, action_of, answers, armed_between_turns
from fsmkit.verify.resources.deadline import Deadline, Stage, TimeUp
from fsmkit.verify.statespace.actions import UNHANDLED, Action, Mover, TooManyChoices
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.exploration import (
    DEADLOCK,
    UNFINISHED,
    Answer,
    End,
    Exploration,
    Figures,
    Mark,
    Trail,
)
from fsmkit.verify.statespace.global_steps import Edge, GlobalSteps, State
from fsmkit.verify.statespace.sessions import active_configuration as shown_of
from fsmkit.verify.statespace.sessions import timers_within
from fsmkit.verify.statespace.spread import spread_of

PAUSE = 256
"""States between two looks at progress and deadline."""


class Oracle(GlobalSteps):
    """A search and its results so far."""

    def __init__(self, closed: ClosedSystem) -> None:
        """Prepare to search."""
        super().__init__(closed)
        self._states: dict[State, int] = {}
        self._order: list[State] = []
        self._origins: list[tuple[int, int]] = []
        self._marks: dict[int, tuple[int, tuple[int, int]]] = {}
        self._transitions = 0
        self._depth = 0
        self._evaluated = evaluated(closed.system.properties)
        taken = (
            (self._first_marks[m] + UNHANDLED + len(closed.charts[m].events) + e, (m, e))
            for m, e in closed.observed_events
        )
        self._asked = dict(taken)

    # --- the search ----------------------------------------------------------------------------

    def run(
        self,
        *,
        livelock: bool = True,
        traps: bool = False,
        deadline: Deadline | None = None,
        progress: Callable[[int, int, int], None] | None = None,
        until: frozenset[int] = frozenset(),
    ) -> Exploration:
        """Search until all is known, ``until`` was seen, time is up, or the user interrupts."""
        began = time.monotonic()
        deadline = deadline or Deadline()
        end, why = End.COMPLETE, ""
        knows_livelock = knows_traps = False
        cycle: tuple[tuple[int, ...], tuple[int, ...]] | None = None
        trapped: tuple[tuple[int, ...], ...] = ()
        temporal: tuple[Answer, ...] = ()
        try:
            search = self._search(until)
            while deadline.cut_off(Stage.EXPLORING, lambda: next(search, False)):
                if progress is not None:
                    progress(len(self._order), self._transitions, self._depth)
            if until and until <= self._marks.keys():
                end = End.DECIDED
            else:
                if livelock:
                    cycle = deadline.cut_off(Stage.EXPLORING, self._livelock)
                    knows_livelock = True
                if traps:
                    trapped = deadline.cut_off(Stage.EXPLORING, self._traps)
                    knows_traps = True
                temporal = deadline.cut_off(Stage.EXPLORING, self._temporal)
        except TimeUp:
            end = End.TIME
        except KeyboardInterrupt:
            end = End.INTERRUPTED
        except TooManyChoices:
            end, why = End.FAILED, "too many combinations of choices in one step"
        return Exploration(
            engine="python",
            end=end,
            why=why,
            states=len(self._order),
            transitions=self._transitions,
            depth=self._depth,
            bytes=0,
            seconds=time.monotonic() - began,
            marks=tuple(
                Mark(number, count, self._path_to(*place))
                for number, (count, place) in sorted(self._marks.items())
            ),
            livelock_known=knows_livelock,
            livelock=cycle,
            traps_known=knows_traps,
            traps=trapped,
            machines=tuple(self._figures(machine, end) for machine in range(self._count)),
            temporal=temporal,
        )

    def _search(self, until: frozenset[int]) -> Iterator[bool]:
        """Visit all states, or until those marks were seen; check for interrupts now and then."""
        for ordinal, edge in enumerate(self.initial()):
            self._visit(-1, ordinal, edge)
        layer_end = len(self._order)
        for expanded in count():
            if expanded == len(self._order) or (until and until <= self._marks.keys()):
                return
            if expanded == layer_end:
                layer_end = len(self._order)
                self._depth += 1
            for ordinal, edge in enumerate(self.successors(self._order[expanded])):
                self._transitions += 1
                self._visit(expanded, ordinal, edge)
            if expanded % PAUSE == 0:
                yield True

    def _visit(self, source: int, ordinal: int, edge: Edge) -> None:
        number = self._states.get(edge.to)
        for mark in edge.marks:
            self._note(mark, (source, ordinal))
        if self._asked:
            self._evaluate_step(source, ordinal, edge)
        if number is not None:
            return
        number = self._states[edge.to] = len(self._order)
        self._order.append(edge.to)
        self._origins.append((source, ordinal))
        if not self.closed.is_open and self.is_deadlock(edge.to):
            self._note(DEADLOCK, (number, -1))
        snapshots = self.snapshots(edge.to)
        for index, property_ in enumerate(self._evaluated):
            if not property_.is_of_steps and evaluate_property(
                self.closed.charts, property_, snapshots
            ):
                self._note(1 + index, (number, -1))

    def _evaluate_step(self, source: int, ordinal: int, edge: Edge) -> None:
        occurring = {self._asked[mark] for mark in edge.marks if mark in self._asked}
        snapshots = self.snapshots(edge.to)
        for index, property_ in enumerate(self._evaluated):
            if property_.is_of_steps and evaluate_property(
                self.closed.charts, property_, snapshots, occurring
            ):
                self._note(1 + index, (source, ordinal))

    def _note(self, mark: int, place: tuple[int, int]) -> None:
        count, first = self._marks.get(mark, (0, place))
        self._marks[mark] = (count + 1, first)

    def _path_to(self, state: int, step: int) -> tuple[int, ...]:
        path = [] if step < 0 else [step]
        while state >= 0:
            state, ordinal = self._origins[state]
            path.append(ordinal)
        return tuple(reversed(path))

    def trail(self, path: tuple[int, ...]) -> Trail:
        """Return the steps of a path."""
        found = []
        edges: Iterator[Edge] = self.initial()
        for ordinal in path:
            edge = next(e for n, e in enumerate(edges) if n == ordinal)
            found.append(edge.steps)
            edges = self.successors(edge.to)
        return tuple(found)

    @property
    def reached(self) -> Sequence[State]:
        """The states found so far."""
        return self._order

    # --- the graph ------------------------------------------------------------------------------

    def _livelock(self) -> tuple[tuple[int, ...], tuple[int, ...]] | None:
        graph = [
            [
                (self._states[edge.to], ordinal)
                for ordinal, edge in enumerate(self.successors(state))
                if edge.mover is Mover.INTERNAL
            ]
            for state in self._order
        ]
        found = find_cycle(graph)
        if found is None:
            return None
        return self._path_to(found[0], -1), found[1]

    def _traps(self) -> tuple[tuple[int, ...], ...]:
        graph = [
            [(self._states[edge.to], n) for n, edge in enumerate(self.successors(state))]
            for state in self._order
        ]
        shown = [tuple(map(shown_of, self.snapshots(state))) for state in self._order]
        oldest: dict[object, int] = {}
        for trap in find_traps(graph, shown):
            views = [self.local_states[m][n].view for m, n in enumerate(self._order[trap])]
            if not all(view.at_rest or view.faulted for view in views):
                oldest[shown[trap]] = min(trap, oldest.get(shown[trap], trap))
        return tuple(self._path_to(trap, -1) for trap in sorted(oldest.values()))

    def _temporal(self) -> tuple[Answer, ...]:
        if not temporal_properties(self.closed.system.properties):
            return ()
        graph = [
            [self._arc(state, n, edge) for n, edge in enumerate(self.successors(state))]
            for state in self._order
        ]
        initial = {n for n, (source, _) in enumerate(self._origins) if source < 0}
        return answers(
            self.closed,
            graph,
            self._where,
            lambda state: self._path_to(state, -1),
            initial,
            lambda n: armed_between_turns(self.closed, self.snapshots(self._order[n])),
        )

    def _where(self, property_: Property) -> list[bool]:
        return [
            evaluate_property(self.closed.charts, property_, self.snapshots(state))
            for state in self._order
        ]

    def _arc(self, state: State, ordinal: int, edge: Edge) -> Arc:
        step = edge.steps[0]
        before = self.local_states[step.machine][state[step.machine]].snapshot
        action = action_of(self.closed, step, edge.mover, before)
        ticks = self.closed.unit if step.action is Action.ELAPSE else 0
        return Arc(self._states[edge.to], ordinal, edge.mover is Mover.INTERNAL, action, ticks)

    def _figures(self, machine: int, end: End) -> Figures:
        found = self.local_states[machine]
        snapshots = [local.snapshot for local in found]
        coverage, chart = self.local_steps.coverage[machine], self.closed.charts[machine]
        return Figures(
            locals=len(found),
            queue=max((len(s.queue) + len(s.deferred) for s in snapshots), default=0),
            timers=max((len(timers_within(chart, s)) for s in snapshots), default=0),
            microsteps=coverage.microsteps,
            states=frozenset(coverage.states),
            transitions=frozenset(coverage.transitions),
            spread=spread_of(chart, snapshots if end in UNFINISHED else ()),
        )


def explore_in_python(
    closed: ClosedSystem,
    *,
    traps: bool = False,
    deadline: Deadline | None = None,
    progress: Callable[[int, int, int], None] | None = None,
    until: frozenset[int] = frozenset(),
) -> tuple[Exploration, Callable[[tuple[int, ...]], Trail]]:
    """Explore; also return the function that turns a path into steps."""
    oracle = Oracle(closed)
    found = oracle.run(traps=traps, deadline=deadline, progress=progress, until=until)
    return found, oracle.trail


Graph = Sequence[Sequence[tuple[int, int]]]


def find_cycle(graph: Graph) -> tuple[int, tuple[int, ...]] | None:
    """Return a state on a cycle and the ordinals around it; None without a cycle."""
    grey, black = 1, 2
    colour = [0] * len(graph)
    for root in range(len(graph)):
        if colour[root]:
            continue
        colour[root] = grey
        stack = [(root, iter(graph[root]))]
        taken: list[int] = []
        while stack:
            state, edges = stack[-1]
            for to, ordinal in edges:
                if colour[to] == grey:
                    first = next(n for n, (on_path, _) in enumerate(stack) if on_path == to)
                    return to, (*taken[first:], ordinal)
                if not colour[to]:
                    colour[to] = grey
                    taken.append(ordinal)
                    stack.append((to, iter(graph[to])))
                    break
            else:
                colour[state] = black
                stack.pop()
                if taken:
                    taken.pop()
    return None


def find_traps(graph: Graph, shown: Sequence[object]) -> list[int]:
    """Return a state of each set that is never left and in which the shown states are all equal.

    A state can escape if some path from it leads to a different shown state. The others are in
    traps, and so are all their successors.
    """
    back: list[list[int]] = [[] for _ in graph]
    free = [False] * len(graph)
    for state, edges in enumerate(graph):
        for to, _ in edges:
            back[to].append(state)
            free[state] = free[state] or shown[to] != shown[state]
    waiting = [state for state, is_free in enumerate(free) if is_free]
    while waiting:
        for state in back[waiting.pop()]:
            if not free[state]:
                free[state] = True
                waiting.append(state)
    return [state for state, is_free in enumerate(free) if not is_free]
