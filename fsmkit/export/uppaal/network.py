"""A network of timed automata, in the structure of a file for UPPAAL.

Expressions are strings in UPPAAL's notation. Guards and invariants are conjunctions, updates lists,
taken in order. Positions are pixels of the editor, y downwards.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

Point = tuple[int, int]


class Sort(Enum):
    """The kind of a declared name."""

    INT = "int"
    BOOL = "bool"
    CLOCK = "clock"
    URGENT_BROADCAST = "urgent broadcast chan"
    BROADCAST = "broadcast chan"


@dataclass(frozen=True, slots=True)
class Declared:
    """A variable, constant, clock or channel. ``lo..hi`` of an INT; ``length`` 0: no array."""

    name: str
    sort: Sort
    lo: int = 0
    hi: int = 0
    length: int = 0
    init: tuple[int, ...] = ()
    """The start value or values; those of bools are 0 and 1. Empty for clocks and channels."""
    constant: bool = False
    comment: str = ""


@dataclass(frozen=True, slots=True)
class Function:
    """A function of the C-like language, as source from its type to its closing brace."""

    name: str
    text: str


Declarations = tuple[Declared | Function, ...]


@dataclass(frozen=True, slots=True)
class Location:
    """A location; one without a name is transient."""

    id: str
    """Unique in the file, as the ids of its format are."""
    name: str = ""
    invariant: tuple[str, ...] = ()
    committed: bool = False
    urgent: bool = False
    color: str = ""
    """As ``#rrggbb``; empty: the editor's own."""
    at: Point | None = None
    name_at: Point | None = None
    invariant_at: Point | None = None


class Label(Enum):
    """The labels of an edge, by their names in a file, in the order in which they are read."""

    COMMENT = "comments"
    SELECT = "select"
    GUARD = "guard"
    SYNC = "synchronisation"
    UPDATE = "assignment"


@dataclass(frozen=True, slots=True)
class Edge:
    """An edge between two locations, by their ids."""

    source: str
    target: str
    select: tuple[tuple[str, int, int], ...] = ()
    """Names with the least and greatest value of each."""
    guard: tuple[str, ...] = ()
    sync: str = ""
    update: tuple[str, ...] = ()
    comment: str = ""
    color: str = ""
    labels_at: tuple[tuple[Label, Point], ...] = ()
    nails: tuple[Point, ...] = ()


@dataclass(frozen=True, slots=True)
class Template:
    """A template without parameters, and its one instance."""

    name: str
    instance: str
    declarations: Declarations
    locations: tuple[Location, ...]
    initial: str
    edges: tuple[Edge, ...]


@dataclass(frozen=True, slots=True)
class Query:
    """A formula; ``missing``: why a property has none."""

    formula: str
    comment: str = ""
    missing: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True)
class Network:
    """The content of a file."""

    remark: tuple[str, ...]
    """Lines of comment at its start."""
    declarations: Declarations
    templates: tuple[Template, ...]
    queries: tuple[Query, ...] = field(default=())
