"""Statements and declarations as written: expressions are unread text, each with its place.

YAML and SCXML know the same ones. Reading is in `reading`, writing in `writing`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from fsmkit.diagnostics import Span, Text


@dataclass(frozen=True, slots=True)
class DocAssign:
    """``location = value``; ``operator`` is ``+``, ``-`` ... for ``location += value``."""

    location: Text
    value: Text
    span: Span = field(compare=False, repr=False)
    operator: str = ""


@dataclass(frozen=True, slots=True)
class DocArgument:
    """``name = value`` of a payload (SCXML ``param``)."""

    name: Text
    value: Text


@dataclass(frozen=True, slots=True)
class DocRaise:
    """Put an event in the internal queue."""

    event: Text
    arguments: tuple[DocArgument, ...]
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class DocSend:
    """Send an event, at once or later. What is absent is None; ``*_expr`` are expressions."""

    span: Span = field(compare=False, repr=False)
    event: Text | None = None
    event_expr: Text | None = None
    target: Text | None = None
    target_expr: Text | None = None
    delay: Text | None = None
    """A duration literal or a named constant of type duration."""
    delay_expr: Text | None = None
    id: Text | None = None
    id_location: Text | None = None
    type: Text | None = None
    type_expr: Text | None = None
    arguments: tuple[DocArgument, ...] = ()
    name_list: tuple[Text, ...] = ()
    content: Text | None = None
    content_expr: Text | None = None


SENT = (
    ("event", "event_expr"),
    ("target", "target_expr"),
    ("delay", "delay_expr"),
    ("id", "id_location"),
    ("type", "type_expr"),
)
"""Fields of `DocSend`, and those of the expressions or places that stand for them."""


@dataclass(frozen=True, slots=True)
class DocCancel:
    """Cancel a delayed send by its id (or the value of an expression)."""

    id: Text | None
    id_expr: Text | None
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class DocLog:
    """Tell the host: a label and values."""

    label: Text | None
    values: tuple[Text, ...]
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class DocBranch:
    """A condition (None for ``else``) and what to do."""

    condition: Text | None
    body: tuple[DocStatement, ...]


@dataclass(frozen=True, slots=True)
class DocIf:
    """``if`` / ``else if`` / ``else``."""

    branches: tuple[DocBranch, ...]
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class DocForEach:
    """Iterate over a copy of an array; ``index`` may be absent."""

    array: Text
    item: Text
    index: Text | None
    body: tuple[DocStatement, ...]
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class DocValued:
    """A word and an expression; in SCXML an element of that name in our namespace, with `expr`.

    Reading and writing such a statement, in both notations, needs its class alone.
    """

    word: ClassVar[str]
    value: Text
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class DocReply(DocValued):
    """Answer the event being dispatched."""

    word = "reply"


VALUED = {kind.word: kind for kind in (DocReply,)}
"""All of these, by their words."""


@dataclass(frozen=True, slots=True)
class DocCall:
    """A call of an operation for its effect; the text is the whole call expression."""

    call: Text
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class DocSuper:
    """``super``: here stand the statements of the base chart."""

    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class DocUnreadable:
    """Content that could not be read; by SCXML it is an ``error.execution`` when executed."""

    reason: str
    span: Span = field(compare=False, repr=False)


DocStatement = (
    DocAssign
    | DocRaise
    | DocSend
    | DocCancel
    | DocLog
    | DocIf
    | DocForEach
    | DocReply
    | DocCall
    | DocSuper
    | DocUnreadable
)

Block = tuple[DocStatement, ...]
"""One handler: an error in it skips the rest of it, not the handlers after it (SCXML 4)."""


# --- declarations -----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class DocField:
    """``name type``. The type is absent where it is to be inferred (SCXML)."""

    name: Text
    type: Text | None


@dataclass(frozen=True, slots=True)
class DocSignature:
    """``name(field type, ...) -> result``."""

    name: Text
    fields: tuple[DocField, ...] = ()
    result: Text | None = None
