"""Symbols, and the places where they are declared and used."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

from fsmkit.diagnostics import Span


class SymbolKind(Enum):
    """What a name stands for."""

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
"""What holds a value that changes."""


@dataclass(frozen=True, slots=True)
class Symbol:
    """What a name means, the same in all files that name it.

    ``owner`` is the file that declares it; of a chart that is extended that of the outermost base
    which has it. ``within``: the names of what it is a part of, such as the event of a field.
    """

    kind: SymbolKind
    owner: Path
    name: str
    within: tuple[str, ...] = ()


class Role(Enum):
    """How a name is used at a place."""

    DECLARATION = "declares"
    OVERRIDE = "overrides"
    USE = "uses"
    MATCH = "matches"
    """A pattern of events that fits the symbol, whose name is not written there."""
    UNKNOWN = "unknown"
    """A name of which it is not known what it means."""


@dataclass(frozen=True, slots=True)
class Occurrence:
    """A name at a place. It has several symbols where it means all of them at once.

    Symbols that share an occurrence have one name, and are renamed together.
    """

    symbols: tuple[Symbol, ...]
    name: str
    role: Role
    span: Span = field(repr=False)
    whole: Span | None = field(default=None, repr=False)
    """Of a declaration: its first line, with what is written there besides the name."""

    @property
    def symbol(self) -> Symbol:
        """The first of its symbols."""
        return self.symbols[0]


@dataclass(frozen=True, slots=True)
class Uses:
    """What a file names.

    ``links``: pairs of symbols that must have one name though no place names both.
    """

    occurrences: tuple[Occurrence, ...] = ()
    links: tuple[tuple[Symbol, Symbol], ...] = ()
