"""A system: machines, the wires between them, what surrounds them, and what must hold of them.

Machines are numbered in the order of the file, properties likewise. A *port* of a machine is where
something leaves it: an event (its index in the chart) or an operation (after all events); from
`OBSERVED` on, an event that the machine is handed, for monitors.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Source, Span
from fsmkit.language import BOOL, Binary, BinaryOp, Expr, InState, Unary, UnaryOp, Value
from fsmkit.texts import guard, telling

OBSERVED = 1 << 16
"""The port of a machine by which monitors hear of its first event, whenever it occurs."""


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
    """It only watches the others, and moves before them (see `system.monitors`)."""
    span: Span | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "name")


@dataclass(frozen=True, slots=True)
class EventLink:
    """From a port to the queue of a machine.

    ``arguments`` tells for each field of the event which value of the port it takes.
    """

    source: int
    port: int
    target: int
    event: int
    arguments: tuple[int, ...] = ()


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

    ``owed``: it does come some time, if it stays possible (``will``). ``spontaneous``: it stands
    for a ``sometimes`` transition of the machine itself.
    """

    machine: int
    event: int
    payload: tuple[Value, ...] = ()
    owed: bool = False
    spontaneous: bool = False


class PropertyKind(Enum):
    """The kinds of properties."""

    INVARIANT = "invariant"
    NEVER = "never"
    REACHABLE = "reachable"
    DEADLOCK_FREE = "deadlock_free"
    LIVELOCK_FREE = "livelock_free"
    LEADS_TO = "leads_to"
    WITHIN = "within"
    RECOVERABLE = "recoverable"
    MONITOR = "monitor"


JUDGED_AT_STATES = {
    PropertyKind.INVARIANT,
    PropertyKind.NEVER,
    PropertyKind.REACHABLE,
    PropertyKind.MONITOR,
}
"""Those that are decided by whether a state is ever marked."""
TEMPORAL = {PropertyKind.RECOVERABLE, PropertyKind.LEADS_TO, PropertyKind.WITHIN}
"""Those that are decided over the graph; the states where their conditions hold are marked."""


@dataclass(frozen=True, slots=True)
class Atom:
    """What a name in a condition means: a state (``state``) or a variable of a machine.

    ``event``: whether the machine takes this event in the step that is judged.
    """

    machine: int
    state: int | None = None
    variable: str = ""
    event: int | None = None


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition, typed, and what its variables stand for."""

    expression: Expr
    atoms: tuple[tuple[str, Atom], ...]


@dataclass(frozen=True, slots=True)
class Property:
    """Something that shall hold. ``condition`` is given for those judged at states.

    ``goal`` is what one that is temporal must come to from where the condition holds.

    The variables of the condition are the names in ``atoms``, or, for the invariant of a state,
    those of the machine that is its ``owner``. ``unexplored`` says why no verdict can be given.
    """

    name: str
    kind: PropertyKind
    text: str
    condition: Expr | None = None
    atoms: tuple[tuple[str, Atom], ...] = ()
    owner: int | None = None
    unexplored: str = ""
    goal: Condition | None = None
    ticks: int = 0
    """Of `within`: the most that it may take."""
    span: Span | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "name", "text", "unexplored")

    @property
    def is_of_steps(self) -> bool:
        """Whether this is judged by steps and the states after them."""
        return any(atom.event is not None for _, atom in self.atoms)


def asked_events(properties: tuple[Property, ...]) -> tuple[tuple[int, int], ...]:
    """Return the events, by machine and number, of which some property asks whether they occur."""
    atoms = (atom for property_ in properties for _, atom in property_.atoms)
    return tuple(sorted({(a.machine, a.event) for a in atoms if a.event is not None}))


def judged(properties: tuple[Property, ...]) -> tuple[Property, ...]:
    """Return what states are marked for, in the order of the marks: properties, then goals."""
    goals = (
        replace(p, condition=p.goal.expression, atoms=p.goal.atoms)
        for p in properties
        if p.goal is not None
    )
    return (*properties, *goals)


def temporal_properties(
    properties: tuple[Property, ...], *, untimed: bool = False
) -> tuple[int, ...]:
    """Return the numbers of the properties that the graph decides; untimed: no times."""
    return tuple(
        number
        for number, p in enumerate(properties)
        if p.kind in TEMPORAL
        and not p.unexplored
        and not (untimed and p.kind is PropertyKind.WITHIN)
    )


def goal_place(properties: tuple[Property, ...], index: int) -> int:
    """Return the place of the goal of a property among what is judged."""
    return len(properties) + sum(p.goal is not None for p in properties[:index])


@dataclass(frozen=True, slots=True)
class Monitor:
    """A machine that watches for a property, and its wires; `system.monitors` gives it a number."""

    property: str
    machine: Machine
    event_links: tuple[EventLink, ...] = ()
    input_links: tuple[InputLink, ...] = ()


@dataclass(frozen=True, slots=True)
class Schedule:
    """The machines that run once a period, in this order; `system.schedule` tells more.

    ``period`` and ``jitter`` are ticks: a period begins up to the jitter later than it should.
    """

    order: tuple[int, ...]
    period: int
    jitter: int = 0
    span: Span | None = field(default=None, compare=False, repr=False)


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
    replaced: tuple[tuple[str, str], ...] = ()
    """Machines that run another chart than the file says, with the path of that chart."""
    monitors: tuple[Monitor, ...] = ()
    """Those that are no machines yet: nothing but an exploration has any use for them."""
    schedule: Schedule | None = None
    """None: interleaved."""
    source: Source | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "name")


def operation_port(chart: Chart, operation: str) -> int:
    """Return the port of an operation."""
    names = [declared.name for declared in chart.operations]
    return len(chart.events) + names.index(operation)


def system_of(chart: Chart) -> System:
    """Return the system of one chart alone, with the invariants of its states as properties."""
    properties = tuple(_invariants(0, Machine(chart.name, chart), prefix=""))
    return System(chart.name, (Machine(chart.name, chart),), properties=properties, is_open=True)


def state_invariants(machines: tuple[Machine, ...]) -> tuple[Property, ...]:
    """Return a property for each ``invariant`` of a state of one of several machines."""
    return tuple(
        found
        for index, machine in enumerate(machines)
        for found in _invariants(index, machine, prefix=f"{machine.name}.")
    )


def _invariants(index: int, machine: Machine, *, prefix: str) -> list[Property]:
    found = []
    for state in machine.chart.states:
        if state.invariant is None:
            continue
        span = state.invariant.span
        left = Unary(UnaryOp.NOT, InState(state.index, state.id, span), BOOL, span)
        condition = Binary(BinaryOp.OR, left, state.invariant, BOOL, span)
        name = f"{prefix}{state.id}.invariant"
        text = f"the invariant of `{prefix}{state.id}`"
        found.append(
            Property(name, PropertyKind.INVARIANT, text, condition, owner=index, span=span)
        )
    return found
