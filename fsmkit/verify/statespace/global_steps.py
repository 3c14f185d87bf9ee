"""Global steps of a closed system over the interpreter, with interned local states and steps.

A local step is taken once for each local state and action. The order of all results is that of
``core``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.system.freezes import Hold
from fsmkit.system.shared import written_value
from fsmkit.verify.statespace.actions import FULL, Action, Message, Mover, Outcome, Step, View
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.local_steps import LocalSteps

State = tuple[int, ...]
"""A global state: a local state, by number, for each machine."""


@dataclass(slots=True)
class LocalState:
    """The known facts about a local state."""

    snapshot: Snapshot
    view: View
    own: list[Outcome] | None = None
    open: list[Outcome] | None = None
    busy: bool = False
    fair: bool = False
    elapsed: int = -1
    delivered: dict[Message, tuple[int, bool]] = field(default_factory=dict)


@dataclass(slots=True)
class Edge:
    """A step of a global state."""

    steps: tuple[Step, ...]
    mover: Mover
    to: State
    marks: tuple[int, ...]


class GlobalSteps:
    """The steps of global states."""

    def __init__(self, closed: ClosedSystem, local_steps: LocalSteps | None = None) -> None:
        """Start without states."""
        self.closed = closed
        self.local_steps = local_steps or LocalSteps(closed)
        self._count = len(closed.charts)
        self.local_states: list[list[LocalState]] = [[] for _ in closed.charts]
        self._numbers: list[dict[Snapshot, int]] = [{} for _ in closed.charts]
        self._first_marks = [closed.first_marks[m] for m in range(self._count)]
        self._environment = [m.environment for m in closed.system.machines]
        self._monitors = [m.is_monitor for m in closed.system.machines]

    # --- local states --------------------------------------------------------------------------

    def intern(self, machine: int, snapshot: Snapshot) -> int:
        """Return the number of a local state."""
        numbers = self._numbers[machine]
        number = numbers.get(snapshot)
        if number is None:
            number = numbers[snapshot] = len(numbers)
            view = self.local_steps.view(machine, snapshot)
            self.local_states[machine].append(LocalState(snapshot, view))
        return number

    def own_steps(self, machine: int, number: int) -> list[Outcome]:
        """Return the own steps of a local state; computed only where they can be taken."""
        local = self.local_states[machine][number]
        if local.own is None:
            local.own = []
            if local.view.running:
                local.own = self.local_steps.own(machine, local.snapshot, local.view)
            local.busy = any(outcome.mover is Mover.INTERNAL for outcome in local.own)
            local.fair |= any(
                o.step.action is Action.OCCUR and self.closed.possible[o.step.argument].fair
                for o in local.own
            )
        return local.own

    def open_steps(self, machine: int, number: int) -> list[Outcome]:
        """Return the external events of a local state; computed only where they can occur."""
        local = self.local_states[machine][number]
        if local.open is None:
            local.open = []
            if local.view.running:
                local.open = self.local_steps.open(machine, local.snapshot)
            local.fair |= any(self.closed.possible[o.step.argument].fair for o in local.open)
        return local.open

    def elapsed(self, machine: int, number: int) -> int:
        """Return a local state after a unit of time."""
        local = self.local_states[machine][number]
        if local.elapsed < 0:
            after = self.local_steps.elapsed(machine, local.snapshot)
            local.elapsed = self.intern(machine, after)
        return local.elapsed

    def after(self, machine: int, number: int, message: Message) -> int:
        """Return a local state after it received a message."""
        return self.delivered(machine, number, message)[0]

    def delivered(self, machine: int, number: int, message: Message) -> tuple[int, bool]:
        """Return a local state after a message, and whether its queue was full."""
        local = self.local_states[machine][number]
        known = local.delivered.get(message)
        if known is None:
            after, full = self.local_steps.delivered(local.snapshot, message)
            after = self.local_steps.settled(machine, after)
            known = local.delivered[message] = self.intern(machine, after), full
        return known

    def _deliver(self, state: list[int], message: Message, marks: dict[int, None]) -> None:
        target = message.target
        state[target], full = self.delivered(target, state[target], message)
        if full:
            marks[self._first_marks[target] + FULL] = None

    def snapshots(self, state: State) -> tuple[Snapshot, ...]:
        """Return the machines in a global state."""
        return tuple(self.local_states[machine][n].snapshot for machine, n in enumerate(state))

    # --- global steps --------------------------------------------------------------------------

    def initial(self) -> Iterator[Edge]:
        """Yield the initial states."""
        settled = self.local_steps.settled
        state = [
            self.intern(m, settled(m, self.local_steps.initial(m))) for m in range(self._count)
        ]
        marks: dict[int, None] = {}
        for link in self.closed.system.input_links:
            data = self.local_states[link.source][state[link.source]].snapshot.data
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
    ) -> Iterator[Edge]:
        if len(steps) == self._count:
            reached = list(state)
            for message in sent:
                self._deliver(reached, message, marks)
            yield Edge(steps, Mover.ENVIRONMENT, tuple(reached), tuple(marks))
            return
        machine = order[len(steps)]
        snapshot = self.local_states[machine][state[machine]].snapshot
        start = Step(Action.START, machine)
        for outcome in self.local_steps.explore(machine, snapshot, start, Mover.INTERNAL):
            next_ = list(state)
            next_[machine] = self.intern(machine, outcome.after)
            noted = dict(marks)
            noted.update(dict.fromkeys(self._noted(machine, outcome)))
            for message in outcome.messages:
                if message.event is None:
                    self._deliver(next_, message, noted)
            later = [*sent, *(m for m in outcome.messages if m.event is not None)]
            yield from self._start(next_, order, (*steps, outcome.step), later, noted)

    def _noted(self, machine: int, outcome: Outcome) -> list[int]:
        return [self._first_marks[machine] + note for note in outcome.notes]

    def successors(self, state: State) -> Iterator[Edge]:
        """Yield the steps of a state."""
        found = [self.local_states[machine][number] for machine, number in enumerate(state)]
        holds = self.holds(state)
        counts = [
            0 if hold else local.view.waiting for hold, local in zip(holds, found, strict=True)
        ]
        waiting = [count > 0 for count in counts]
        watching = [m and w for m, w in zip(self._monitors, waiting, strict=True)]
        answering = [e and w for e, w in zip(self._environment, waiting, strict=True)]
        answers = any(answering)
        answering = watching if any(watching) else answering
        is_open = not answers and sum(counts) <= self.closed.max_pending
        moving = answering if answers else self._moving(state, holds)
        for machine, number in enumerate(state):
            if not moving[machine]:
                continue
            for outcome in self.own_steps(machine, number):
                yield self._edge(state, machine, outcome, holds)
            if is_open:
                for outcome in self.open_steps(machine, number):
                    yield self._edge(state, machine, outcome, holds)
        stopped = [hold is Hold.STOPPED for hold in holds]
        awaited = any(
            local.view.awaited > 0
            for is_stopped, local in zip(stopped, found, strict=True)
            if not is_stopped
        )
        busy = any(local.busy for moves, local in zip(moving, found, strict=True) if moves)
        if awaited and self.closed.unit and not busy:
            to = tuple(
                number if stopped[machine] else self.elapsed(machine, number)
                for machine, number in enumerate(state)
            )
            yield Edge((Step(Action.ELAPSE),), Mover.TIME, to, ())

    def is_deadlock(self, state: State) -> bool:
        """Whether nothing happens again in a state of a system, except for events under `may`."""
        holds = self.holds(state)
        counting = [
            (machine, number)
            for machine, number in enumerate(state)
            if holds[machine] is not Hold.STOPPED
        ]
        found = [self.local_states[machine][number] for machine, number in counting]
        if any(local.view.waiting for local in found):
            return False
        if any(
            local.view.awaited
            for (machine, _), local in zip(counting, found, strict=True)
            if not self._monitors[machine]
        ):
            return False
        for machine, number in counting:
            self.own_steps(machine, number)
            self.open_steps(machine, number)
        if any(local.view.faulted or local.busy or local.fair for local in found):
            return False
        return not all(local.view.at_rest for local in found)

    def holds(self, state: State) -> list[Hold]:
        """Return for each machine how its node holds it; see `ClosedSystem.holds`."""
        if not self.closed.freezers:
            return [Hold.RUNS] * self._count
        return self.closed.holds(self.snapshots(state))

    def _moving(self, state: State, holds: Sequence[Hold]) -> list[bool]:
        """Return the machines that may move if none has to react first."""
        schedule = self.closed.system.schedule
        if schedule is None:
            return [hold is Hold.RUNS for hold in holds]
        phase = self.local_states[-1][state[-1]].snapshot.configuration
        turn = next((m for at, m in self.closed.turns.items() if at in phase), None)
        moving = [
            hold is Hold.RUNS and (m == turn or m not in schedule.order)
            for m, hold in enumerate(holds)
        ]
        if turn is not None and moving[turn]:
            self.own_steps(turn, state[turn])
            moving[-1] = not self.local_states[turn][state[turn]].busy
        return moving

    def _edge(self, state: State, machine: int, outcome: Outcome, holds: Sequence[Hold]) -> Edge:
        to = list(state)
        to[machine] = self.intern(machine, outcome.after)
        marks = dict.fromkeys(self._noted(machine, outcome))
        for message in outcome.messages:
            if holds[message.target] is not Hold.STOPPED:
                self._deliver(to, message, marks)
        return Edge((outcome.step,), outcome.mover, tuple(to), tuple(marks))
