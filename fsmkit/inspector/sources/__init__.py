"""Sources of a session's entries other than the simulation.

A *recorded* source is complete: a counterexample, a log, a file of messages. A *followed* source
is an external program whose entries arrive over time. Both provide entries in chronological order;
the hub numbers them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.inspector.simulation import Moment, SimulationStep
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Occurrence
from fsmkit.runtime.live.messages import AnyMessage, Json
from fsmkit.system.system import System


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of the history: the messages for a client, and the system after it.

    The first message is a `Step`, an external `Post` or `Set`, a `State` or `Lost`. The hub
    overwrites its ``n``. ``moment`` None: the data are unknown up to the next entry with a moment;
    the view then uses the messages. ``stepped`` None: the macrostep, and thus its microsteps, is
    unknown.
    """

    moment: Moment | None
    messages: tuple[AnyMessage, ...]
    stepped: SimulationStep | None = None


@runtime_checkable
class Recorded(Protocol):
    """A complete source, with all entries.

    ``at_end``: the view starts at the last entry, which was reached for the reason ``why``
    (``["property", "P2"]``).
    """

    @property
    def system(self) -> System:
        """The machines; the interpreter continues a branch with them."""

    @property
    def time(self) -> str:
        """``recorded``."""

    @property
    def begin(self) -> Moment | None:
        """The system before the first entry, if it is known."""

    @property
    def entries(self) -> Sequence[Entry]:
        """All entries."""

    @property
    def at_end(self) -> bool:
        """Whether the view starts at the end."""

    @property
    def why(self) -> list[Json]:
        """The reason for the end, or an empty list."""


@runtime_checkable
class Followed(Protocol):
    """Something that runs elsewhere and cannot be stopped from here."""

    @property
    def system(self) -> System:
        """The machines."""

    @property
    def time(self) -> str:
        """``live``."""

    @property
    def can(self) -> frozenset[str]:
        """The commands among ``post`` and ``set`` that the host accepts."""

    @property
    def begin(self) -> Moment | None:
        """The system before the first entry, if it is known."""

    def receive(self) -> Sequence[Entry]:
        """Return the entries since the last call, without waiting.

        The hub calls it up to 60 times per second. It raises `FsmkitError` at the end; the finding
        is shown, and the source is not called again.
        """

    def post(self, machine: int, occurrence: Occurrence) -> None:
        """Send an event to a machine; `FsmkitError` where that fails."""

    def set_input(self, machine: int, place: int, value: Value) -> None:
        """Give an input of a machine another value; `FsmkitError` where that fails."""

    def signals(self) -> Mapping[str, float]:
        """Return the last samples of a plant, by name; the names and their order stay."""

    def close(self) -> None:
        """Give back sockets and files."""


@runtime_checkable
class DrivenSource(Followed, Protocol):
    """Something followed that is stepped: it can be stopped, paced and saved from here.

    ``can`` names ``run``, ``pause`` and ``step`` if it is stepped now.
    """

    @property
    def is_running(self) -> bool:
        """Return whether it runs."""

    @property
    def speed(self) -> float:
        """Simulated seconds in a second; 0: as fast as can be."""

    def run(self, speed: float) -> None:
        """Go on, at a speed."""

    def pause(self) -> None:
        """Pause."""

    def step(self, ticks: int) -> None:
        """Advance by some ticks, then pause."""

    def save(self, kind: str) -> str:
        """Return the session as ``script`` or ``pytest``; raises `FsmkitError` if impossible."""


def ended(why: str) -> FsmkitError:
    """Return the error for something followed that gives nothing more."""
    return fail(
        "source-ended", why, help="inspect the previous entries, and start the program again"
    )
