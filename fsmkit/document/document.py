"""The Document: the content of one file, as names and unread texts with locations.

Front ends read and write Documents; nothing else reads source text. Statements are structured (both
notations share them), expressions are still text.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from fsmkit.diagnostics import Source, Span, Text
from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.language.statements.tree import Block, DocArgument, DocField


class Kind(Enum):
    """The kind of a state. `COMPOUND` and `ATOMIC` differ only in having children."""

    ATOMIC = "atomic"
    COMPOUND = "compound"
    PARALLEL = "parallel"
    FINAL = "final"
    SHALLOW_HISTORY = "shallow history"
    DEEP_HISTORY = "deep history"
    CHOICE = "choice"
    """A transient state, left by eventless transitions, the last of which has no guard."""


HISTORIES = (Kind.SHALLOW_HISTORY, Kind.DEEP_HISTORY)
"""The history pseudo-states."""


class Origin(Enum):
    """The origin of an item of a derived chart."""

    OWN = "own"
    INHERITED = "inherited"
    OVERRIDDEN = "overridden"


class Trigger(Enum):
    """The trigger of a transition."""

    EVENT = "event"
    EVENTLESS = "eventless"
    AFTER = "after"
    """Once, a delay after its source state was entered."""
    EVERY = "every"
    """Repeatedly, a delay after its source state was entered or its timer last expired."""
    SOMETIMES = "sometimes"
    """At any time: only for charts that describe an environment."""
    INITIAL = "initial"
    """The transition of an initial pseudo-state or the default of a history; always taken."""


# --- declarations -----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class DocMember:
    """A member of an enumeration, and its number where one is given."""

    name: Text
    number: Text | None = None


def read_member(text: Text) -> DocMember:
    """Return a member as declared: ``hot`` or ``hot = 4``."""
    at = text.value.find("=")
    if at < 0:
        return DocMember(text.strip())
    return DocMember(text.part(0, at).strip(), text.part(at + 1, len(text.value)).strip())


@dataclass(frozen=True, slots=True)
class DocType:
    """A named type: an enumeration (members), a record (fields) or another name (same)."""

    name: Text
    members: tuple[DocMember, ...] = ()
    fields: tuple[DocField, ...] = ()
    same: Text | None = None
    """The type that this is another name for."""
    origin: Origin = Origin.OWN


@dataclass(frozen=True, slots=True)
class DocFunction:
    """A function and its statements; one that only returns is written as its value."""

    name: Text
    parameters: tuple[DocField, ...]
    result: Text | None
    body: Block
    origin: Origin = Origin.OWN


@dataclass(frozen=True, slots=True)
class DocConstant:
    """A named constant expression."""

    name: Text
    value: Text
    origin: Origin = Origin.OWN


@dataclass(frozen=True, slots=True)
class DocData:
    """A variable: data, input or output. Type or start value may be absent, not both for data."""

    name: Text
    type: Text | None
    init: Text | None
    origin: Origin = Origin.OWN


@dataclass(frozen=True, slots=True)
class DocOperation:
    """An operation of the host."""

    name: Text
    parameters: tuple[DocField, ...]
    result: Text | None
    origin: Origin = Origin.OWN
    req: tuple[Text, ...] = ()


class Direction(Enum):
    """The direction of a declared event."""

    IN = "in"
    OUT = "out"
    INTERNAL = "internal"


@dataclass(frozen=True, slots=True)
class DocEvent:
    """A declared event; one listed under both ``in`` and ``out`` appears twice."""

    name: Text
    fields: tuple[DocField, ...]
    direction: Direction
    reply: Text | None = None
    origin: Origin = Origin.OWN


@dataclass(frozen=True, slots=True)
class DocCapacity:
    """A bound: ``queue``, ``internal``, ``delayed``, ``microsteps``, or ``tick`` (a duration)."""

    name: Text
    value: Text
    origin: Origin = Origin.OWN


# --- states and transitions -------------------------------------------------------------------


@fast_init
@dataclass(frozen=True, slots=True)
class DocTransition:
    """A transition as written.

    ``first`` and ``override`` apply only in a derived chart. ``first`` puts a transition before the
    inherited ones; ``override`` is ``true`` or the id of the replaced one. ``content`` is None if
    absent (in an override: keep the base's).
    """

    trigger: Trigger
    span: Span = field(compare=False, repr=False)
    events: tuple[Text, ...] = ()
    delay: Text | None = None
    guard: Text | None = None
    targets: tuple[Text, ...] = ()
    internal: bool = False
    content: Block | None = None
    id: Text | None = None
    watchdog: bool = False
    ordered: bool = False
    """The order of overlapping transitions is intended: no ``nondeterministic-choice``."""
    req: tuple[Text, ...] = ()
    first: bool = False
    override: Text | None = None
    origin: Origin = Origin.OWN
    super_guards: tuple[Text | None, ...] = ()
    """The guards that this one replaces, nearest base first: the meaning of ``super``."""


@dataclass(frozen=True, slots=True)
class DocInvoke:
    """An invoked chart (SCXML 6.4).

    ``types`` and ``sources`` list all values of the expressions, each with its condition.
    ``loaded`` holds the charts by source, each with its bases; an inline chart has an empty name.
    """

    span: Span = field(compare=False, repr=False)
    id: Text | None = None
    id_location: Text | None = None
    type: Text | None = None
    type_expr: Text | None = None
    src: Text | None = None
    src_expr: Text | None = None
    autoforward: bool = False
    arguments: tuple[DocArgument, ...] = ()
    name_list: tuple[Text, ...] = ()
    content: Document | None = None
    content_expr: Text | None = None
    finalize: Block | None = None
    types: tuple[tuple[Text | None, Text], ...] = field(default=(), compare=False, repr=False)
    sources: tuple[tuple[Text | None, Text], ...] = field(default=(), compare=False, repr=False)
    loaded: tuple[tuple[str, tuple[Document, ...]], ...] = field(
        default=(), compare=False, repr=False
    )


@dataclass(frozen=True, slots=True)
class DocExit:
    """The continuation of an exit point of a used chart: eventless transitions, as in a choice."""

    name: Text
    transitions: tuple[DocTransition, ...]


@dataclass(frozen=True, slots=True)
class DocUse:
    """The chart that fills a state, and its bindings.

    ``chart`` is its file; None under ``refine``, where an inherited use is changed. ``constants``
    and ``start`` are values of its constants and start values of its data. ``bind`` maps its names
    to names here. ``reset``: default entry sets the start values again. ``loaded`` holds the chart
    and its bases, nearest first.
    """

    span: Span = field(compare=False, repr=False)
    chart: Text | None = None
    reset: bool = False
    constants: tuple[DocArgument, ...] = ()
    start: tuple[DocArgument, ...] = ()
    bind: tuple[DocArgument, ...] = ()
    exits: tuple[DocExit, ...] = ()
    loaded: tuple[Document, ...] = field(default=(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class DocEntry:
    """An entry point: a name for states that are entered together when the chart is used."""

    name: Text
    targets: tuple[Text, ...]
    origin: Origin = Origin.OWN


@dataclass(frozen=True, slots=True)
class DocProperty:
    """A property of the chart, as written; `fsmkit.system.properties` interprets it.

    ``first`` and ``then`` are its conditions, ``time`` the duration between them. For a monitor,
    ``first`` is its chart and ``watch`` lists its observations. A ``kind`` without conditions has
    none of these.
    """

    name: Text
    kind: Text
    first: Text | None = None
    time: Text | None = None
    then: Text | None = None
    watch: tuple[Text, ...] = ()
    origin: Origin = Origin.OWN
    req: tuple[Text, ...] = field(default=(), compare=False)
    """The requirements that it states; fingerprints of charts, which hold this, ignore them."""


@dataclass(frozen=True, slots=True)
class DocEnvironment:
    """The environment of a chart that is explored alone: events, and inputs that change.

    ``may``: at any time. ``will``: the same, and eventually, if it stays possible.
    """

    may: tuple[Text, ...] = ()
    will: tuple[Text, ...] = ()
    span: Span | None = field(default=None, compare=False, repr=False)


REPLACEABLE = ("entry", "exit", "initial", "default", "invariant", "use", "exits")
"""Properties of an inherited state that a mark replaces; ``default`` is that of a history."""


@fast_init
@dataclass(frozen=True, slots=True)
class DocState:
    """A state as written; under ``refine`` a change of the inherited state with the same id.

    ``kind`` is as written; ATOMIC and COMPOUND are distinguished later. ``initial`` and the default
    of a history are transitions of trigger INITIAL. ``overrides`` names the properties that are
    replaced without containing ``super``.
    """

    id: Text | None
    kind: Kind
    span: Span = field(compare=False, repr=False)
    initial: DocTransition | None = None
    children: tuple[DocState, ...] = ()
    transitions: tuple[DocTransition, ...] = ()
    entry: tuple[Block, ...] = ()
    exit: tuple[Block, ...] = ()
    data: tuple[DocData, ...] = ()
    defer: tuple[Text, ...] = ()
    invokes: tuple[DocInvoke, ...] = ()
    done_data: tuple[DocArgument, ...] = ()
    done_content: Text | None = None
    """``donedata/content@expr``; literal content as a quoted literal."""
    invariant: Text | None = None
    rest: bool = False
    abstract: bool = False
    overrides: frozenset[str] = frozenset()
    doc: str = ""
    req: tuple[Text, ...] = ()
    origin: Origin = Origin.OWN
    use: DocUse | None = None
    index_range: Text | None = None
    """``i in 0..1``: an array with one state for each value of the index."""
    copy: int | None = field(default=None, compare=False, repr=False)
    """The copy that fills the state, or that the state is a part of; elaboration counts them."""
    copied: int | None = field(default=None, compare=False, repr=False)
    """For a part of a copy: the index of the state in the used chart."""


@dataclass(frozen=True, slots=True)
class Document:
    """One file. ``root`` is the nameless outermost state; its children are the top-level states.

    With ``extends``, ``root.children`` are new top-level states and ``refine`` changes of
    inherited ones. ``datamodel`` is ``fsmkit``, ``ecmascript`` or ``null``.
    """

    source: Source = field(compare=False, repr=False)
    name: Text
    root: DocState
    extends: Text | None = None
    abstract: bool = False
    datamodel: str = "fsmkit"
    late_binding: bool = False
    doc: str = ""
    req: tuple[Text, ...] = ()
    types: tuple[DocType, ...] = ()
    constants: tuple[DocConstant, ...] = ()
    data: tuple[DocData, ...] = ()
    inputs: tuple[DocData, ...] = ()
    outputs: tuple[DocData, ...] = ()
    operations: tuple[DocOperation, ...] = ()
    functions: tuple[DocFunction, ...] = ()
    events: tuple[DocEvent, ...] = ()
    capacities: tuple[DocCapacity, ...] = ()
    script: Block = ()
    entries: tuple[DocEntry, ...] = ()
    properties: tuple[DocProperty, ...] = ()
    environment: DocEnvironment | None = None
    overrides: tuple[Text, ...] = ()
    """Inherited properties that are replaced, or ``environment``."""
    refine: tuple[DocState, ...] = ()
    posted: tuple[Text, ...] = field(default=(), compare=False, repr=False)
    """Prefixes of event names that only the host posts."""
