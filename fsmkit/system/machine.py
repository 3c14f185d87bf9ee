"""The parts of a system: machines, and the wires between them.

A *port* of a machine is its output end: an event (its index in the chart) or an operation (after
all events). From `OBSERVED` on, ports are events that the machine handles, which monitors observe.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Span
from fsmkit.emit import guard, telling
from fsmkit.language import Field, Value

OBSERVED = 1 << 16
"""The port of a machine by which monitors observe its first event, whenever it occurs."""


@dataclass(frozen=True, slots=True)
class Slot:
    """A shared variable that a machine has a copy of: its index in the data of the chart.

    ``element``: for an array, the only element that the chart names.
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
    """An input, by index, that takes any of some values, with an optional minimum separation."""

    machine: int
    input: int
    values: tuple[Value, ...]
    apart: int = 0
    """Ticks between two changes, at least (see `system.board.with_boards`)."""
    any_start: bool = False
    """It starts with any value of its type, too."""


@dataclass(frozen=True, slots=True)
class Machine:
    """An instance of a chart.

    A machine of the environment reacts at once (see `verify.statespace.closed_system`).

    ``place``: for an element of an array of machines, the name of the array and its index.
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
    """A connection from a port to the queue of a machine.

    ``arguments`` are the values of the port for the fields of the event. ``priority``: on a bus
    that nodes share; None: after those that have one.
    """

    source: int
    port: int
    target: int
    event: int
    arguments: tuple[int, ...] = ()
    priority: int | None = None


@dataclass(frozen=True, slots=True)
class InputLink:
    """A connection from an output to an input (by index), copied after each step of the writer.

    After the outputs, and after the inputs, follow the machine's ``shared`` variables. For monitors
    all its data follow.
    """

    source: int
    output: int
    target: int
    input: int


@dataclass(frozen=True, slots=True)
class Possible:
    """An external event that can occur at any time.

    ``fair``: it occurs some time, if it stays possible (``will``). ``spontaneous``: it is a
    ``sometimes`` transition of the machine itself.
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
    """A machine that observes others for a property, and its wires.

    `system.properties.kinds.monitor` gives it a number.
    """

    property: str
    machine: Machine
    event_links: tuple[EventLink, ...] = ()
    input_links: tuple[InputLink, ...] = ()


def operation_port(chart: Chart, operation: str) -> int:
    """Return the port of an operation."""
    names = [declared.name for declared in chart.operations]
    return len(chart.events) + names.index(operation)


def port_name(chart: Chart, port: int) -> str:
    """Return the name of the event or operation of a port."""
    count = len(chart.events)
    return chart.events[port].name if port < count else chart.operations[port - count].name


def port_fields(chart: Chart, port: int) -> tuple[Field, ...]:
    """Return the fields of a port."""
    count = len(chart.events)
    return chart.events[port].fields if port < count else chart.operations[port - count].parameters
