"""A run that is driven by hand: it keeps real time, executes requests, and stores samples.

`Drive` is the `Steering` of a run. The run has a thread of its own, and so has its display.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import dataclass

from fsmkit.runtime.interpreter.snapshot import Macrostep, Occurrence

from ..simulation.faults import FaultError
from ..simulation.nodes import CellError
from ..simulation.options import Options
from ..simulation.orchestrator import Orchestrator
from .panel import Panel
from .samples import Samples
from .session import Deed, Digest, Session

AHEAD = 0.004
"""A run that is so many s ahead of its time waits."""
BEHIND = 0.25
"""One that is so many s behind does not catch up."""


@dataclass(frozen=True, slots=True)
class AtPanel:
    """An action at the panel; None: the start. Rejected actions have no ``done``."""

    at: int
    what: Occurrence | None
    done: tuple[Macrostep, ...]


@dataclass(frozen=True, slots=True)
class Began:
    """The start or the end of a board."""

    at: int
    board: str
    is_alive: bool


@dataclass(frozen=True, slots=True)
class Leaves:
    """The reported states of boards without a log, by number."""

    at: int
    numbers: tuple[int, ...]


class Drive:
    """Drives a run.

    Args:
        options: The options of the run.
        speed: Simulated seconds per second, 0 for maximum speed.

    """

    def __init__(self, options: Options, speed: float = 1.0) -> None:
        self.options = options
        self.speed = speed
        self.is_running = False
        """It stands still before its first step."""
        self.deeds: list[Deed] = []
        self.notes: list[str] = []
        """Errors that did not end the run."""
        self.has_died = False
        """A board died without a fault, which no session repeats."""
        self.events: deque[AtPanel | Began | Leaves] = deque()
        """Events that no log records."""
        self.samples: Samples | None = None
        self.run_: Orchestrator | None = None
        self.steps = 0
        """Steps that have been made."""
        self.has_begun = threading.Event()
        self._lock = threading.Condition()
        self._counted = threading.Lock()
        """Guards the steps and their digest."""
        self._digest = Digest()
        self._asked: deque[Occurrence] = deque()
        self._panel: Panel | None = None
        self._may_step = 0
        """Steps that are still made while it stands still."""
        self._is_closed = False
        self._began = (0.0, 0)
        self._alive: dict[str, bool] = {}
        self._leaves: tuple[int, ...] = ()

    # --- the thread of the run -----------------------------------------------------------------

    def begin(self, run: Orchestrator) -> None:
        """Take over a run whose signals are connected."""
        self.run_, self._panel = run, Panel(run)
        self.samples = Samples(run, self.options.ring)
        self._alive = dict.fromkeys(run.boards, True)
        self.events.append(AtPanel(0, None, (self._panel.first,)))
        self._rebase(1)
        self.has_begun.set()

    def before(self, number: int) -> None:
        """Execute pending requests, and return when it is time for a step."""
        with self._lock:
            while not (self.is_running or self._may_step or self._is_closed):
                self._lock.wait()
                self._rebase(number)
            self._may_step = max(0, self._may_step - 1)
            asked, self._asked = list(self._asked), deque()
        if self._is_closed and self.run_ is not None:
            self.run_.stop()
            return
        for occurrence in asked:
            self._do(number, occurrence)
        self._watch_boards(number)
        if self.speed and not self.options.hz:
            self._wait(number)

    def _rebase(self, number: int) -> None:
        self._began = (time.monotonic(), number)

    def _wait(self, number: int) -> None:
        """Wait until the time of a step."""
        began, first = self._began
        ahead = began + (number - first) / (1000 * self.speed) - time.monotonic()
        if ahead > AHEAD:
            time.sleep(ahead)
        elif ahead < -BEHIND:
            self._rebase(number)

    def _do(self, number: int, occurrence: Occurrence) -> None:
        assert self._panel is not None  # noqa: S101  (the run has started)
        try:
            done = self._panel.do(number, occurrence)
        except (FaultError, CellError) as error:
            self.notes.append(f"{number / 1000:g} s: {error}")
            self.events.append(AtPanel(number, occurrence, ()))
            return
        self.deeds.append(Deed(number, occurrence))
        self.events.append(AtPanel(number, occurrence, done))

    def _watch_boards(self, number: int) -> None:
        """Record the end or the restart of a board."""
        for name, was_alive in self._alive.items():
            if self.run_ is not None and self.run_.is_alive(name) != was_alive:
                self._alive[name] = not was_alive
                self.events.append(Began(number, name, not was_alive))

    def after(self, number: int) -> None:
        """Keep what a step did."""
        assert self.samples is not None  # noqa: S101  (the run has started)
        assert self.run_ is not None  # noqa: S101
        self.samples.add(number, is_last=not self.is_running)
        if self.options.double and (leaves := self.samples.leaves()) != self._leaves:
            self._leaves = leaves
            self.events.append(Leaves(number, leaves))
        with self._counted:
            self._digest.add(self.run_.values)
            self.steps = number

    def died(self, number: int, board: str, why: str) -> bool:
        """Record the death of a board without a fault: the run continues without it."""
        self.notes.append(f"{number / 1000:g} s: board {board} died: {why}")
        self.has_died = True
        return True

    # --- other threads -------------------------------------------------------------------------

    def request(self, occurrence: Occurrence) -> None:
        """Let something be done at the panel before the next step."""
        with self._lock:
            self._asked.append(occurrence)

    def go_on(self, speed: float) -> None:
        """Run, at a speed."""
        with self._lock:
            self.speed, self.is_running = speed, True
            self._rebase(self.steps + 1)
            self._lock.notify_all()

    def pause(self) -> None:
        """Stand still before the next step."""
        with self._lock:
            self.is_running = False

    def step(self, steps: int) -> None:
        """Make some steps, and stand still."""
        with self._lock:
            self.is_running, self._may_step = False, self._may_step + steps
            self._lock.notify_all()

    def close(self) -> None:
        """Let the run end before its next step."""
        with self._lock:
            self._is_closed = True
            self._lock.notify_all()

    def session(self) -> tuple[Session, str]:
        """Return the actions so far, and the digest of their results."""
        own = self.options
        options = {
            "seed": own.seed, "blocks": own.blocks, "fault": own.fault, "bad": own.bad,
            "sorter": own.sorter, "drift": own.drift, "estimator": own.estimator,
            "aruco": own.aruco, "plant": own.plant, "double": own.double,
            "registers": own.registers,
        }  # fmt: skip
        with self._counted:
            steps, found = self.steps, str(self._digest)
        deeds = tuple(deed for deed in list(self.deeds) if deed.step <= steps)
        return Session(options, max(1, steps), deeds), found

    @property
    def why_not_again(self) -> str:
        """Why the session cannot be done again bit for bit; empty if it can."""
        if self.has_died:
            return "a board died without a fault"
        return "boards had loops of their own" if self.options.hz else ""
