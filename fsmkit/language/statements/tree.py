"""The tree of statements: its leaves are unread texts in a Document and typed in a Chart.

YAML and SCXML share it. `reading` reads it, `writing` writes it; the aliases of a Chart are in
`fsmkit.chart.statements`. The expressions of `DocSend` and `DocCancel` disappear when the names of
events, targets and ids are known, so a Chart has its own `Send` and `Cancel`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, ClassVar, Generic, TypeVar

from fsmkit.diagnostics import Span, Text
from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.emit import guard

Expr_co = TypeVar("Expr_co", covariant=True)
"""An expression: `Text` as written, `Expr` in a Chart."""
Array_co = TypeVar("Array_co", covariant=True)
"""The iterated expression of a loop: `Text`, or a variable or numbers."""
Place_co = TypeVar("Place_co", covariant=True)
"""The left side of an assignment: `Text`, or `Location`; in a loop `Variable`."""
Name_co = TypeVar("Name_co", covariant=True)
"""The name of an event or a label: `Text`, or an index or a string."""
Argument_co = TypeVar("Argument_co", covariant=True)
"""A value of a payload: `DocArgument`, or `Expr` in the order of the declaration."""
Statement_co = TypeVar("Statement_co", covariant=True)
"""A statement inside another one."""


ADVICE = "correct it, or remove it"
"""The default advice for unreadable content."""


@fast_init
@dataclass(frozen=True, slots=True)
class Assign(Generic[Place_co, Expr_co]):
    """``location = value``; in a Chart the value has the location's type (see `Convert`).

    ``operator`` is ``+``, ``-`` ... for ``location += value`` as written. In a Chart the value is
    the sum; ``sign`` keeps the operator for display only.
    """

    location: Place_co
    value: Expr_co
    span: Span = field(compare=False, repr=False)
    operator: str = ""
    sign: str = field(default="", compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class DocArgument:
    """``name = value`` of a payload (SCXML ``param``)."""

    name: Text
    value: Text


@fast_init
@dataclass(frozen=True, slots=True)
class Raise(Generic[Name_co, Argument_co]):
    """Append an event to the internal queue; in a Chart with one argument for each field."""

    event: Name_co
    arguments: tuple[Argument_co, ...]
    span: Span = field(compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class DocSend:
    """Send an event, immediately or later. Absent parts are None; ``*_expr`` are expressions."""

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
"""Fields of `DocSend`, each with the field of the expression or location that can replace it."""


@fast_init
@dataclass(frozen=True, slots=True)
class DocCancel:
    """Cancel a delayed send by its id (or the value of an expression)."""

    id: Text | None
    id_expr: Text | None
    span: Span = field(compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class Log(Generic[Name_co, Expr_co]):
    """Pass a label and values to the host."""

    label: Name_co
    values: tuple[Expr_co, ...]
    span: Span = field(compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "label")


@fast_init
@dataclass(frozen=True, slots=True)
class Branch(Generic[Expr_co, Statement_co]):
    """A condition (None for ``else``) and its block."""

    condition: Expr_co | None
    body: tuple[Statement_co, ...]


@fast_init
@dataclass(frozen=True, slots=True)
class If(Generic[Expr_co, Statement_co]):
    """The first branch whose condition holds."""

    branches: tuple[Branch[Expr_co, Statement_co], ...]
    span: Span = field(compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class ForEach(Generic[Array_co, Place_co, Statement_co]):
    """Assign each element of a copy of ``array`` to ``item`` (and its position to ``index``)."""

    array: Array_co
    item: Place_co
    index: Place_co | None
    body: tuple[Statement_co, ...]
    span: Span = field(compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class Local(Generic[Place_co, Expr_co]):
    """``let x = e`` names a value, ``var n type = e`` a variable, until the end of the block.

    ``type`` is present only as written. In scripts of ECMAScript both declare and assign data.
    """

    place: Place_co
    value: Expr_co | None
    span: Span = field(compare=False, repr=False)
    type: Text | None = None
    is_fixed: bool = False
    """True for ``let``."""


@fast_init
@dataclass(frozen=True, slots=True)
class KeywordStatement(Generic[Expr_co]):
    """A keyword and an expression; in SCXML an element of our namespace with `expr`.

    Reading, writing and formatting such a statement needs only its class, in both notations.
    """

    word: ClassVar[str]
    value: Expr_co
    span: Span = field(compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class Reply(KeywordStatement[Expr_co]):
    """Answer the event being dispatched; a later reply of the same macrostep replaces it."""

    word = "reply"


@fast_init
@dataclass(frozen=True, slots=True)
class Return(KeywordStatement[Expr_co]):
    """The result of a function; it ends its body."""

    word = "return"


HANDLER_KEYWORDS: dict[str, type[Reply[Text]]] = {Reply.word: Reply}
"""The keyword statements of handlers, by keyword."""
STATEMENT_KEYWORDS: dict[str, type[Reply[Text] | Return[Text]]] = {
    **HANDLER_KEYWORDS,
    Return.word: Return,
}
"""All keyword statements, by keyword."""


@fast_init
@dataclass(frozen=True, slots=True)
class CallOperation(Generic[Expr_co]):
    """Call an operation for its effect; its result is dropped."""

    call: Expr_co
    span: Span = field(compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class Super:
    """``super``: insert the statements of the base chart."""

    span: Span = field(compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class Fail:
    """Content that cannot be read or evaluated: executing it raises ``error.execution`` (SCXML 4).

    ``is_raised``: the previous statement already raised the error.
    """

    reason: str
    span: Span = field(compare=False, repr=False)
    is_raised: bool = False
    advice: str = field(default=ADVICE, compare=False)
    """How to fix it."""

    def __post_init__(self) -> None:
        guard(self, "reason", "advice")


WrittenStatement = (
    Assign[Text, Text]
    | Raise[Text, DocArgument]
    | DocSend
    | DocCancel
    | Log[Text | None, Text]
    | If[Text, "WrittenStatement"]
    | ForEach[Text, Text, "WrittenStatement"]
    | Reply[Text]
    | Return[Text]
    | Local[Text, Text]
    | CallOperation[Text]
    | Super
    | Fail
)

Block = tuple[WrittenStatement, ...]
"""One handler: an error in it skips the rest of it, not the handlers after it (SCXML 4)."""


NESTING = (If, ForEach)
"""The statements that contain others."""


def bodies(statement: object) -> tuple[tuple[Any, ...], ...]:
    """Return the blocks inside a statement, written or typed."""
    match statement:
        case If(branches):
            return tuple(branch.body for branch in branches)
        case ForEach(body=body):
            return (body,)
        case _:
            return ()


def statements(block: tuple[Statement_co, ...]) -> Iterator[Statement_co]:
    """Yield the statements of a handler, nested ones included."""
    for statement in block:
        yield statement
        if statement.__class__ in NESTING:
            for body in bodies(statement):
                yield from statements(body)


# --- declarations -----------------------------------------------------------------------------


@fast_init
@dataclass(frozen=True, slots=True)
class DocField:
    """``name type``. The type is absent if it is inferred (SCXML)."""

    name: Text
    type: Text | None


@fast_init
@dataclass(frozen=True, slots=True)
class DocSignature:
    """``name(field type, ...) -> result``."""

    name: Text
    fields: tuple[DocField, ...] = ()
    result: Text | None = None
