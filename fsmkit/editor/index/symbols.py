"""Symbols, and the places where they are declared and used."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

from fsmkit.diagnostics import Span


class SymbolKind(Enum):
    """The kind of a named item."""

    CHART = "chart"
    STATE = "state"
    EVENT = "event"
    DATA = "data"
    INPUT = "input"
    OUTPUT = "output"
    CONSTANT = "constant"
    TYPE = "type"
    MEMBER = "member"
    FIELD = "field"
    OPERATION = "operation"
    FUNCTION = "function"
    PARAMETER = "parameter"
    TRANSITION = "transition"
    INVOKE = "invoked chart"
    ENTRY = "entry point"
    SEND = "delayed send"
    SYSTEM = "system"
    MACHINE = "machine"
    PROPERTY = "property"
    SETTING = "parameter of the system"
    NODE = "node"
    SIGNAL = "signal"
    DEVICE = "device"


VARIABLES = (SymbolKind.DATA, SymbolKind.INPUT, SymbolKind.OUTPUT)
"""Kinds of symbols with a changing value."""


@dataclass(frozen=True, slots=True)
class Symbol:
    """The meaning of a name, equal in all files that use it.

    ``owner`` is the declaring file; for an extended chart, the outermost base with the
    declaration. ``within``: the names of the enclosing items, such as the event of a field.
    """

    kind: SymbolKind
    owner: Path
    name: str
    within: tuple[str, ...] = ()


class Role(Enum):
    """The use of a name at a location."""

    DECLARATION = "declares"
    OVERRIDE = "overrides"
    USE = "uses"
    MATCH = "matches"
    """A pattern of events that fits the symbol, whose name is not written there."""
    UNKNOWN = "unknown"
    """A name without a known meaning."""


@dataclass(frozen=True, slots=True)
class Occurrence:
    """A name at a location, with all symbols that it denotes.

    Symbols that share an occurrence have one name and are renamed together.
    """

    symbols: tuple[Symbol, ...]
    name: str
    role: Role
    span: Span = field(repr=False)
    whole: Span | None = field(default=None, repr=False)
    """The first line of a declaration."""

    @property
    def symbol(self) -> Symbol:
        """The first of its symbols."""
        return self.symbols[0]


@dataclass(frozen=True, slots=True)
class Uses:
    """The names in a file.

    ``links``: pairs of symbols that must have one name, though no location names both.
    """

    occurrences: tuple[Occurrence, ...] = ()
    links: tuple[tuple[Symbol, Symbol], ...] = ()
