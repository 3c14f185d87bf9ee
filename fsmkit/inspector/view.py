"""The entry in view, and those who look at it: all clients of a session see the same."""

from __future__ import annotations

from fsmkit.inspector.clients import Clients
from fsmkit.inspector.simulation import Moment
from fsmkit.inspector.system_at import Course
from fsmkit.runtime.live.messages import AnyMessage, Json, Mode, to_json

STATE_EVERY = 1_000
"""Steps after which each machine is sent as a whole again."""


class View:
    """A place in a course of events, and what clients are told of it."""

    def __init__(self, course: Course, begin: Moment | None) -> None:
        """Look at entry 0, after which it is a moment."""
        self.course = course
        self.history = course.history
        self.clients = Clients()
        self.n = 0
        self.moment = begin
        """The system at the entry in view; None where it is not known."""
        self.at = 0 if begin is None else begin.now
        """The time in view (ticks)."""
        self.is_running = False
        self.is_following = course.is_followed
        self.is_stopped: bool | None = None
        """Whether what runs elsewhere stands still; None if it cannot."""
        self.speed = 1.0
        self.why: list[Json] = []
        self.told_head = 0
        """The head of the last message `Mode`."""

    @property
    def is_live(self) -> bool:
        """Whether the branch in view is that of what runs elsewhere."""
        return self.course.is_followed and self.history.number == 0

    @property
    def is_past(self) -> bool:
        """Whether a source gave what follows the entry in view: it is played back."""
        return self.n < self.history.branch.given

    @property
    def is_at_head(self) -> bool:
        """Whether nothing follows the entry in view."""
        return self.n == self.history.head

    def go(self, n: int) -> None:
        """Take an entry into view."""
        self.n, self.moment = n, self.course.moment(n)
        self.at = self.course.at(n) if self.moment is None else self.moment.now

    def begin_branch(self, *, always: bool = False) -> Moment:
        """Let what comes follow the entry in view; what followed it stays as another branch.

        `FsmkitError` where the system is not known.
        """
        number = self.history.number
        moment = self.course.cut(self.n, self.moment, always=always)
        if self.history.number != number:
            self.tell(self.mode())
        return moment

    # --- what clients are told -----------------------------------------------------------------

    def tell(self, *told: AnyMessage) -> None:
        """Send messages to all."""
        self.clients.send([to_json(message) for message in told])

    def tell_all(self) -> None:
        """Send the machines as a whole, and which entry is in view."""
        self.tell(*self.states(), self.mode())

    def tell_entry(self, before: Moment | None) -> None:
        """Send the entry in view to those who saw the one before it."""
        self.clients.send([self.history.branch.text(self.n)])
        if self.is_due(before):
            self.tell(*self.states())

    def is_due(self, before: Moment | None) -> bool:
        """Whether the machines are sent as a whole: now and then, and where data become known."""
        is_given = self.n <= self.history.branch.given
        is_new = is_given and (before is None) != (self.moment is None)
        return is_new or self.n % STATE_EVERY == 0

    def states(self) -> list[AnyMessage]:
        """Return all machines as far as they are known, and what was lost since."""
        if self.moment is not None:
            return list(self.course.teller.states(self.n, self.moment))
        folded = self.course.folded(self.n)
        return [*folded.states, *folded.lost]

    def mode(self) -> Mode:
        """Return which entry is in view, and whether and why it stays so."""
        mode = "running" if self.is_running else "paused"
        if self.is_live:
            going = {None: "following", False: "running", True: "paused"}[self.is_stopped]
            mode = going if self.is_following else "frozen"
        self.told_head = self.history.head
        return Mode(
            mode=mode,
            n=self.n,
            head=self.history.head,
            at=self.at,
            branch=self.history.number,
            first=self.history.first,
            speed=self.speed,
            why=self.why,
        )
