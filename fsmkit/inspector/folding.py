"""Machines by their messages alone, as a client knows them: for entries without a known moment."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from msgspec import UNSET
from msgspec.structs import replace

from fsmkit.runtime.live.messages import AnyMessage, Json, Lost, Pass, Post, Row, Set, State, Step


@dataclass(frozen=True, slots=True)
class Folded:
    """All machines, in order; and the losses (by machine, ``""``: of any) since their state."""

    states: tuple[State, ...]
    lost: tuple[Lost, ...] = ()


@dataclass(slots=True)
class _Machine:
    """A machine that changes; ``base``: its last reported state."""

    base: State
    on: dict[str, None]
    changed: dict[str, Json]
    """The fields that differ from the base."""
    values: dict[str, Json]
    """Data and outputs that are not as in the base."""
    n: int
    at: int

    def step(self, step: Step) -> None:
        self.n, self.at = step.n, step.at
        on, changed = self.on, self.changed
        for row in step.do:
            if row[0] == "+":
                on[row[1]] = None
            elif row[0] == "-":
                on.pop(row[1], None)
        if step.set is not UNSET:
            self.values.update(step.set)
        if step.timers is not UNSET:
            changed["timers"] = step.timers
        if step.queue is not UNSET:
            changed["queue"] = step.queue
        elif step.cause[0] == "event":
            queue = changed.get("queue", self.base.queue)
            if queue and queue[0][0] == step.cause[1]:
                changed["queue"] = queue[1:]
        if step.deferred is not UNSET:
            changed["deferred"] = step.deferred
        if step.status is not UNSET:
            changed["status"] = step.status
        if step.fault is not UNSET:
            changed["fault"] = step.fault

    def add_event(self, message: Post | Pass, row: Row) -> None:
        """Take an event that came into the queue."""
        self.n, self.at = message.n, message.at
        self.changed["queue"] = [*self.changed.get("queue", self.base.queue), row]

    def drive(self, message: Set) -> None:
        """Take inputs and data that have other values."""
        self.n, self.at = message.n, message.at
        inputs = self.changed.get("inputs", self.base.inputs)
        self.changed["inputs"] = {**inputs, **message.inputs}
        self.values.update(message.data)

    def state(self) -> State:
        base, values = self.base, self.values
        told = {
            key: {**old, **{name: v for name, v in values.items() if name in old}}
            for key, old in (("data", base.data), ("outputs", base.outputs))
        }
        return replace(base, n=self.n, at=self.at, on=list(self.on), **told, **self.changed)


def _machine(state: State) -> _Machine:
    return _Machine(state, dict.fromkeys(state.on), {}, {}, state.n, state.at)


class Folding:
    """Applies messages in order; newly entered states are last in ``on``."""

    def __init__(self, before: Folded) -> None:
        """Start with the given machines."""
        self._machines = {state.m: _machine(state) for state in before.states}
        self._lost = {each.m: each for each in before.lost}

    def take(self, messages: Iterable[AnyMessage]) -> None:
        """Apply messages; those of unknown machines are ignored."""
        machines = self._machines
        for message in messages:
            if isinstance(message, Step):
                if message.m in machines:
                    machines[message.m].step(message)
                continue
            match message:
                case State() if message.m in machines:
                    machines[message.m] = _machine(message)
                    self._lost.pop(message.m, None)
                    if len(machines) == 1:
                        self._lost.clear()
                case Set() if message.m in machines:
                    machines[message.m].drive(message)
                case Post(how="queued") if message.m in machines:
                    machines[message.m].add_event(message, message.event)
                case Pass(how="queued", target=(name, event)) if name in machines:
                    machines[name].add_event(message, [event, *message.values])
                case Lost():
                    self._lost[message.m] = message
                    for name, machine in machines.items():
                        if message.m in ("", name):
                            machine.changed["known"] = False
                case _:
                    pass

    @property
    def folded(self) -> Folded:
        """The machines now."""
        states = tuple(machine.state() for machine in self._machines.values())
        return Folded(states, tuple(self._lost.values()))


def fold(before: Folded, messages: Iterable[AnyMessage]) -> Folded:
    """Return the machines after messages."""
    folding = Folding(before)
    folding.take(messages)
    return folding.folded
