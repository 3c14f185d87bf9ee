"""Follow a target by its trace records: a board, a program, or a file of a trace."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.inspector.simulation import Moment, SimulationStep
from fsmkit.inspector.sources import Entry
from fsmkit.language import Value
from fsmkit.runtime.interpreter import Macrostep, Occurrence, Snapshot, initial
from fsmkit.runtime.interpreter.snapshot import Start, Taken
from fsmkit.runtime.interpreter.trace import active_leaves
from fsmkit.runtime.live.messages import AnyMessage, Lost, Post, Row, Set, State, Step
from fsmkit.runtime.live.steps import row_of_event, rows_of, state_of, status_of, step_of
from fsmkit.runtime.live.values import to_json
from fsmkit.runtime.recording import machines_of
from fsmkit.runtime.tracing.following import (
    Changed,
    CompleteState,
    Divergence,
    Followed,
    HostNote,
    Missing,
    Posted,
    ReplayedStep,
)
from fsmkit.runtime.tracing.numbering import Numbering
from fsmkit.runtime.tracing.reading import Reader
from fsmkit.runtime.tracing.transports import ended
from fsmkit.system.machine import Machine
from fsmkit.system.system import System

MOST_AT_ONCE = 100
"""Maximum number of entries per call."""
PARTED = "replay-parts"
"""Value of `Lost.where` for a divergence of interpreter and target."""


class TraceEncoder:
    """Converts a trace to entries of the protocol `fsmkit.live`.

    Args:
        system: The traced machines.
        numbering_of: The numbering of an instance's chart, once it is known.
        grows: Whether unknown machines are added to the system.

    """

    def __init__(
        self,
        system: System,
        numbering_of: Callable[[int], Numbering | None],
        *,
        grows: bool = False,
    ) -> None:
        self.system = system
        self._grows = grows
        self._numbering_of = numbering_of
        self._machines: dict[int, int] = {}
        """By instance: the machine of the system."""
        self._snapshots: list[Snapshot | None] = [None for _ in system.machines]
        """Machines with known data."""
        self._states: list[Snapshot | None] = [None for _ in system.machines]
        """The states, where no more is known."""
        self._invoked: dict[tuple[int, int], Snapshot] = {}
        self.parted: list[str] = []
        """Divergences of the interpreter and the target."""

    def machine_of(self, instance: int) -> int | None:
        """Return the machine of an instance, or None if no machine of its chart is free.

        It is the machine with the number of the instance if the chart matches, else the first
        match.
        """
        numbering = self._numbering_of(instance)
        if instance not in self._machines and numbering is not None:
            charts = [machine.chart for machine in self.system.machines]
            taken = set(self._machines.values())
            places = [instance, *range(len(charts))]
            found = next(
                (
                    place
                    for place in places
                    if place < len(charts)
                    and place not in taken
                    and charts[place] is numbering.chart
                ),
                None,
            )
            if found is None and self._grows:
                found = self._grow(instance, numbering.chart)
            if found is not None:
                self._machines[instance] = found
        return self._machines.get(instance)

    def _grow(self, instance: int, chart: Chart) -> int:
        """Add a machine to the system."""
        names = {machine.name for machine in self.system.machines}
        name = f"{chart.name}_{instance}" if chart.name in names else chart.name
        machines = (*self.system.machines, Machine(name, chart))
        self.system = replace(self.system, machines=machines)
        self._snapshots.append(None)
        self._states.append(None)
        return len(machines) - 1

    def entry(self, told: Followed) -> Entry | None:
        """Return the entry of a trace item; None if no machine of the system is concerned."""
        if isinstance(told, Missing):
            self._snapshots = [None for _ in self._snapshots]
            self._states = [None for _ in self._states]
            return Entry(None, (Lost(n=0, at=told.at, count=told.count, where=told.where),))
        machine = self.machine_of(told.instance)
        if machine is None:
            return None
        chart, name = self.system.machines[machine].chart, self.system.machines[machine].name
        match told:
            case ReplayedStep(at, _, done, True):
                self._snapshots[machine] = done.after
                found: list[AnyMessage] = [step_of(chart, name, 0, done)]
                if isinstance(done.event, Start):  # nothing was known before
                    found.append(state_of(chart, name, 0, done.after, at))
                return Entry(self._moment(at), tuple(found), SimulationStep(machine, done, (), ()))
            case ReplayedStep(at, _, done, False, inner):
                return self._moved(machine, done, at, inner)
            case CompleteState(at, _, snapshot, is_known, invoked):
                self._snapshots[machine] = snapshot if is_known else None
                self._states[machine] = None if is_known else snapshot
                for number, each in enumerate(invoked, start=1):
                    self._put(machine, number, each)
                return Entry(self._moment(at), (self._state(machine, at),))
            case Posted(at, _, occurrence, fits, snapshot):
                self._keep(machine, snapshot)
                how = "queued" if fits else "refused"
                row = row_of_event(chart, occurrence)
                message: AnyMessage = Post(m=name, n=0, at=at, event=row, how=how)
                return Entry(self._moment(at), (message,))
            case Changed(at, _, place, value, snapshot):
                self._keep(machine, snapshot)
                declared = chart.inputs[place]
                inputs = {declared.name: to_json(value, declared.type)}
                return Entry(self._moment(at), (Set(m=name, n=0, at=at, inputs=inputs),))
            case Divergence(at, _, why):
                self.parted.append(f"{name} at {at}: {why}")
                self._snapshots[machine] = None
                return Entry(None, (Lost(n=0, at=at, count=0, where=PARTED, m=name),))
            case HostNote():
                return None
            case _:
                raise AssertionError(told)

    def _keep(self, machine: int, snapshot: Snapshot | None) -> None:
        if snapshot is not None:
            self._snapshots[machine] = snapshot

    def _put(self, machine: int, number: int, snapshot: Snapshot | None) -> None:
        self._invoked.pop((machine, number), None)
        if snapshot is not None:
            self._invoked[machine, number] = snapshot

    def _moment(self, at: int) -> Moment | None:
        """Return the system if it is fully known; a machine without records has not started."""
        told = set(self._machines.values())
        snapshots = []
        for place, machine in enumerate(self.system.machines):
            snapshot = self._snapshots[place]
            if snapshot is None and place in told:
                return None
            snapshots.append(initial(machine.chart) if snapshot is None else snapshot)
        count = len(snapshots)
        return Moment(at, tuple(snapshots), (1,) * count, ({},) * count)

    def _moved(self, machine: int, done: Macrostep, at: int, inner: int) -> Entry:
        """Return the entry of a state change of a machine with unknown data."""
        self._snapshots[machine] = None
        if inner:
            self._put(machine, inner, done.after)
            return Entry(None, (self._state(machine, at),))
        chart, name = self.system.machines[machine].chart, self.system.machines[machine].name
        self._states[machine] = done.after
        effects = done.effects
        taken = [effect.transition for effect in effects if isinstance(effect, Taken)]
        cause: Row = ["taken", *taken[:1]] if taken else ["start"]
        step = Step(
            m=name,
            n=0,
            at=at,
            cause=cause,
            do=[row for effect in effects for row in rows_of(chart, effect)],
            on=active_leaves(chart, done.after),
            status="finished" if done.after.finished else "running",
        )
        return Entry(None, (step,))

    def _state(self, machine: int, at: int) -> State:
        """Return all of a machine, as far as it is known."""
        chart, name = self.system.machines[machine].chart, self.system.machines[machine].name
        known = self._snapshots[machine]
        if known is not None:
            return state_of(chart, name, 0, known, at)
        snapshot = self._states[machine] or initial(chart)
        return State(
            m=name,
            n=0,
            at=at,
            on=[chart.states[state].id for state in sorted(snapshot.configuration - {0})],
            data={},
            inputs={},
            outputs={},
            queue=[],
            deferred=[],
            timers=[],
            status=status_of(snapshot),
            fault=snapshot.fault or "",
            invoked=self._leaves(machine),
            known=False,
        )

    def _leaves(self, machine: int) -> dict[str, list[str]]:
        """Return the active states of the machines in the slots of a machine."""
        chart, found, number = self.system.machines[machine].chart, {}, 1
        for invocation in chart.invocations:
            held = self._invoked.get((machine, number))
            if held is not None:
                found[invocation.id] = active_leaves(invocation.chart, held)
            number += len(machines_of(invocation.chart))
        return found


class Traced:
    """A `Followed` source of trace records."""

    time = "live"
    can: frozenset[str] = frozenset()

    def __init__(self, system: System, reader: Reader, *, ends: bool = False) -> None:
        """Follow a reader; ``ends``: the end of its source is final."""
        self.system = system
        self.begin: Moment | None = None
        self._reader = reader
        self._ends = ends
        self._coming: Iterator[Followed] = iter(())
        self.encoder = TraceEncoder(system, reader.stream.of.get)

    def receive(self) -> Sequence[Entry]:
        """Return the entries that have arrived; a large number is returned in parts."""
        told = list(islice(self._coming, MOST_AT_ONCE))
        if not told:
            self._coming = self._reader.followed()
            told = list(islice(self._coming, MOST_AT_ONCE))
        if not told and self._reader.is_over and self._ends:
            raise ended("the target closed the trace")
        found = (self.encoder.entry(each) for each in told)
        return [entry for entry in found if entry is not None]

    def post(self, machine: int, occurrence: Occurrence) -> None:
        """Reject the event: records are sent in one direction."""
        raise _sent_one_direction(machine, occurrence)

    def set_input(self, machine: int, place: int, value: Value) -> None:
        """Reject the input: records are sent in one direction."""
        raise _sent_one_direction(machine, place, value)

    def signals(self) -> Mapping[str, float]:
        """Return none."""
        return {}

    def close(self) -> None:
        """Close the source."""
        self._reader.close()


def _sent_one_direction(*refused: object) -> FsmkitError:
    del refused
    return fail(
        "wrong-command", "a trace is sent in one direction: its target cannot receive commands",
        help="start a branch here (`fork`), which runs in the interpreter",
    )  # fmt: skip


def numberings_of(system: System) -> tuple[Numbering, ...]:
    """Return the numberings of the charts of a system, each once."""
    charts = {id(machine.chart): machine.chart for machine in system.machines}
    return tuple(map(Numbering, charts.values()))
