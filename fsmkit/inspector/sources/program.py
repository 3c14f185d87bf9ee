"""Follow a `Session` or `SystemSession` while a Python program runs it.

The program appends its steps to a queue and never waits. Another thread reads the queue.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from fsmkit.inspector.as_messages import MessageEncoder
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.simulation import InputChange, Moment, Simulation, SimulationStep
from fsmkit.inspector.sources import Entry
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Macrostep, Occurrence, Snapshot, Start
from fsmkit.runtime.live.messages import AnyMessage, Lost, Post, Set
from fsmkit.runtime.live.steps import row_of_event, state_of
from fsmkit.runtime.live.values import to_json
from fsmkit.runtime.session import Session
from fsmkit.runtime.system_session import SystemSession
from fsmkit.system.of_one_chart import system_of

MOST_WAITING = 50_000
"""Maximum number of queued changes; more are lost and counted."""
MOST_ASKED = 1_000
"""Commands that wait for the program."""


@dataclass(frozen=True, slots=True)
class _Change:
    """Steps of a machine in the program, and all machines after them."""

    now: int
    machine: int
    steps: tuple[Macrostep, ...]
    snapshots: tuple[Snapshot, ...]


@dataclass(frozen=True, slots=True)
class _Request:
    """A command of a client: an event, or a value for an input (``place``)."""

    machine: int
    occurrence: Occurrence | None = None
    place: int = 0
    value: Value = 0


class ProgramSource:
    """A `Followed` source: a session of a program.

    Args:
        session: The session to show; only the program's thread uses it.
        can: ``post`` and ``set``, if clients may command; the program then calls `obey`.

    """

    time = "live"

    def __init__(self, session: Session | SystemSession, can: frozenset[str] = frozenset()) -> None:
        self._session = session
        self.can = can
        self.system = system_of(session.chart) if isinstance(session, Session) else session.system
        self._simulation = Simulation(self.system)
        self._encoder = MessageEncoder(self._simulation)
        self._waiting: deque[_Change] = deque()
        self._asked: deque[_Request] = deque()
        self._lost = 0
        self._moment = replace(
            self._simulation.begin(), now=session.now, snapshots=_snapshots(session)
        )
        if any(map(_has_started, self._moment.snapshots)):
            self._moment = replace(self._moment, to_start=())
        self.begin: Moment | None = self._moment
        session.observers.append(self._observe)

    # --- in the thread of the program ----------------------------------------------------------

    def _observe(self, machine: int, steps: tuple[Macrostep, ...]) -> None:
        """Append a change of the program to the queue, without waiting."""
        if len(self._waiting) >= MOST_WAITING:
            self._lost += 1
            return
        change = _Change(self._session.now, machine, steps, _snapshots(self._session))
        self._waiting.append(change)

    def obey(self) -> int:
        """Execute the commands of clients since the last call; return their number.

        An event for a full queue is dropped.
        """
        count = 0
        while self._asked:
            asked, count = self._asked.popleft(), count + 1
            self._do(asked)
        return count

    def _do(self, asked: _Request) -> None:
        if isinstance(self._session, Session):
            if asked.occurrence is None:
                self._session.drive(asked.place, asked.value)
            else:
                self._session.enqueue(asked.occurrence)
            return
        name = self._simulation.names[asked.machine]
        if asked.occurrence is None:
            self._session.drive(name, asked.place, asked.value)
        else:
            self._session.enqueue(name, asked.occurrence)

    # --- as the hub sees it --------------------------------------------------------------------

    def receive(self) -> Sequence[Entry]:
        """Return the entries since the last call."""
        found: list[Entry] = []
        while self._waiting:
            found += self._entries(self._waiting.popleft())
        if self._lost:
            count, self._lost = self._lost, 0
            lost = Lost(n=0, at=self._moment.now, count=count, where="ring")
            found.append(Entry(None, (lost,)))
        return found

    def post(self, machine: int, occurrence: Occurrence) -> None:
        """Let the program post an event when it calls `obey`."""
        self._enqueue(_Request(machine, occurrence))

    def set_input(self, machine: int, place: int, value: Value) -> None:
        """Let the program set an input when it calls `obey`."""
        self._enqueue(_Request(machine, None, place, value))

    def _enqueue(self, asked: _Request) -> None:
        if len(self._asked) >= MOST_ASKED:
            raise wrong(
                f"{MOST_ASKED:,} commands wait for the program", "does it call `obey` in its loop?"
            )
        self._asked.append(asked)

    def signals(self) -> Mapping[str, float]:
        """Return nothing: there is no plant."""
        return {}

    def close(self) -> None:
        """Look no longer."""
        with suppress(ValueError):
            self._session.observers.remove(self._observe)

    # --- entries -------------------------------------------------------------------------------

    def _entries(self, change: _Change) -> Iterator[Entry]:
        """Yield the entries of a change; the system after the last is as the program had it."""
        whole = replace(self._moment, now=change.now, snapshots=change.snapshots)
        if not change.steps:
            messages = tuple(self._changed(change))
            self._moment = whole
            if messages:
                yield Entry(whole, messages)
            return
        machine, before = change.machine, self._moment.snapshots[change.machine]
        if any(isinstance(step.event, Start) for step in change.steps):
            to_start = tuple(each for each in self._moment.to_start if each != machine)
            self._moment = replace(self._moment, to_start=to_start)
        for number, step in enumerate(change.steps, 1):
            is_last = number == len(change.steps)
            moment, passed = self._simulation.deliver(self._after(machine, step), machine, (step,))
            driven: tuple[InputChange, ...] = ()
            if is_last:
                moment, driven = self._simulation.drive(moment, machine, before)
                to_start = self._moment.to_start
                moment = replace(whole, to_start=to_start)
            self._moment = moment
            stepped = SimulationStep(machine, step, passed, driven)
            yield Entry(moment, tuple(self._encoder.step(0, moment, stepped)), stepped)

    def _after(self, machine: int, step: Macrostep) -> Moment:
        snapshots = list(self._moment.snapshots)
        snapshots[machine] = step.after
        return replace(self._moment, now=step.at, snapshots=tuple(snapshots))

    def _changed(self, change: _Change) -> Iterator[AnyMessage]:
        """Yield a change without a step: a posted event or an input; else the machine's state."""
        machine = change.machine
        chart, name = self._simulation.charts[machine], self._simulation.names[machine]
        was, now = self._moment.snapshots[machine], change.snapshots[machine]
        queue = was.queue
        if len(now.queue) == len(queue) + 1 and now == replace(was, queue=now.queue, now=now.now):
            row = row_of_event(chart, now.queue[-1])
            yield Post(m=name, n=0, at=change.now, event=row, how="queued")
        elif now == replace(was, inputs=now.inputs, now=now.now):
            told = {
                declared.name: to_json(value, declared.type)
                for declared, old, value in zip(chart.inputs, was.inputs, now.inputs, strict=True)
                if old != value
            }
            if told:
                yield Set(m=name, n=0, at=change.now, inputs=told)
        else:
            yield state_of(chart, name, 0, now, change.now)


def _snapshots(session: Session | SystemSession) -> tuple[Snapshot, ...]:
    return (session.snapshot,) if isinstance(session, Session) else session.snapshots


def _has_started(snapshot: Snapshot) -> bool:
    return snapshot.running or snapshot.finished or snapshot.fault is not None
