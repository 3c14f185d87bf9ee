"""The properties that a set of states can prove, and their truth at states and steps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from fsmkit.system.properties.property import AtStates, Builtin, Property
from fsmkit.verify.engines.python.evaluate import evaluate_property
from fsmkit.verify.statespace.actions import FAULT, FULL, UNHANDLED
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.global_steps import Edge, GlobalSteps, State


@dataclass(frozen=True, slots=True)
class Claim:
    """A property by its name and text, and how it is decided.

    ``decided``: the property that states or steps violate, deadlock, or the marks that violate it.
    None: a set of states cannot prove it.
    """

    name: str
    text: str
    decided: Property | Builtin | frozenset[int] | None = None


def claims_of(closed: ClosedSystem) -> Iterator[Claim]:
    """Yield the properties of a system, then those that are always decided."""
    deadlock = None if closed.is_open else Builtin.DEADLOCK
    for property_ in closed.system.properties:
        key = property_.kind.key
        match property_.kind.decided:
            case Builtin.DEADLOCK:
                yield Claim(property_.name, key, deadlock)
            case AtStates(existential=False):
                yield Claim(property_.name, f"{key}: {property_.text}", property_)
            case Builtin.LIVELOCK:
                yield Claim(property_.name, key)
            case _:
                yield Claim(property_.name, f"{key}: {property_.text}")
    listed = {p.kind.decided for p in closed.system.properties}
    if Builtin.DEADLOCK not in listed and closed.is_open:
        yield Claim("trap", "every state can be left or is marked rest")
    elif Builtin.DEADLOCK not in listed:
        yield Claim("deadlock", "there is always a next step", deadlock)
    if Builtin.LIVELOCK not in listed:
        yield Claim("livelock", "the machines never stay busy while no time passes")
    machines = closed.system.machines
    faults = frozenset(first + FAULT for first in closed.first_marks)
    yield Claim("faults", "no machine stops with a fault", faults)
    queues = frozenset(
        first + FULL
        for machine, first in zip(machines, closed.first_marks, strict=True)
        if machine.is_monitor or not closed.can_lose_events
    )
    if not closed.can_lose_events:
        yield Claim("queues", "no queue overflows", queues)
    elif queues:
        yield Claim("queues", "no queue of a monitor overflows", queues)


class Truth:
    """The truth of the claims at states and steps; ``claims`` are those that states can prove."""

    def __init__(self, steps: GlobalSteps) -> None:
        """Prepare to evaluate the claims of the system of ``steps``."""
        self.steps = steps
        self.closed = steps.closed
        self.claims = tuple(c for c in claims_of(steps.closed) if c.decided is not None)
        self._marks: dict[int, int] = {}
        self._of_states: list[tuple[int, Property, tuple[int, ...], dict[State, bool]]] = []
        self._of_steps: list[tuple[int, Property]] = []
        self._deadlocks: list[int] = []
        for number, claim in enumerate(self.claims):
            match claim.decided:
                case frozenset() as marks:
                    self._marks.update(dict.fromkeys(marks, number))
                case Property(is_of_steps=True) as property_:
                    self._of_steps.append((number, property_))
                case Property() as property_:
                    self._of_states.append((number, property_, machines_read(property_), {}))
                case _:
                    self._deadlocks.append(number)
        self._occurrences = {
            first_mark + UNHANDLED + len(self.closed.charts[machine].events) + event: (
                machine,
                event,
            )
            for machine, event in self.closed.observed_events
            for first_mark in (self.closed.first_marks[machine],)
        }

    def violated_by(self, state: State) -> set[int]:
        """Return the numbers of the claims that a state violates."""
        found = set()
        for number, property_, machines, known in self._of_states:
            read = tuple(state[machine] for machine in machines)
            if read not in known:
                snapshots = self.steps.snapshots(state)
                known[read] = evaluate_property(self.closed.charts, property_, snapshots)
            if known[read]:
                found.add(number)
        if self._deadlocks and self.steps.is_deadlock(state):
            found.update(self._deadlocks)
        return found

    def violated_in(self, edges: Iterable[Edge]) -> set[int]:
        """Return the numbers of the claims that some step violates."""
        found = set()
        for edge in edges:
            for mark in edge.marks:
                if mark in self._marks:
                    found.add(self._marks[mark])
            if self._of_steps:
                occurring = {self._occurrences[m] for m in edge.marks if m in self._occurrences}
                snapshots = self.steps.snapshots(edge.to)
                found.update(
                    number
                    for number, property_ in self._of_steps
                    if evaluate_property(self.closed.charts, property_, snapshots, occurring)
                )
        return found


def machines_read(property_: Property) -> tuple[int, ...]:
    """Return the machines whose states decide a property."""
    read = {atom.machine for _, atom in property_.atoms}
    # a condition in a chart may test states of the machine that owns it, without an atom
    return tuple(sorted(read | {property_.owner or 0}))
