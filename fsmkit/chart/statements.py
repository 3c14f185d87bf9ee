"""Executable content of a Chart: the statements of the language, typed (SCXML 4)."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import get_args, get_origin

from fsmkit.diagnostics import Span
from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.emit import guard
from fsmkit.language import Call, Expr, Iterated, Location, Variable
from fsmkit.language.statements.tree import (
    Assign,
    Branch,
    CallOperation,
    Fail,
    ForEach,
    If,
    KeywordStatement,
    Local,
    Log,
    Raise,
    Reply,
    Return,
)

__all__ = (
    "STATEMENTS",
    "Assign",
    "Block",
    "Branch",
    "CallOperation",
    "Cancel",
    "Destination",
    "Fail",
    "ForEach",
    "If",
    "Invoke",
    "KeywordStatement",
    "Local",
    "Log",
    "Raise",
    "Reply",
    "Return",
    "Send",
    "Statement",
)


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


@fast_init
@dataclass(frozen=True, slots=True)
class Send:
    """Send an event, after ``delay`` ticks if given. ``id`` names it for `Cancel`.

    ``delay`` has type duration. ``peer`` is the text after ``to``. ``invocations`` are the slots of
    the machines that it may name; the first running one gets the event.
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
class Invoke:
    """Start the machine of an invocation (SCXML 6.4), some of its data with given values.

    One argument for each of ``Invocation.given``, in order. Stands only in ``State.invokes``.
    """

    invocation: int
    arguments: tuple[Expr, ...]
    span: Span = field(compare=False, repr=False)


Statement = (
    Assign[Location, Expr]
    | Raise[int, Expr]
    | Send
    | Cancel
    | Log[str, Expr]
    | If[Expr, "Statement"]
    | ForEach[Iterated, Variable, "Statement"]
    | Reply[Expr]
    | Return[Expr]
    | Local[Variable, Expr]
    | CallOperation[Call]
    | Fail
    | Invoke
)
STATEMENTS = frozenset(get_origin(kind) or kind for kind in get_args(Statement))
"""The classes of statements."""

Block = tuple[Statement, ...]
"""One handler: an error in it skips the rest of it, not the handlers after it (SCXML 4)."""


def word_of(statement: Statement) -> str:
    """Return the word by which messages name a statement: its keyword, or that of its class."""
    return str(getattr(statement, "word", type(statement).__name__.lower()))
