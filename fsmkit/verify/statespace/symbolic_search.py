"""Searches that keep all states as one diagram (``core/symbolic``), and their limits."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from enum import Enum

from fsmkit.diagnostics import fail
from fsmkit.system.properties.property import OverGraph
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.storage import Storage


class Search(Enum):
    """The search procedure, and the form of the set of states."""

    AUTO = "auto"
    """One by one; those that are many, also as a diagram, in turns: the first to end answers."""
    EXPLICIT = "explicit"
    """One by one, breadth first."""
    SYMBOLIC = "symbolic"
    """As a decision diagram, by saturation (Ciardo, Marmorstein, Siminiceanu 2003)."""


OF_SETS = frozenset({"recoverable", "leads-to"})
"""The procedures over the graph that a diagram has, too (``core/liveness/answers.c``)."""
SEARCHES = tuple(search.value for search in Search)
"""The names of all searches."""


def read_search(name: str) -> Search:
    """Return the search of that name. Raises `FsmkitError` (``no-such-search``)."""
    if name not in SEARCHES:
        known = ", ".join(SEARCHES)
        raise fail("no-such-search", f"there is no search `{name}`", help=f"use one of {known}")
    return Search(name)


@dataclass(frozen=True, slots=True)
class Diagram:
    """The diagram at the end of a symbolic search.

    ``order``: the machines by level, the highest first; ``found_by``: ``given``, ``kept`` (from an
    earlier run) or ``found``. ``bytes`` are those of nodes, tables, caches and events; ``made``:
    all nodes, collected ones included. ``unknown``: marks that could not be evaluated on it.
    """

    nodes: int
    peak: int
    bytes: int
    events: int
    order: tuple[int, ...]
    found_by: str
    made: int = 0
    unknown: frozenset[int] = frozenset()


def why_not_symbolic(closed: ClosedSystem, storage: Storage) -> str:
    """Return why states of a system cannot be kept as a diagram; empty if they can."""
    if closed.zones:
        return "time is dense"
    if closed.system.schedule is not None:
        return "its machines have turns"
    if closed.system.freezers:
        return "nodes may freeze"
    if closed.covers:
        return "a path to each transition is requested"
    if storage is not Storage.EXACT:
        return f"{storage.value} storage keeps states one by one"
    return ""


def explicit_only(closed: ClosedSystem, names: Collection[str] = ()) -> Iterator[tuple[int, str]]:
    """Yield the properties, by number, that need an explicit search, and why.

    ``names``: the requested properties (empty: all).
    """
    for number, property_ in enumerate(closed.system.properties):
        if names and property_.name not in names:
            continue
        decided = property_.kind.decided
        if isinstance(decided, OverGraph) and decided.procedure in OF_SETS:
            continue
        if isinstance(decided, OverGraph) and not (decided.is_timed and closed.untimed):
            yield number, f"`{property_.kind.key}` is decided on the graph of all states"
        elif property_.is_of_steps:
            yield number, "`occurs` is evaluated at each step"
