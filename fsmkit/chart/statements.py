"""Executable content, typed: the statements of a Chart (SCXML 4, and what LANGUAGE adds)."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from fsmkit.diagnostics import Span
from fsmkit.language import Call, Expr, Location, Variable
from fsmkit.texts import guard


@dataclass(frozen=True, slots=True)
class Assign:
    """Store a value; its type is the location's (see `Convert`)."""

    location: Location
    value: Expr
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Raise:
    """Append an event to the internal queue. One argument for each declared field, in order."""

    event: int
    arguments: tuple[Expr, ...]
    span: Span = field(compare=False, repr=False)


class Destination(Enum):
    """Where a sent event goes."""

    SELF = "self"
    """The own external queue (SCXML's ``send`` without a target)."""
    INTERNAL = "internal"
    """The own internal queue (``#_internal``)."""
    PORT = "port"
    """Out of the machine: the host delivers it."""
    INVOKER = "invoker"
    """The external queue of the machine that invoked this one (``#_parent``)."""
    INVOKED = "invoked"
    """The external queue of a machine that this one invoked (``#_id``)."""


@dataclass(frozen=True, slots=True)
class Send:
    """Send an event, after ``delay`` ticks if given. ``id`` names it for `Cancel`.

    ``delay`` has type duration. ``peer`` is what was written after ``to``. ``invocations``: the
    slots that may hold the machine meant by it; the first that is running gets the event.
    """

    event: int
    arguments: tuple[Expr, ...]
    destination: Destination
    span: Span = field(compare=False, repr=False)
    delay: Expr | None = None
    id: str | None = None
    peer: str | None = None
    invocations: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        guard(self, "id", "peer")


@dataclass(frozen=True, slots=True)
class Cancel:
    """Drop every pending delayed send of that id."""

    id: str
    span: Span = field(compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "id")


@dataclass(frozen=True, slots=True)
class Log:
    """Tell the host: a label and values."""

    label: str
    values: tuple[Expr, ...]
    span: Span = field(compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "label")


@dataclass(frozen=True, slots=True)
class Branch:
    """A condition (None for ``else``) and what to do."""

    condition: Expr | None
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class If:
    """The first branch whose condition holds."""

    branches: tuple[Branch, ...]
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class ForEach:
    """Assign each element of a copy of ``array`` to ``item`` (and its position to ``index``)."""

    array: Variable
    item: Variable
    index: Variable | None
    body: tuple[Statement, ...]
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Reply:
    """Answer the event being dispatched; a later reply of the same macrostep replaces it."""

    value: Expr
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class CallOperation:
    """Call an operation for its effect; a result is dropped."""

    call: Call
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Fail:
    """Content that cannot be evaluated: ``error.execution``, and the rest of the block skipped.

    Where it is ``told``, the statement before has raised the error, and there is no other.
    """

    reason: str
    span: Span = field(compare=False, repr=False)
    told: bool = False

    def __post_init__(self) -> None:
        guard(self, "reason")


@dataclass(frozen=True, slots=True)
class Invoke:
    """Start the machine of an invocation (SCXML 6.4), some of its data with given values.

    One argument for each of ``Invocation.given``, in order. Stands only in ``State.invokes``.
    """

    invocation: int
    arguments: tuple[Expr, ...]
    span: Span = field(compare=False, repr=False)


Statement = (
    Assign | Raise | Send | Cancel | Log | If | ForEach | Reply | CallOperation | Fail | Invoke
)

Block = tuple[Statement, ...]
"""One handler: an error in it skips the rest of it, not the handlers after it (SCXML 4)."""
