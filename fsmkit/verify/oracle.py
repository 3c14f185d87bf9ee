"""The search in Python over the reference interpreter: the oracle of the engine in C.

Local states are interned, and a local step is taken once for each local state and action, so that
hundreds of thousands of global states are feasible. The order of everything is that of ``core``.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.verify.closed import PATIENCE, Closed
from fsmkit.verify.exploration import (
    DEADLOCK,
    Answer,
    End,
    Exploration,
    Figures,
    Mark,
    Trail,
    first_mark,
)
from fsmkit.verify.graph import find_cycle, find_traps
from fsmkit.verify.judge import judge
from fsmkit.verify.moves import FULL, Action, Message, Outcome, Step, TooManyChoices, View, Who
from fsmkit.verify.shared import written_value
from fsmkit.verify.steps import LocalSteps
from fsmkit.verify.system import Property, judged, temporal_properties
from fsmkit.verify.temporal import Arc, action_of, answers

State = tuple[int, ...]
"""A global state: a local state, by number, for each machine."""


@dataclass(slots=True)
class _Local:
    """What is known of a local state."""

    snapshot: Snapshot
    view: View
    own: list[Outcome] | None = None
    open: list[Outcome] | None = None
    busy: bool = False
    owed: bool = False
    elapsed: int = -1
    delivered: dict[Message, tuple[int, bool]] = field(default_factory=dict)


@dataclass(slots=True)
class _Edge:
    """A step of a global state."""

    steps: tuple[Step, ...]
    who: Who
    to: State
    marks: tuple[int, ...]


class Oracle:
    """A search, and what it found so far."""

    def __init__(self, closed: Closed) -> None:
        """Prepare to search."""
        self.closed = closed
        self.local_steps = LocalSteps(closed)
        self._count = len(closed.charts)
        self._locals: list[list[_Local]] = [[] for _ in closed.charts]
        self._numbers: list[dict[Snapshot, int]] = [{} for _ in closed.charts]
        self._first_marks = [first_mark(closed, m) for m in range(self._count)]
        self._environment = [m.environment for m in closed.system.machines]
        self._states: dict[State, int] = {}
        self._order: list[State] = []
        self._origins: list[tuple[int, int]] = []
        self._marks: dict[int, tuple[int, tuple[int, int]]] = {}
        self._transitions = 0
        self._judged = judged(closed.system.properties)

    # --- local states --------------------------------------------------------------------------

    def _intern(self, machine: int, snapshot: Snapshot) -> int:
        numbers = self._numbers[machine]
        number = numbers.get(snapshot)
        if number is None:
            number = numbers[snapshot] = len(numbers)
            view = self.local_steps.view(machine, snapshot)
            self._locals[machine].append(_Local(snapshot, view))
        return number

    def _own(self, machine: int, number: int) -> list[Outcome]:
        """Return the own steps of a local state; asked for only where they can be taken."""
        local = self._locals[machine][number]
        if local.own is None:
            local.own = []
            if local.view.running:
                local.own = self.local_steps.own(machine, local.snapshot, local.view)
            local.busy = any(outcome.who is Who.INTERNAL for outcome in local.own)
            local.owed |= any(o.step.action is Action.OCCUR for o in local.own)
        return local.own

    def _open(self, machine: int, number: int) -> list[Outcome]:
        """Return what may happen to a local state; asked for only where it can."""
        local = self._locals[machine][number]
        if local.open is None:
            local.open = []
            if local.view.running:
                local.open = self.local_steps.open(machine, local.snapshot)
            local.owed |= any(self.closed.possible[o.step.argument].owed for o in local.open)
        return local.open

    def _elapsed(self, machine: int, number: int) -> int:
        local = self._locals[machine][number]
        if local.elapsed < 0:
            after = self.local_steps.elapsed(local.snapshot)
            local.elapsed = self._intern(machine, after)
        return local.elapsed

    def _deliver(self, state: list[int], message: Message, marks: dict[int, None]) -> None:
        target = message.target
        local = self._locals[target][state[target]]
        known = local.delivered.get(message)
        if known is None:
            after, full = self.local_steps.delivered(local.snapshot, message)
            after = self.local_steps.settled(target, after)
            known = local.delivered[message] = self._intern(target, after), full
        state[target], full = known
        if full:
            marks[self._first_marks[target] + FULL] = None

    @property
    def reached(self) -> Sequence[State]:
        """The states found so far."""
        return self._order

    def snapshots(self, state: State) -> tuple[Snapshot, ...]:
        """Return the machines in a global state."""
        return tuple(self._locals[machine][n].snapshot for machine, n in enumerate(state))

    # --- global steps --------------------------------------------------------------------------

    def initial(self) -> Iterator[_Edge]:
        """Yield the initial states."""
        settled = self.local_steps.settled
        state = [
            self._intern(m, settled(m, self.local_steps.initial(m))) for m in range(self._count)
        ]
        marks: dict[int, None] = {}
        for link in self.closed.system.input_links:
            data = self._locals[link.source][state[link.source]].snapshot.data
            writer, chart = (
                self.closed.system.machines[link.source],
                self.closed.charts[link.source],
            )
            value = written_value(writer, chart, data, link.output)
            self._deliver(state, Message(link.target, input=link.input, value=value), marks)
        order = sorted(range(self._count), key=lambda m: not self._environment[m])
        yield from self._start(state, order, (), [], marks)

    def _start(
        self,
        state: list[int],
        order: list[int],
        steps: tuple[Step, ...],
        sent: list[Message],
        marks: dict[int, None],
    ) -> Iterator[_Edge]:
        if len(steps) == self._count:
            reached = list(state)
            for message in sent:
                self._deliver(reached, message, marks)
            yield _Edge(steps, Who.ENVIRONMENT, tuple(reached), tuple(marks))
            return
        machine = order[len(steps)]
        snapshot = self._locals[machine][state[machine]].snapshot
        start = Step(Action.START, machine)
        for outcome in self.local_steps.explore(machine, snapshot, start, Who.INTERNAL):
            next_ = list(state)
            next_[machine] = self._intern(machine, outcome.after)
            noted = dict(marks)
            noted.update(dict.fromkeys(self._noted(machine, outcome)))
            for message in outcome.messages:
                if message.event is None:
                    self._deliver(next_, message, noted)
            later = [*sent, *(m for m in outcome.messages if m.event is not None)]
            yield from self._start(next_, order, (*steps, outcome.step), later, noted)

    def _noted(self, machine: int, outcome: Outcome) -> list[int]:
        return [self._first_marks[machine] + note for note in outcome.notes]

    def successors(self, state: State) -> Iterator[_Edge]:
        """Yield the steps of a state."""
        found = [self._locals[machine][number] for machine, number in enumerate(state)]
        answering = [
            is_environment and local.view.waiting > 0
            for is_environment, local in zip(self._environment, found, strict=True)
        ]
        answers = any(answering)
        is_open = not answers and sum(local.view.waiting for local in found) <= PATIENCE
        for machine, number in enumerate(state):
            if answers and not answering[machine]:
                continue
            for outcome in self._own(machine, number):
                yield self._edge(state, machine, outcome)
            if is_open:
                for outcome in self._open(machine, number):
                    yield self._edge(state, machine, outcome)
        awaited = sum(local.view.awaited for local in found)
        if awaited and self.closed.unit and not any(local.busy for local in found):
            to = tuple(self._elapsed(machine, number) for machine, number in enumerate(state))
            yield _Edge((Step(Action.ELAPSE),), Who.TIME, to, ())

    def _edge(self, state: State, machine: int, outcome: Outcome) -> _Edge:
        to = list(state)
        to[machine] = self._intern(machine, outcome.after)
        marks = dict.fromkeys(self._noted(machine, outcome))
        for message in outcome.messages:
            self._deliver(to, message, marks)
        return _Edge((outcome.step,), outcome.who, tuple(to), tuple(marks))

    # --- the search ----------------------------------------------------------------------------

    def run(
        self,
        *,
        livelock: bool = True,
        traps: bool = False,
        timeout: float = 0,
        progress: Callable[[int, int, int], None] | None = None,
        until: frozenset[int] = frozenset(),
    ) -> Exploration:
        """Search until all is known, ``until`` was seen, time is up, or the user interrupts."""
        began = time.monotonic()
        end, why, expanded, depth, layer_end = End.COMPLETE, "", 0, 0, 0
        try:
            for ordinal, edge in enumerate(self.initial()):
                self._visit(-1, ordinal, edge)
            layer_end = len(self._order)
            while expanded < len(self._order):
                if expanded == layer_end:
                    layer_end = len(self._order)
                    depth += 1
                if timeout and time.monotonic() - began > timeout:
                    end = End.TIME
                    break
                if expanded % 256 == 0 and progress is not None:
                    progress(len(self._order), self._transitions, depth)
                for ordinal, edge in enumerate(self.successors(self._order[expanded])):
                    self._transitions += 1
                    self._visit(expanded, ordinal, edge)
                expanded += 1
                if until and until <= self._marks.keys():
                    end = End.DECIDED
                    break
        except KeyboardInterrupt:
            end = End.INTERRUPTED
        except TooManyChoices:
            end, why = End.FAILED, "too many combinations of choices in one step"
        complete = end is End.COMPLETE
        return Exploration(
            engine="python",
            end=end,
            why=why,
            states=len(self._order),
            expanded=expanded,
            transitions=self._transitions,
            depth=depth,
            bytes=0,
            seconds=time.monotonic() - began,
            marks=tuple(
                Mark(number, count, self._path_to(*place))
                for number, (count, place) in sorted(self._marks.items())
            ),
            livelock_known=livelock and complete,
            livelock=self._livelock() if livelock and complete else None,
            traps_known=traps and complete,
            traps=self._traps() if traps and complete else (),
            machines=tuple(self._figures(machine) for machine in range(self._count)),
            temporal=self._temporal() if complete else (),
        )

    def _visit(self, source: int, ordinal: int, edge: _Edge) -> None:
        number = self._states.get(edge.to)
        for mark in edge.marks:
            self._note(mark, (source, ordinal))
        if number is not None:
            return
        number = self._states[edge.to] = len(self._order)
        self._order.append(edge.to)
        self._origins.append((source, ordinal))
        if not self.closed.is_open and self._is_deadlock(edge.to):
            self._note(DEADLOCK, (number, -1))
        snapshots = self.snapshots(edge.to)
        for index, property_ in enumerate(self._judged):
            if judge(self.closed, property_, snapshots):
                self._note(1 + index, (number, -1))

    def _note(self, mark: int, place: tuple[int, int]) -> None:
        count, first = self._marks.get(mark, (0, place))
        self._marks[mark] = (count + 1, first)

    def _is_deadlock(self, state: State) -> bool:
        found = [self._locals[machine][number] for machine, number in enumerate(state)]
        if any(local.view.awaited or local.view.waiting for local in found):
            return False
        for machine, number in enumerate(state):
            self._own(machine, number)
            self._open(machine, number)
        if any(local.view.faulted or local.busy or local.owed for local in found):
            return False
        return not all(local.view.at_rest for local in found)

    def _path_to(self, state: int, step: int) -> tuple[int, ...]:
        path = [] if step < 0 else [step]
        while state >= 0:
            state, ordinal = self._origins[state]
            path.append(ordinal)
        return tuple(reversed(path))

    def trail(self, path: tuple[int, ...]) -> Trail:
        """Return the steps of a path."""
        found = []
        edges: Iterator[_Edge] = self.initial()
        for ordinal in path:
            edge = next(e for n, e in enumerate(edges) if n == ordinal)
            found.append(edge.steps)
            edges = self.successors(edge.to)
        return tuple(found)

    # --- the graph ------------------------------------------------------------------------------

    def _livelock(self) -> tuple[tuple[int, ...], tuple[int, ...]] | None:
        graph = [
            [
                (self._states[edge.to], ordinal)
                for ordinal, edge in enumerate(self.successors(state))
                if edge.who is Who.INTERNAL
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
        shown = [
            tuple((s.configuration, s.running) for s in self.snapshots(state))
            for state in self._order
        ]
        oldest: dict[object, int] = {}
        for trap in find_traps(graph, shown):
            views = [self._locals[m][n].view for m, n in enumerate(self._order[trap])]
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
        return answers(self.closed, graph, self._where, lambda state: self._path_to(state, -1))

    def _where(self, property_: Property) -> list[bool]:
        return [judge(self.closed, property_, self.snapshots(state)) for state in self._order]

    def _arc(self, state: State, ordinal: int, edge: _Edge) -> Arc:
        step = edge.steps[0]
        timers = self._locals[step.machine][state[step.machine]].snapshot.timers
        action = action_of(self.closed, step, edge.who, timers)
        ticks = self.closed.unit if step.action is Action.ELAPSE else 0
        return Arc(self._states[edge.to], ordinal, edge.who is Who.INTERNAL, action, ticks)

    def _figures(self, machine: int) -> Figures:
        found = self._locals[machine]
        snapshots = [local.snapshot for local in found]
        coverage = self.local_steps.coverage[machine]
        return Figures(
            locals=len(found),
            queue=max((len(s.queue) + len(s.deferred) for s in snapshots), default=0),
            timers=max((len(s.timers) for s in snapshots), default=0),
            microsteps=coverage.microsteps,
            states=frozenset(coverage.states),
            transitions=frozenset(coverage.transitions),
        )


def explore_in_python(
    closed: Closed,
    *,
    livelock: bool = True,
    traps: bool = False,
    timeout: float = 0,
    progress: Callable[[int, int, int], None] | None = None,
    until: frozenset[int] = frozenset(),
) -> tuple[Exploration, Callable[[tuple[int, ...]], Trail]]:
    """Explore; also return what turns a path into steps."""
    oracle = Oracle(closed)
    found = oracle.run(
        livelock=livelock, traps=traps, timeout=timeout, progress=progress, until=until
    )
    return found, oracle.trail
