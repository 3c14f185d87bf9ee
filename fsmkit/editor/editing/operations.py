"""The operations of the editor: what a gesture in the drawing changes in a chart.

Values are texts in the notation of YAML charts, whatever the notation of the file: a guard
`level > 3`, statements `motor(1); count += 1`, a declaration `go(speed 0..9)`. A state is named by
its id, the chart itself by the empty string. A transition is named by the id of its source state
and its index there, in the order of the document.
"""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.document.document import Kind, Trigger

CHART = ""
"""The name of the outermost state."""
SECTIONS = (
    "types", "constants", "data", "inputs", "outputs", "operations", "functions", "in", "out",
    "internal", "capacity", "entries", "properties",
)  # fmt: skip
"""The sections of a chart that hold declarations; `in`, `out` and `internal` hold events."""


@dataclass(frozen=True, slots=True)
class AddState:
    """Add a state to ``parent``, before its child ``before`` or at the end."""

    parent: str
    name: str
    kind: Kind = Kind.ATOMIC
    before: str | None = None


@dataclass(frozen=True, slots=True)
class Paste:
    """Add states and transitions that were copied as YAML text.

    States become children of ``parent``; transitions leave ``parent``. A state whose name is taken
    gets a number.
    """

    parent: str
    text: str


@dataclass(frozen=True, slots=True)
class RemoveState:
    """Remove a state, its descendants, and all references to them in targets."""

    state: str


@dataclass(frozen=True, slots=True)
class MoveState:
    """Move a state into ``parent``, before its child ``before`` or to the end."""

    state: str
    parent: str
    before: str | None = None


@dataclass(frozen=True, slots=True)
class RenameSymbol:
    """Rename a symbol; ``kind`` is a word of `index.symbols.SymbolKind`, such as `state`."""

    kind: str
    name: str
    new: str


@dataclass(frozen=True, slots=True)
class SetInitial:
    """Set the initial states of a composite state or the default of a history; empty removes it."""

    state: str
    targets: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SetKind:
    """Change the kind of a state."""

    state: str
    kind: Kind


@dataclass(frozen=True, slots=True)
class AddTransition:
    """Add a transition after those of its source with the same trigger.

    ``label`` holds the events, separated by blanks, or the delay.
    """

    source: str
    targets: tuple[str, ...] = ()
    trigger: Trigger = Trigger.EVENTLESS
    label: str = ""
    guard: str = ""
    content: str = ""


@dataclass(frozen=True, slots=True)
class RemoveTransition:
    """Remove a transition."""

    source: str
    index: int


@dataclass(frozen=True, slots=True)
class SetSource:
    """Move a transition to another source state, after those with the same trigger."""

    source: str
    index: int
    new: str


@dataclass(frozen=True, slots=True)
class SetTarget:
    """Set the targets of a transition; none makes it targetless."""

    source: str
    index: int
    targets: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SetTrigger:
    """Set the trigger of a transition; ``label`` holds its events or its delay."""

    source: str
    index: int
    trigger: Trigger
    label: str = ""


@dataclass(frozen=True, slots=True)
class SetDelay:
    """Set the delay of a transition `after` or `every`."""

    source: str
    index: int
    delay: str


@dataclass(frozen=True, slots=True)
class SetGuard:
    """Set the guard of a transition; an empty text removes it."""

    source: str
    index: int
    guard: str


@dataclass(frozen=True, slots=True)
class SetContent:
    """Set the statements of a transition; an empty text removes them."""

    source: str
    index: int
    content: str


@dataclass(frozen=True, slots=True)
class MoveTransition:
    """Move a transition to another index among the transitions of its source."""

    source: str
    index: int
    to: int


@dataclass(frozen=True, slots=True)
class SetHandler:
    """Set the handlers of a state, ``entry`` or ``exit``; no handler removes the key."""

    state: str
    key: str
    handlers: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SetKey:
    """Set a key of the chart, of a state, or with ``index`` of one of its transitions.

    ``value`` holds one text, for a list its items, and is empty to remove the key. Items of a key
    with pairs, such as the data of a state, read `name: value`.
    """

    state: str
    key: str
    value: tuple[str, ...]
    index: int | None = None


@dataclass(frozen=True, slots=True)
class Declare:
    """Add a declaration to a section of the chart, or replace the one with this name.

    ``name`` holds the signature of an event, an operation or a function; ``value`` the type with
    the start value, the value of a constant, or the body of a function. Members of an enumeration
    read `[a, b]`, fields of a record `{x: 0..9}`.
    """

    section: str
    name: str
    value: str = ""


@dataclass(frozen=True, slots=True)
class RemoveDeclaration:
    """Remove a declaration from a section of the chart."""

    section: str
    name: str


@dataclass(frozen=True, slots=True)
class OverrideState:
    """Start to refine an inherited state: add an empty entry for it under `refine`."""

    state: str


@dataclass(frozen=True, slots=True)
class WrapInState:
    """Put sibling states into a new composite state at the location of the first."""

    states: tuple[str, ...]
    name: str


@dataclass(frozen=True, slots=True)
class UnwrapState:
    """Replace a composite state by its children."""

    state: str


Operation = (
    AddState
    | Paste
    | RemoveState
    | MoveState
    | RenameSymbol
    | SetInitial
    | SetKind
    | AddTransition
    | RemoveTransition
    | SetSource
    | SetTarget
    | SetTrigger
    | SetDelay
    | SetGuard
    | SetContent
    | MoveTransition
    | SetHandler
    | SetKey
    | Declare
    | RemoveDeclaration
    | OverrideState
    | WrapInState
    | UnwrapState
)
