"""Where the entries of a session come from, if the hub does not simulate them itself.

Something *recorded* is known as a whole: a counterexample, a log, a file of messages. Something
*followed* runs elsewhere, and its entries come in time. Both give entries in the order in which
they happened; the hub numbers them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.inspector.simulation import Moment, Stepped
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Occurrence
from fsmkit.runtime.live.messages import AnyMessage, Json
from fsmkit.system.system import System


@dataclass(frozen=True, slots=True)
class Entry:
    """One entry of the history: the messages for a client, and the system after it.

    The first message is a `Step`, or a `Post` or `Set` of somebody outside, or a `State` or `Lost`.
    Their ``n`` is overwritten by the hub. ``moment`` None: the data are not known until the next
    entry that has one; meanwhile the view goes by the messages. ``stepped`` None: no macrostep is
    known, so its microsteps are not.
    """

    moment: Moment | None
    messages: tuple[AnyMessage, ...]
    stepped: Stepped | None = None


@runtime_checkable
class Recorded(Protocol):
    """Something that is over: all of its entries are there.

    ``at_end``: the view begins at the last entry, which was reached for the reason ``why``
    (``["property", "P2"]``).
    """

    @property
    def system(self) -> System:
        """The machines; a branch goes on with them in the interpreter."""

    @property
    def time(self) -> str:
        """``recorded``."""

    @property
    def begin(self) -> Moment | None:
        """The system before the first entry, if it is known."""

    @property
    def entries(self) -> Sequence[Entry]:
        """All that happened."""

    @property
    def at_end(self) -> bool:
        """Whether the view begins at the end."""

    @property
    def why(self) -> list[Json]:
        """The reason for the end; empty if there is none."""


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
        """Which of the commands ``post`` and ``set`` the host obeys."""

    @property
    def begin(self) -> Moment | None:
        """The system before the first entry, if it is known."""

    def receive(self) -> Sequence[Entry]:
        """Return the entries that came since the last call, without waiting.

        The hub calls it up to 60 times a second. `FsmkitError` where nothing more can come: the
        finding is shown, and the source is not called again.
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
class Driven(Followed, Protocol):
    """Something followed that is stepped: it can be stopped, paced and saved from here.

    ``can`` names ``run``, ``pause`` and ``step`` if it is stepped now.
    """

    @property
    def is_running(self) -> bool:
        """Whether it goes on."""

    @property
    def speed(self) -> float:
        """Simulated seconds in a second; 0: as fast as can be."""

    def run(self, speed: float) -> None:
        """Go on, at a speed."""

    def pause(self) -> None:
        """Stand still."""

    def step(self, ticks: int) -> None:
        """Go on by some ticks, and stand still."""

    def save(self, kind: str) -> str:
        """Return what was done, as a ``script`` or a ``pytest``; `FsmkitError` if it cannot be."""


def ended(why: str) -> FsmkitError:
    """Return the error for something followed that gives nothing more."""
    return fail("source-ended", why, help="look at what came before, and start it again")
