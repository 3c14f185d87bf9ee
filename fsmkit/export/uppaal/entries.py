"""The entries of a recorded macrostep, and its target."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from fsmkit.language import Expr, Value
from fsmkit.runtime.interpreter.snapshot import Delayed, Timeout

AT_HAND = 0
"""The number of the first event of a macrostep; the raised ones follow."""
FIRST_SLOT = 1000
"""From here on, what is numbered are the slots of delayed sends."""


@dataclass(frozen=True, slots=True)
class Test:
    """A condition and its truth on this path."""

    condition: Expr
    holds: bool


@dataclass(frozen=True, slots=True)
class ResultChoice:
    """An operation has returned one of its results; which one is open."""

    operation: str
    value: Value


@dataclass(frozen=True, slots=True)
class Assignment:
    """A value is stored in a variable, an element, or a part of a record."""

    location: Expr
    value: Expr


@dataclass(frozen=True, slots=True)
class Output:
    """An event or a call leaves by a connected port."""

    port: int
    values: tuple[Expr, ...]


@dataclass(frozen=True, slots=True)
class QueuedEvent:
    """An event is added to the own queue."""

    event: int
    values: tuple[Expr, ...]


Entry = Test | ResultChoice | Assignment | Output | QueuedEvent


@dataclass(frozen=True, slots=True)
class TimerStart:
    """A timer: its action after at most ``greatest`` ticks (None: no end), at least ``least``."""

    what: Timeout | Delayed
    least: int
    greatest: int | None
    is_interval: bool = False

    @property
    def slot(self) -> int | None:
        """The slot of a delayed send."""
        if isinstance(self.what, Delayed):
            (number,) = self.what.occurrence.payload
            assert isinstance(number, int)  # noqa: S101  (given when recorded)
            return number
        return None


@dataclass(frozen=True, slots=True)
class Key:
    """The state that a location represents: all of a machine but data, histories and queue.

    ``timers``: from the longest delay to the shortest, equal ones in the order of arming. So it is
    known which of several expired ones was armed first.
    """

    configuration: frozenset[int]
    timers: tuple[TimerStart, ...] = ()
    running: bool = True
    fault: str = ""


History = tuple[tuple[int, frozenset[int]], ...]


@dataclass(frozen=True, slots=True)
class Path:
    """One path through a macrostep. ``written``: the histories that it records, or clears."""

    entries: tuple[Entry, ...]
    target: Key
    written: tuple[tuple[int, frozenset[int] | None], ...]
    fresh: tuple[TimerStart, ...]
    took: bool
    happened: bool
    """Whether there was a microstep at all."""
    _hash: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Compute the hash once: the trees of expressions are deep, and paths are keys."""
        parts = self.entries, self.target, self.written, self.fresh, self.took, self.happened
        object.__setattr__(self, "_hash", hash(parts))

    def __hash__(self) -> int:
        """Return the hash of all parts."""
        return self._hash

    def is_idle(self, source: Key) -> bool:
        """Whether nothing changes and there is no output."""
        tells = any(not isinstance(entry, Test | ResultChoice) for entry in self.entries)
        return not tells and self.target == source and not self.fresh


Payload = Mapping[str, Expr]
"""The value of each field of an event."""


def scratch(instance: int, field: str) -> str:
    """Return the name of a part of a current event; no chart can have such a variable."""
    return f"@{instance}.{field}"
