"""A system: machines, the wires between them, what surrounds them, and what must hold of them.

Machines are numbered in the order of the file, properties likewise. A *port* of a machine is where
something leaves it: an event (its index in the chart) or an operation (after all events); from
`OBSERVED` on, an event that the machine is handed, for monitors.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from fsmkit.chart.analysis.partition import Use
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Source, Span
from fsmkit.emit import guard, telling
from fsmkit.language import Field, Value
from fsmkit.system.properties.kinds.invariant import invariants_of
from fsmkit.system.properties.property import Property

OBSERVED = 1 << 16
"""The port of a machine by which monitors observe its first event, whenever it occurs."""


@dataclass(frozen=True, slots=True)
class Slot:
    """A shared variable that a machine has a copy of: its place in the data of the chart.

    ``element``: of an array only this one is named there.
    """

    name: str
    data: int
    element: int | None = None

    def __post_init__(self) -> None:
        guard(self, "name")

    @telling
    def __str__(self) -> str:
        return self.name if self.element is None else f"{self.name}[{self.element}]"


@dataclass(frozen=True, slots=True)
class FreeInput:
    """An input, by index, that can have any of some values, at any time or some time apart."""

    machine: int
    input: int
    values: tuple[Value, ...]
    apart: int = 0
    """Ticks between two changes, at least (see `carriers.wires.promises`)."""
    any_start: bool = False
    """It starts with any value of its type, too."""


@dataclass(frozen=True, slots=True)
class Machine:
    """An instance of a chart.

    One of the environment answers at once (see `verify.statespace.closed_system`).

    ``place``: of an element of an array of machines, the name of the array and its index.
    """

    name: str
    chart: Chart
    environment: bool = False
    place: tuple[str, int] | None = None
    shared: tuple[Slot, ...] = ()
    is_channel: bool = False
    """This is a connection that holds or loses messages (see `system.links`)."""
    is_monitor: bool = False
    """It only watches the others, and moves before them (see `system.properties.kinds.monitor`)."""
    started: tuple[str, ...] = ()
    """The data and inputs to which the system gives start values."""
    any_start: tuple[str, ...] = ()
    """Those of them that start from any value (see `system.starts`)."""
    drives: FreeInput | None = None
    """It only sets this input of another machine (see `system.free_inputs`)."""
    span: Span | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "name", "started", "any_start")


@dataclass(frozen=True, slots=True)
class EventLink:
    """From a port to the queue of a machine.

    ``arguments`` gives for each field of the event which value of the port it takes. ``priority``:
    on a bus that nodes share; None: after those that have one.
    """

    source: int
    port: int
    target: int
    event: int
    arguments: tuple[int, ...] = ()
    priority: int | None = None


@dataclass(frozen=True, slots=True)
class InputLink:
    """From an output (by index) to an input (by index), copied after each step of the writer.

    After the outputs, and after the inputs, a machine's ``shared`` variables are counted; where
    monitors read, then all its data.
    """

    source: int
    output: int
    target: int
    input: int


@dataclass(frozen=True, slots=True)
class Possible:
    """An event that can come from outside at any time.

    ``fair``: it does come some time, if it stays possible (``will``). ``spontaneous``: it stands
    for a ``sometimes`` transition of the machine itself.
    """

    machine: int
    event: int
    payload: tuple[Value, ...] = ()
    fair: bool = False
    spontaneous: bool = False
    apart: int = 0
    """Ticks between two of them, at least, whatever the payload."""


@dataclass(frozen=True, slots=True)
class Monitor:
    """A machine that watches for a property, and its wires.

    `system.properties.kinds.monitor` gives it a number.
    """

    property: str
    machine: Machine
    event_links: tuple[EventLink, ...] = ()
    input_links: tuple[InputLink, ...] = ()


@dataclass(frozen=True, slots=True)
class Schedule:
    """The machines that run once a period, in this order; see `system.schedule`.

    ``period`` and ``jitter`` are ticks: a period begins up to the jitter later than it should.
    """

    order: tuple[int, ...]
    period: int
    jitter: int = 0
    span: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Freezer:
    """A node that may freeze: the machine that keeps its state, and those that take no steps then.

    ``silent``: the events, by machine and number, by which others notice it, ``within`` the least
    and the greatest ticks. ``continues``: ticks after which it does so no more; None: it never
    does. See `system.freezes`.
    """

    machine: Machine
    frozen: tuple[int, ...]
    silent: tuple[tuple[int, int], ...] = ()
    within: tuple[int, int] = (0, 0)
    continues: int | None = None
    number: int = 0
    """The number of its machine, by which properties name it; see `system.freezes`."""


@dataclass(frozen=True)
class System:
    """Charts, closed. ``is_open``: one chart alone, to which everything may come from outside."""

    name: str
    machines: tuple[Machine, ...]
    event_links: tuple[EventLink, ...] = ()
    input_links: tuple[InputLink, ...] = ()
    possible: tuple[Possible, ...] = ()
    properties: tuple[Property, ...] = ()
    is_open: bool = False
    of_chart: bool = False
    """It is one chart alone, open or not: a chart is compiled, not a system."""
    free_inputs: tuple[FreeInput, ...] = ()
    sampled: tuple[tuple[str, Use], ...] = ()
    """Of what in these two not every value that makes a difference is there, and why."""
    replaced: tuple[tuple[str, str], ...] = ()
    """Machines that run another chart than the file says, with the path of that chart."""
    parameters: tuple[tuple[str, str], ...] = ()
    """The parameters of the file, with their values in this system."""
    monitors: tuple[Monitor, ...] = ()
    """Those that are no machines yet: nothing but an exploration has any use for them."""
    schedule: Schedule | None = None
    """None: interleaved."""
    freezers: tuple[Freezer, ...] = ()
    """Nodes that may freeze: no machines yet, as nothing but an exploration uses them."""
    wires: tuple[str, ...] = ()
    """Files of the wires that narrow its environment (see `carriers.wires.promises`)."""
    assumed: tuple[str, ...] = ()
    """On what else, in words, a proof of it rests."""
    source: Source | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "name")


def state_properties(system: System) -> tuple[Property, ...]:
    """Return the properties that states of its machines decide.

    Those of monitors, and of nodes that may freeze, have a meaning in an exploration only.
    """
    nodes = {freezer.number for freezer in system.freezers}
    return tuple(
        each
        for each in system.properties
        if each.condition is not None and nodes.isdisjoint(atom.machine for _, atom in each.atoms)
    )


def part_of(system: System, numbers: tuple[int, ...]) -> System:
    """Return some machines of a system as one, with what connects them and what may come."""
    here = {number: place for place, number in enumerate(numbers)}
    events = (
        replace(link, source=here[link.source], target=here[link.target])
        for link in system.event_links
        if link.source in here and link.target in here
    )
    inputs = (
        replace(link, source=here[link.source], target=here[link.target])
        for link in system.input_links
        if link.source in here and link.target in here
    )
    possible = (
        replace(each, machine=here[each.machine])
        for each in system.possible
        if each.machine in here
    )
    return System(
        system.name,
        tuple(system.machines[number] for number in numbers),
        tuple(events),
        tuple(inputs),
        tuple(possible),
        source=system.source,
    )


def operation_port(chart: Chart, operation: str) -> int:
    """Return the port of an operation."""
    names = [declared.name for declared in chart.operations]
    return len(chart.events) + names.index(operation)


def port_name(chart: Chart, port: int) -> str:
    """Return the name of the event or operation that leaves by a port."""
    count = len(chart.events)
    return chart.events[port].name if port < count else chart.operations[port - count].name


def port_fields(chart: Chart, port: int) -> tuple[Field, ...]:
    """Return the values that leave by a port."""
    count = len(chart.events)
    return chart.events[port].fields if port < count else chart.operations[port - count].parameters


def system_of(chart: Chart) -> System:
    """Return the system of one chart alone, with the invariants of its states as properties."""
    properties = tuple(invariants_of(chart, 0, prefix=""))
    machines = (Machine(chart.name, chart),)
    return System(chart.name, machines, properties=properties, is_open=True, of_chart=True)
