"""The result of an exploration, common to both engines.

Marks are numbered facts: 0 a deadlock, then the properties, then those of each machine (see
`ClosedSystem.first_marks`).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cached_property

from fsmkit.verify.statespace.actions import Step
from fsmkit.verify.statespace.ranks import Traffic
from fsmkit.verify.statespace.spread import UNKNOWN, Spread
from fsmkit.verify.statespace.storage import LossyTable
from fsmkit.verify.statespace.symbolic_search import Diagram

DEADLOCK = 0
AT_ONCE = -1


class End(Enum):
    """The reason why an exploration ended."""

    COMPLETE = "complete"
    DECIDED = "decided"
    """All requested marks have been seen."""
    MEMORY = "memory"
    TIME = "time"
    INTERRUPTED = "interrupted"
    FAILED = "failed"


UNFINISHED = frozenset(End) - {End.COMPLETE, End.DECIDED}
"""The space was larger than what there was for it."""


@dataclass(frozen=True, slots=True)
class Mark:
    """The number of states or steps with a mark, and a shortest path to one (ordinals).

    The path is empty if memory for it ran out. Steps that sleep are not counted
    (core/search/sleep_sets.h).
    """

    number: int
    count: int
    path: tuple[int, ...]
    is_longer: bool = False
    """The way need not be a shortest one."""


@dataclass(frozen=True, slots=True)
class Answer:
    """The verdict of the graph on a temporal property, by its number.

    ``violated``: by a path, and the cycle after it; an empty cycle if nothing more happens. Without
    a path memory for it ran out. Not ``known``: there is no verdict.
    """

    property: int
    known: bool
    violated: bool = False
    path: tuple[int, ...] = ()
    cycle: tuple[int, ...] = ()
    greatest: int | None = None
    """For `within`: the maximum time in ticks; None if it has no bound, or never starts."""
    why: str = ""
    """Why it is not known, if that is not for want of memory."""
    is_longer: bool = False
    """The path need not be a shortest one."""


@dataclass(frozen=True, slots=True)
class Figures:
    """The results for one machine: its local states, its use of each capacity, its coverage."""

    locals: int
    queue: int
    timers: int
    microsteps: int
    states: frozenset[int]
    transitions: frozenset[int]
    spread: Spread = UNKNOWN
    """How its local states differ; computed if an exploration is incomplete."""
    saved: tuple[bytes, ...] = ()
    """Its local states as saved machines (`runtime.packing`), if requested."""


IDLE = (Figures(0, 0, 0, 0, frozenset(), frozenset()),)
"""A machine that was not explored."""


@dataclass(frozen=True)
class Exploration:
    """The result of a search.

    A path is the ordinals of steps, that of the initial state first; after `AT_ONCE` no time
    passes. ``livelock`` is a path and the cycle after it, ``traps`` the paths to them; both are
    valid only if ``*_known``.
    """

    engine: str
    end: End
    why: str
    states: int
    transitions: int
    depth: int
    bytes: int
    seconds: float
    marks: tuple[Mark, ...]
    livelock_known: bool
    livelock: tuple[tuple[int, ...], tuple[int, ...]] | None
    traps_known: bool
    traps: tuple[tuple[int, ...], ...]
    machines: tuple[Figures, ...]
    cores: int = 1
    """How many were at work; with large layers only it is more than one."""
    zones: int = 0
    """In dense time: how many zones there are of all the states together."""
    doubt: str = ""
    """Why a livelock or a trap is not known, if that is not for want of memory."""
    temporal: tuple[Answer, ...] = ()
    table: LossyTable | None = None
    """The table of lossy storage, by which states may have been missed; None: exact."""
    diagram: Diagram | None = None
    """The diagram of the states, if any: then ``depth`` is unknown, and 0."""
    traffic: Traffic | None = None
    """The messages between processes, if there were several; ``bytes`` are those of all."""
    explicit_states: int = 0
    """Beside a diagram: states that were also looked at one by one, for properties that need it."""

    def answer(self, property_: int) -> Answer:
        """Return the answer for a temporal property."""
        unknown = Answer(property_, known=False)
        return next((found for found in self.temporal if found.property == property_), unknown)

    def mark(self, number: int) -> Mark | None:
        """Return the result for a mark."""
        return self._by_number.get(number)

    @cached_property
    def _by_number(self) -> dict[int, Mark]:
        return {mark.number: mark for mark in self.marks}


def unexplored(engine: str, why: str, machines: int) -> Exploration:
    """Return the result of an exploration whose time ended before its start."""
    return Exploration(
        engine=engine,
        end=End.TIME,
        why=why,
        states=0,
        transitions=0,
        depth=0,
        bytes=0,
        seconds=0.0,
        marks=(),
        livelock_known=False,
        livelock=None,
        traps_known=False,
        traps=(),
        machines=IDLE * machines,
    )


Trail = tuple[tuple[Step, ...], ...]
"""A path as steps; the first entry holds the start of each machine, the others one step each."""
