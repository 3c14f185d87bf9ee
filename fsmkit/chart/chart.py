"""The Chart: a document with inheritance resolved, names bound and types known; frozen.

From here on no unread text and no unresolved name exists. States and transitions are in document
order and refer to each other by index; state 0 is the root.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from fsmkit.chart.statements import Block
from fsmkit.diagnostics import Source, Span, Text
from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.document.document import (
    HISTORIES,
    Direction,
    DocEnvironment,
    DocProperty,
    Kind,
    Origin,
    Trigger,
)
from fsmkit.emit import guard
from fsmkit.language import Expr, Field, FunctionBody, Literal, Type, Value, default_value


@fast_init
@dataclass(frozen=True, slots=True)
class State:
    """A state. ``children`` holds all of them, histories included, in document order.

    ``initial`` is the index of the transition taken on default entry: of a compound state (written
    or implied: to the first child) or the default of a history; None for every other kind.
    ``transitions`` are the event, eventless and timed ones, in priority order.
    """

    index: int
    id: str
    kind: Kind
    parent: int | None
    children: tuple[int, ...]
    initial: int | None
    transitions: tuple[int, ...]
    on_entry: tuple[Block, ...]
    on_exit: tuple[Block, ...]
    depth: int
    last_descendant: int
    """Descendants are exactly the indices ``index + 1 ... last_descendant``."""
    span: Span = field(compare=False, repr=False)
    defer: tuple[int, ...] = ()
    invariant: Expr | None = None
    rest: bool = False
    abstract: bool = False
    doc: str = ""
    req: tuple[Text, ...] = field(default=(), compare=False, repr=False)
    """The requirements that it implements, as in a transition, an operation and a chart."""
    origin: Origin = Origin.OWN
    done_data: tuple[Expr, ...] = ()
    """For a final state: the payload of its parent's ``done.state``, one expression per field.

    For a top-level one in an invoked chart: the payload of ``Chart.done``."""
    invokes: tuple[Block, ...] = ()
    """Run at the end of a macrostep that entered the state and did not leave it (SCXML 6.4)."""

    def __post_init__(self) -> None:
        guard(self, "id", "doc")

    @property
    def is_history(self) -> bool:
        """Whether this is a history pseudo-state."""
        return self.kind in HISTORIES

    @property
    def is_leaf(self) -> bool:
        """Whether this is an atomic state in the sense of Appendix D: active without a child."""
        return self.kind in (Kind.ATOMIC, Kind.FINAL, Kind.CHOICE)


OPEN_ENDED = 1 << 30
"""Ticks between the minimum and the maximum of an interval without an upper bound."""


@fast_init
@dataclass(frozen=True, slots=True)
class Transition:
    """A transition. ``events``: indices of all events it matches; ``descriptors``: as written.

    ``delay`` (type duration, in ticks, constant) is given for AFTER and EVERY only. In a chart of
    an environment that of an AFTER may be an interval, from ``least`` to ``delay``, or without an
    end: then ``delay`` is ``OPEN_ENDED`` later. No targets: a targetless transition, which exits
    and enters nothing. ``guard`` None is true.
    """

    index: int
    source: int
    trigger: Trigger
    events: tuple[int, ...]
    descriptors: tuple[str, ...]
    guard: Expr | None
    targets: tuple[int, ...]
    internal: bool
    content: Block
    span: Span = field(compare=False, repr=False)
    delay: int = 0
    delay_name: str | None = field(default=None, compare=False)
    """The constant that the delay is, if it is one."""
    delay_text: str | None = field(default=None, compare=False)
    """The delay as it was written, if it is a number with a unit."""
    least: int | None = None
    timer: int | None = None
    """The timer's number: the first transition that waits for it. None if it waits for none."""
    id: str | None = None
    watchdog: bool = False
    ordered: bool = False
    req: tuple[Text, ...] = field(default=(), compare=False, repr=False)
    origin: Origin = Origin.OWN

    def __post_init__(self) -> None:
        guard(self, "id", "descriptors")

    @property
    def is_open_ended(self) -> bool:
        """Whether the delay is an interval without an end."""
        return self.least is not None and self.delay == self.least + OPEN_ENDED

    @property
    def has_timer(self) -> bool:
        """Whether a timer has the number of this transition."""
        return self.timer == self.index


@dataclass(frozen=True, slots=True)
class Data:
    """A variable with its type and start value; an input starts at its type's least value."""

    name: str
    type: Type
    init: Literal
    span: Span = field(compare=False, repr=False)
    origin: Origin = Origin.OWN

    def __post_init__(self) -> None:
        guard(self, "name")


@dataclass(frozen=True, slots=True)
class Operation:
    """An operation the host implements.

    ``tried``: the results that ``fsmkit check`` is to try, where the chart names them.
    """

    name: str
    parameters: tuple[Field, ...]
    result: Type | None
    span: Span = field(compare=False, repr=False)
    origin: Origin = Origin.OWN
    tried: tuple[Value, ...] = ()
    req: tuple[Text, ...] = field(default=(), compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "name")

    @property
    def default(self) -> Value | None:
        """Its default result in tests: the first listed value, else the least one."""
        if self.result is None or self.tried:
            return self.tried[0] if self.tried else None
        return default_value(self.result)


@dataclass(frozen=True, slots=True)
class Event:
    """An event. ``directions`` is empty for platform events (``done.state.x``, ``error.*``).

    What an invoked machine sends is an event of its own for each ``invocation`` it comes from, so
    that several may have one name. Its ``finalize`` runs before transitions are selected for it
    (SCXML 6.5), while that invocation is active. If the chart reads ``_event.type``, raised and
    sent events of the same name are separate events.
    """

    index: int
    name: str
    fields: tuple[Field, ...]
    directions: frozenset[Direction]
    reply: Type | None = None
    span: Span | None = field(default=None, compare=False, repr=False)
    origin: Origin = Origin.OWN
    invocation: int | None = None
    finalize: Block = ()

    def __post_init__(self) -> None:
        guard(self, "name")

    @property
    def type(self) -> str:
        """Return ``_event.type``: ``platform``, ``internal`` or ``external`` (SCXML 5.10.1)."""
        if self.name.startswith(("error.", "done.")):
            return "platform"
        return "internal" if Direction.INTERNAL in self.directions else "external"


def for_the_host(event: Event) -> tuple[bool, bool]:
    """Return the greatest of the events that have one name for that of the host."""
    return event.invocation is None, event.directions != {Direction.INTERNAL}


@dataclass(frozen=True, slots=True)
class Passage:
    """The event of an invoked machine that an event maps to, with the sources of its fields.

    ``fields`` has, for each field of the event there, the position of the value here; None for a
    field that is not given.
    """

    event: int
    fields: tuple[int | None, ...]


@dataclass(frozen=True, slots=True)
class Invocation:
    """A slot for an invoked machine (SCXML 6.4): it holds one while that runs.

    Leaving ``state`` cancels it. ``given`` are the ``chart.data`` that `Invoke` sets. ``passages``:
    for each event of the invoking chart what it becomes in ``chart``, None if it cannot be received
    there. ``returns``: for each event of ``chart`` the one it becomes here, if it is sent here.
    """

    index: int
    state: int
    id: str
    chart: Chart
    given: tuple[int, ...]
    passages: tuple[Passage | None, ...]
    returns: tuple[int | None, ...]
    autoforward: bool = False
    span: Span | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "id")

    @property
    def answers(self) -> tuple[Passage | None, ...]:
        """By event of the invoked chart, its passage into this chart, with all fields."""
        return tuple(
            None if event is None else Passage(event, tuple(range(len(inner.fields))))
            for event, inner in zip(self.returns, self.chart.events, strict=True)
        )


@dataclass(frozen=True, slots=True)
class CopyOf:
    """A chart that fills a state: ``state`` is that one.

    ``name`` is the id of the state, with the dots of copies within copies. ``entries`` and
    ``exits``: entry points with what they enter, and the exit points. ``variables`` are the own
    ones of the copy, by name here, with their names in ``chart``; what is bound is not among them.
    """

    state: int
    name: str
    chart: str
    entries: tuple[tuple[str, tuple[int, ...]], ...] = ()
    exits: tuple[int, ...] = ()
    variables: tuple[tuple[str, str], ...] = ()
    span: Span | None = field(default=None, compare=False, repr=False)
    source: Source | None = field(default=None, compare=False, repr=False)
    is_folded: bool = False
    """In a chart to be drawn: of this copy, only the entry and exit points are shown."""
    path: str = ""
    """The active states in it, if it is folded."""
    count: int = 0
    """How many states are not drawn, if it is folded."""

    def __post_init__(self) -> None:
        guard(self, "name", "chart", "path")


@dataclass(frozen=True, slots=True)
class Capacities:
    """The bounds of a machine; reaching one is always reported."""

    queue: int = 8
    """Events in the external queue."""
    internal: int = 8
    """Events in the internal queue."""
    delayed: int = 4
    """Delayed sends pending at once."""
    microsteps: int = 100
    """Microsteps in one macrostep."""
    tick: int = 1000
    """Microseconds in a tick, the unit of all times and delays."""


@dataclass(frozen=True)
class Chart:
    """A complete, valid statechart: the input of interpreter, checks, drawing and lowering."""

    name: str
    states: tuple[State, ...]
    transitions: tuple[Transition, ...]
    events: tuple[Event, ...]
    data: tuple[Data, ...]
    inputs: tuple[Data, ...]
    outputs: tuple[Data, ...]
    operations: tuple[Operation, ...]
    capacities: Capacities
    types: tuple[Type, ...] = ()
    """Declared enumerations and records."""
    functions: tuple[FunctionBody, ...] = ()
    """Each calls only those before it."""
    constants: tuple[tuple[str, Literal], ...] = ()
    script: Block = ()
    """Executed once, before the initial states are entered (SCXML 5.8)."""
    lenient: bool = False
    """An unhandled ``error.*`` is only reported, as SCXML has it; otherwise it is a fault."""
    abstract: bool = False
    doc: str = ""
    req: tuple[Text, ...] = field(default=(), compare=False, repr=False)
    base: str | None = None
    """Name of the chart it extends."""
    invocations: tuple[Invocation, ...] = ()
    done: int | None = None
    """For an invoked chart: the event that it sends at its end (``done.invoke.id``)."""
    entries: tuple[tuple[str, tuple[int, ...]], ...] = ()
    """Entry points for charts that use this one: names with the states that they enter."""
    copies: tuple[CopyOf, ...] = ()
    """The copies of used charts, in document order; one within another follows it."""
    properties: tuple[DocProperty, ...] = ()
    """The properties, as written; `fsmkit.system.of_one_chart` reads them."""
    environment: DocEnvironment | None = None
    """The environment when it is explored alone, as written; None: everything."""
    sources: tuple[Source, ...] = field(default=(), compare=False, repr=False)
    """The file itself, then its bases."""

    def __post_init__(self) -> None:
        guard(self, "name", "doc", "base", "constants", "entries")

    @property
    def root(self) -> State:
        """The outermost state, SCXML's ``scxml`` element."""
        return self.states[0]

    @cached_property
    def state_index(self) -> dict[str, int]:
        """Indices of states by id."""
        return {state.id: state.index for state in self.states}

    @cached_property
    def alternatives(self) -> dict[int, tuple[Transition, ...]]:
        """For each timer, by number, the transitions that wait for it, in priority order."""
        found: dict[int, list[Transition]] = {}
        for transition in self.transitions:
            if transition.timer is not None:
                found.setdefault(transition.timer, []).append(transition)
        return {timer: tuple(waiting) for timer, waiting in found.items()}

    @cached_property
    def active_index(self) -> dict[str, int]:
        """Indices of the states that can be active, by id: of all but histories."""
        return {state.id: state.index for state in self.states if not state.is_history}

    @cached_property
    def event_index(self) -> dict[str, int]:
        """Indices of events by name; of several that have it, the one that the host may post."""
        return {event.name: event.index for event in sorted(self.events, key=for_the_host)}

    def is_descendant(self, state: int, ancestor: int) -> bool:
        """Whether ``state`` lies strictly below ``ancestor`` (Appendix D, isDescendant)."""
        return ancestor < state <= self.states[ancestor].last_descendant

    def ancestors(self, state: int) -> tuple[int, ...]:
        """Return the proper ancestors, nearest first, the root last."""
        found = []
        parent = self.states[state].parent
        while parent is not None:
            found.append(parent)
            parent = self.states[parent].parent
        return tuple(found)


def result_types(chart: Chart) -> dict[str, Type]:
    """Return the types of results by operation, for a chart and the charts that it invokes."""
    operations = every_operation(chart)
    return {name: one.result for name, one in operations.items() if one.result is not None}


def every_operation(chart: Chart) -> dict[str, Operation]:
    """Return the operations of a chart and of those it invokes, by name.

    Those of one name have the same types: one host performs all (`type_invokes`).
    """
    found = {operation.name: operation for operation in chart.operations}
    for invocation in chart.invocations:
        found = every_operation(invocation.chart) | found
    return found
