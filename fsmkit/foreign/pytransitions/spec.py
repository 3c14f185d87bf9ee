"""A machine of the library in the terms of its configuration, fully expanded.

States are identified by their paths from the root. A *step* is one transition of one source: `*`,
`=` and lists of sources are expanded, as `Machine.add_transition` does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from fsmkit.diagnostics import Source, Span, Text

Path = tuple[str, ...]
Callbacks = tuple[Text, ...]
"""Names of callables, in the order in which they are called."""
HANDLERS = ("on_enter", "on_exit", "on_final", "on_timeout")
"""Callbacks of a state."""


@dataclass(frozen=True, slots=True)
class State:
    """A state; ``initial`` names the children that are entered with it, several in parallel."""

    path: Path
    span: Span = field(compare=False, repr=False)
    children: tuple[State, ...] = ()
    initial: tuple[str, ...] = ()
    on_enter: Callbacks = ()
    on_exit: Callbacks = ()
    on_final: Callbacks = ()
    final: bool = False
    timeout: Text | None = None
    """Seconds, of the extension `Timeout`."""
    on_timeout: Callbacks = ()

    @property
    def is_parallel(self) -> bool:
        """Return whether several children are entered together."""
        return len(self.initial) > 1

    def walk(self) -> Iterator[State]:
        """Yield this state and all below it, in order."""
        yield self
        for child in self.children:
            yield from child.walk()


@dataclass(frozen=True, slots=True)
class Step:
    """A transition of one source. ``dest`` None: internal, nothing is left or entered."""

    trigger: Text
    source: Path
    dest: Path | None
    span: Span = field(compare=False, repr=False)
    conditions: Callbacks = ()
    unless: Callbacks = ()
    before: Callbacks = ()
    after: Callbacks = ()
    prepare: Callbacks = ()
    scope: Path = ()
    """The state whose description contains it; those of inner states are tried first."""

    @property
    def is_conditional(self) -> bool:
        """Return whether it has a condition."""
        return bool(self.conditions or self.unless)


GENERAL = (
    "prepare_event",
    "before_state_change",
    "after_state_change",
    "finalize_event",
    "on_exception",
    "on_final",
)
"""Callbacks of the whole machine."""


@dataclass(frozen=True, slots=True)
class Machine:
    """A whole machine. ``states`` are those without a parent."""

    source: Source
    name: Text
    states: tuple[State, ...]
    initial: tuple[Path, ...]
    steps: tuple[Step, ...]
    general: dict[str, Callbacks]
    """By the names in `GENERAL`."""
    inputs: frozenset[str]
    """Conditions that are attributes, not methods."""
    queued: bool = False
    ignores_invalid: bool = False
    has_automatic: bool = False
    separator: str = "_"

    def walk(self) -> Iterator[State]:
        """Yield all states, in order."""
        for state in self.states:
            yield from state.walk()


def milliseconds(timeout: Text) -> int:
    """Return a time in seconds as whole milliseconds, at least one; raises `ValueError`."""
    seconds = float(timeout.value)
    if not 0 < seconds < 1e9:
        raise ValueError(timeout.value)
    return max(1, round(seconds * 1000))
