"""States and steps of a closed system, defined once for both engines.

**State.** A global state has a local state for each machine: active states, data and outputs,
histories, queue (deferred events included), timers with their remaining time, the invoked machines
with all of that, and inputs. The inputs of an open chart are arbitrary whenever it moves, so they
are state only if a property reads them. ``untimed``: a timer is only armed or not. A machine
stopped by a fault keeps configuration and data only. Dead data have their start values
(`verify.statespace.dead_variables`).

**Start.** All machines start at time 0, those of the environment first, then in the order of the
file. Outputs reach the connected inputs at once, here and after every step. Events sent during the
start reach the queues when all have started.

**Steps.** One step is one macrostep of one machine, or the passing of time. While a monitor has
events in its queue, only monitors move. Otherwise, while a machine of the environment has events,
only such machines move: the plant reacts at once. Otherwise each running machine can, by the order
of SEMANTICS:

* take eventless transitions that its inputs enable (*eventless*; then nothing else of this list),
* or take the next event of its queue (*take*),
* or, with an empty queue, fire the first expired timer (*fire*; untimed: any armed one, for a
  connection the oldest, and that counts as the passing of time), or take a spontaneous transition;
  a timer with an interval can fire from the minimum delay on, and does not stop time before the
  maximum;
* an external event occurs, and is taken at once, ahead of the queue (*occur*): that covers every
  position in the queue where it could have waited. This is possible while at most ``max_pending``
  events wait in all queues (usually `MAX_PENDING_BEFORE_INPUT`): machines communicate faster than
  anybody presses a button.

Time passes by the greatest common divisor of all delays (*elapse*) when no machine has work left
and some timer is armed. Steps of one machine that lead to the same state and messages, with other
choices, are one step. An external event without any effect is no step.

**Cyclic schedule.** A machine of the order moves, and takes external events, in its turn only:
earlier events have waited for that. All others (environment, monitors, connections) move as above.
`system.schedule` adds one more machine, the last one, which keeps turn and phase. It continues with
the next turn when the machine of this one has no work left. Between the turns of a period no time
passes. After the last turn it does, even if the machines of the order have work left.

**Nodes that freeze.** A machine of the environment keeps the state of a node (`system.freezes`).
While the node is frozen, its machines take no steps and no external events. Time passes for them,
and events from other machines wait in their queues, where ``max_pending`` does not count them. Once
the node is stopped for good, its machines do not change any more, no event is lost to them, and
deadlocks ignore them.

**Choices.** The result of an operation is chosen from the values of `chart.analysis.partition` when
it is called, an input of an open chart when a step reads it first; it keeps its value until the
step ends. Inputs that a step does not read have no effect on it. An input that is state is chosen
before each step. There is one step for each effect: among all choices with that effect, those that
come first if all inputs are chosen before all else, each in turn from its first value on. So the
order of steps is that of trying all combinations, however inputs are read.

**Livelock** is a cycle of *take*, *fire* and *eventless* (in an open chart, whose inputs anyone may
change, *eventless* does not count).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from fsmkit.chart.analysis.partition import COMBINED, Partition, Place, Use, Values
from fsmkit.chart.chart import Chart, Event, Transition
from fsmkit.chart.content import inputs_read, samples_inputs
from fsmkit.chart.walk import charts_within
from fsmkit.diagnostics import Span, fail
from fsmkit.document.document import Direction, Trigger
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Snapshot, Timeout, Timer
from fsmkit.system.free_inputs import with_free_inputs
from fsmkit.system.freezes import Hold, hold_of, with_freezers
from fsmkit.system.machine import FreeInput, Machine, Possible
from fsmkit.system.partition import field_of, partition_of
from fsmkit.system.properties.kinds.monitor import observer_chart, with_monitors
from fsmkit.system.properties.property import evaluated
from fsmkit.system.schedule import machines_by_turn, time_unit, with_scheduler
from fsmkit.system.starts import with_any_starts
from fsmkit.system.system import System
from fsmkit.verify.statespace.actions import UNHANDLED
from fsmkit.verify.statespace.dead_variables import ResettableVariable, resettable_variables
from fsmkit.verify.statespace.sessions import require_alone, require_explorable

MAX_PENDING_BEFORE_INPUT = 1
"""Events that may wait in all queues together when an external one occurs."""
UNLIMITED = 0xFFFFFFFF
"""A bound beyond all queues: external events never wait."""

MOST_IN_ZONES = 64
"""Machines of a system that is explored in dense time: a bit each in core/zones."""


@dataclass(frozen=True)
class ClosedSystem:
    """A system ready to be explored.

    ``charts`` are those of the machines with spontaneous transitions turned into events.
    ``results``: for each machine and operation with a result, its possible values. ``samples``: the
    sources of values that are only sampled, and why.
    """

    system: System
    charts: tuple[Chart, ...]
    possible: tuple[Possible, ...]
    free_inputs: tuple[FreeInput, ...]
    results: tuple[Mapping[str, tuple[Value, ...]], ...]
    kept_inputs: frozenset[int]
    """The inputs of an open chart that count as state, as a property reads them."""
    untimed: bool
    silent: bool
    """Transitions marked as watchdogs never fire."""
    unit: int
    """Ticks that pass at once; 0 if there is no delay."""
    samples: Mapping[str, Use]
    zones: bool = False
    """Time is dense, see ``core/zones/timed.h``; ``unit`` then only divides all delays."""
    covers: bool = False
    """Each taken transition and each entered state is marked, with a path to it."""
    mortal: tuple[tuple[ResettableVariable, ...], ...] = ()
    """For each machine the data that are reset where they are dead; empty: none of any."""
    max_pending: int = MAX_PENDING_BEFORE_INPUT
    """Events that may wait in all queues together when an external one occurs."""
    overflowing: tuple[int, ...] = ()
    """Machines whose queues were seen to overflow without a limit."""

    def __post_init__(self) -> None:
        """Reject systems that cannot be explored."""
        if self.zones and len(self.charts) > MOST_IN_ZONES:
            raise fail(
                "not-explored-yet",
                f"{len(self.charts)} machines are not explored by zones",
                help=f"keep to {MOST_IN_ZONES}, or use `--time discrete` or `--time untimed`",
            )
        beyond = zones_rejection(self.system) if self.zones and self.is_ordered else None
        if beyond is not None:
            why, span = beyond
            raise fail(
                "not-explored-yet",
                f"not explored by zones: {why}",
                span,
                help="use `--time discrete`, or `--time untimed`",
            )

    @cached_property
    def turns(self) -> Mapping[int, int]:
        """The machines that have their turn in states of the scheduler, the last machine.

        Empty without a cyclic schedule.
        """
        return machines_by_turn(self.system)

    @cached_property
    def observed_events(self) -> tuple[tuple[int, int], ...]:
        """The events, by machine and number, whose occurrence a property depends on."""
        atoms = (atom for property_ in self.system.properties for _, atom in property_.atoms)
        return tuple(sorted({(a.machine, a.event) for a in atoms if a.event is not None}))

    @cached_property
    def first_marks(self) -> tuple[int, ...]:
        """For each machine its first mark: queue full, fault, each unhandled event.

        For a suite of tests, then each taken transition and each entered state. The marks of the
        properties are before all of them, and mark 0 is a deadlock.
        """
        marks = [1 + len(evaluated(self.system.properties))]
        for chart in self.charts:
            covered = len(chart.transitions) + len(chart.states) if chart.transitions else 0
            own = UNHANDLED + 2 * len(chart.events) + (covered if self.covers else 0)
            marks.append(marks[-1] + own)
        return tuple(marks[:-1])

    @property
    def is_ordered(self) -> bool:
        """Whether the moves of machines are restricted by turns or freezing nodes."""
        return self.system.schedule is not None or bool(self.system.freezers)

    @cached_property
    def freezers(self) -> Mapping[int, int]:
        """For each machine that may freeze, the machine that keeps the state of its node."""
        return {
            machine: freezer.number
            for freezer in self.system.freezers
            for machine in freezer.frozen
        }

    def holds(self, snapshots: Sequence[Snapshot]) -> list[Hold]:
        """Return for each machine how its node holds it."""
        found = [Hold.RUNS] * len(snapshots)
        for machine, freezer in self.freezers.items():
            found[machine] = hold_of(self.charts[freezer], snapshots[freezer].configuration)
        return found

    @property
    def is_timeless(self) -> bool:
        """Whether there is no delay: then endless work need not stop time."""
        if self.system.schedule is not None:
            return False
        others = tuple(m for m in self.system.machines if not m.is_monitor)
        return time_unit(replace(self.system, machines=others)) == 0

    @property
    def keeps_inputs(self) -> bool:
        """Whether inputs of an open chart are state."""
        return bool(self.kept_inputs)

    @cached_property
    def read_inputs(self) -> Mapping[int, int]:
        """The indices of the free inputs that are chosen when a step reads them first.

        Those that are state are chosen before each step.
        """
        return {
            free.input: place
            for place, free in enumerate(self.free_inputs)
            if self.is_open and free.input not in self.kept_inputs
        }

    @property
    def is_open(self) -> bool:
        """Whether this is one chart alone."""
        return self.system.is_open

    @property
    def can_lose_events(self) -> bool:
        """Whether a queue may overflow only because external events do not wait."""
        from_outside = any(not each.spontaneous for each in self.possible)
        return from_outside and self.max_pending > MAX_PENDING_BEFORE_INPUT

    def never_fires(self, chart: Chart, timer: Timer) -> bool:
        """Whether an armed timer is assumed never to fire."""
        if self.silent and isinstance(timer.what, Timeout):
            return is_watchdog(chart, chart.transitions[timer.what.transition])
        return False

    def is_silent(self, machine: int, transition: int) -> bool:
        """Whether the timer of a transition is assumed never to fire."""
        chart = self.charts[machine]
        return self.silent and is_watchdog(chart, chart.transitions[transition])


def is_watchdog(chart: Chart, transition: Transition) -> bool:
    """Return whether a transition is a watchdog, and so is each that shares its timer."""
    if transition.timer is None:
        return transition.watchdog
    return all(t.watchdog for t in chart.alternatives[transition.timer])


def close(
    system: System,
    *,
    untimed: bool = False,
    silent: bool = False,
    zones: bool = False,
    covers: bool = False,
    keeps_dead: bool = False,
    observed: bool = False,
    enumerated: int = 0,
    max_pending: int = MAX_PENDING_BEFORE_INPUT,
) -> ClosedSystem:
    """Prepare a system for exploration. Raises `FsmkitError` if that is not possible.

    Without delays ``zones`` has no effect. ``keeps_dead``: no data are reset. ``observed``: the
    values that leave a machine are compared, so each is distinguished. ``enumerated``: as for
    `chart.analysis.partition.Partition`. ``max_pending``: unlimited without external events.
    """
    for machine in system.machines:
        require_explorable(machine.chart)
    system = with_free_inputs(with_any_starts(with_freezers(system)))
    system = with_scheduler(with_monitors(system), untimed=untimed)
    charts = tuple(_explored_chart(machine) for machine in system.machines)
    partition = partition_of(system, observed=observed, enumerated=enumerated)
    samples = dict(system.sampled)
    results = tuple(
        _results(number, machine, partition, samples)
        for number, machine in enumerate(system.machines)
    )
    possible = list(system.possible)
    free_inputs: tuple[FreeInput, ...] = ()
    if system.is_open:
        possible += _all_events(charts[0], partition, samples)
        free_inputs = _free_inputs(charts[0], partition, samples)
    nodes = {freezer.number for freezer in system.freezers}
    possible += [
        Possible(index, event.index, fair=index not in nodes, spontaneous=True)
        for index, (chart, machine) in enumerate(zip(charts, system.machines, strict=True))
        for event in chart.events[len(machine.chart.events) :]
    ]
    unit = 0 if untimed else time_unit(system)
    for machine in system.machines if zones and unit else ():
        way_out = "use `--time discrete`, or `--time untimed`"
        require_alone(machine.chart, "not explored in dense time", way_out)
    return ClosedSystem(
        system,
        charts,
        tuple(possible),
        free_inputs,
        results,
        kept_inputs=_inputs_of_properties(system) if system.is_open else frozenset(),
        untimed=untimed,
        silent=silent,
        unit=unit,
        samples=samples,
        zones=zones and unit > 0,
        covers=covers,
        mortal=() if keeps_dead else resettable_variables(system, charts, possible),
        max_pending=UNLIMITED if all(each.spontaneous for each in possible) else max_pending,
    )


def unexplored_system(system: System) -> ClosedSystem:
    """Return a system that is not explored, in the form that reports need."""
    return ClosedSystem(system, (), (), (), (), frozenset(), False, False, 0, {})


def zones_rejection(system: System) -> tuple[str, Span | None] | None:
    """Return why a system cannot be explored in dense time, and where; None if it can."""
    if system.schedule is not None:
        return "turns of a cyclic schedule come in discrete time", system.schedule.span
    for freezer in system.freezers:
        return f"the node `{freezer.machine.name}` may freeze", freezer.machine.span
    unit = time_unit(system)
    if len(system.machines) + len(system.monitors) > MOST_IN_ZONES and unit:
        last = system.machines[min(MOST_IN_ZONES, len(system.machines) - 1)]
        return f"it has {len(system.machines)} machines, more than {MOST_IN_ZONES}", last.span
    for machine in system.machines:
        for invocation in machine.chart.invocations if unit else ():
            return f"`{invocation.id}` is invoked by `{machine.chart.name}`", invocation.span
    return None


def _inputs_of_properties(system: System) -> frozenset[int]:
    """Return the inputs of an open chart that some property reads."""
    read = {name for one in system.properties for name in inputs_read(one.condition)}
    read |= {atom.variable for one in evaluated(system.properties) for _, atom in one.atoms}
    inputs = system.machines[0].chart.inputs
    return frozenset(n for n, declared in enumerate(inputs) if declared.name in read)


def _explored_chart(machine: Machine) -> Chart:
    """Return the chart of a machine in the form that is explored."""
    chart = without_spontaneous(machine.chart)
    looks = machine.is_monitor and samples_inputs(chart)
    return _with_passages(observer_chart(chart) if looks else chart)


def _with_passages(chart: Chart) -> Chart:
    """Return a chart whose last events, those of this exploration, no invoked machine knows."""
    count = len(chart.events)
    padded = tuple(
        replace(i, passages=i.passages + (None,) * (count - len(i.passages)))
        for i in chart.invocations
    )
    return replace(chart, invocations=padded) if padded else chart


def without_spontaneous(chart: Chart) -> Chart:
    """Return the chart with each ``sometimes`` transition on an event of its own."""
    found = [t for t in chart.transitions if t.trigger is Trigger.SOMETIMES]
    if not found:
        return chart
    events = list(chart.events)
    transitions = list(chart.transitions)
    for transition in found:
        name = f"sometimes.{transition.index}"
        transitions[transition.index] = replace(
            transition, trigger=Trigger.EVENT, events=(len(events),), descriptors=(name,)
        )
        events.append(Event(len(events), name, (), frozenset({Direction.IN})))
    return replace(chart, events=tuple(events), transitions=tuple(transitions))


def with_greatest_delays(chart: Chart) -> Chart:
    """Return the chart in the form for code generation: intervals become maximum delays."""
    return replace(chart, transitions=tuple(replace(t, least=None) for t in chart.transitions))


def _all_events(chart: Chart, partition: Partition, samples: dict[str, Use]) -> list[Possible]:
    found = []
    for event in chart.events:
        if Direction.IN not in event.directions or event.name.startswith("sometimes."):
            continue
        values = partition.payloads(
            [(part.type, field_of(0, event.index, n)) for n, part in enumerate(event.fields)]
        )
        _sampled(f"the payload of `{event.name}`", values, samples)
        for payload in values.values:
            assert isinstance(payload, tuple)  # noqa: S101  (a combination)
            found.append(Possible(0, event.index, payload))
    return found


def _free_inputs(
    chart: Chart, partition: Partition, samples: dict[str, Use]
) -> tuple[FreeInput, ...]:
    found: list[FreeInput] = []
    combinations = 1
    for index, declared in enumerate(chart.inputs):
        values = partition.values(declared.type, Place(0, "variable", declared.name))
        combinations *= len(values.values)
        if combinations > COMBINED:
            values = Values(values.values[:1], Use(f"makes more than {COMBINED:,} combinations"))
            combinations //= max(1, len(values.values))
        _sampled(f"the input `{declared.name}`", values, samples)
        if len(values.values) > 1:
            found.append(FreeInput(0, index, values.values))
    return tuple(found)


def _results(
    number: int, machine: Machine, partition: Partition, samples: dict[str, Use]
) -> Mapping[str, tuple[Value, ...]]:
    found: dict[str, tuple[Value, ...]] = {}
    operations = (o for chart in charts_within(machine.chart) for o in chart.operations)
    for operation in operations:
        if operation.result is None or operation.name in found:
            continue
        if operation.tried:
            found[operation.name] = operation.tried
            continue
        values = partition.values(operation.result, Place(number, "result", operation.name))
        _sampled(f"the result of `{operation.name}` of `{machine.name}`", values, samples)
        found[operation.name] = values.values
    return found


def _sampled(what: str, values: Values, samples: dict[str, Use]) -> None:
    if values.kept is not None:
        samples.setdefault(what, values.kept)
