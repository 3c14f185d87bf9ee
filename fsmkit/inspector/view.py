"""The entry in view, shared by all clients of a session."""

from __future__ import annotations

from fsmkit.inspector.clients import Clients
from fsmkit.inspector.simulation import Moment
from fsmkit.inspector.system_at import Course
from fsmkit.runtime.live.messages import AnyMessage, Json, Mode, to_json

STATE_EVERY = 1_000
"""Steps after which each machine is sent as a whole again."""


class View:
    """A position in a course, and its messages for clients."""

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
        """Whether a followed program is paused; None if it cannot pause."""
        self.speed = 1.0
        self.why: list[Json] = []
        self.told_head = 0
        """The head of the last message `Mode`."""

    @property
    def is_live(self) -> bool:
        """Return whether the branch in view is that of the followed program."""
        return self.course.is_followed and self.history.number == 0

    @property
    def is_past(self) -> bool:
        """Return whether the next entry was given by a source, so that it is played back."""
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
        """Continue after the entry in view; later entries remain as another branch.

        Raises `FsmkitError` if the system is unknown.
        """
        number = self.history.number
        moment = self.course.cut(self.n, self.moment, always=always)
        if self.history.number != number:
            self.send(self.mode())
        return moment

    # --- messages -----------------------------------------------------------------

    def send(self, *told: AnyMessage) -> None:
        """Send messages to all."""
        self.clients.send([to_json(message) for message in told])

    def send_all(self) -> None:
        """Send the machines as a whole, and which entry is in view."""
        self.send(*self.states(), self.mode())

    def send_entry(self, before: Moment | None) -> None:
        """Send the entry in view to clients that received its predecessor."""
        self.clients.send([self.history.branch.text(self.n)])
        if self.is_due(before):
            self.send(*self.states())

    def is_due(self, before: Moment | None) -> bool:
        """Whether the machines are sent as a whole: now and then, and where data become known."""
        is_given = self.n <= self.history.branch.given
        is_new = is_given and (before is None) != (self.moment is None)
        return is_new or self.n % STATE_EVERY == 0

    def states(self) -> list[AnyMessage]:
        """Return the known states of all machines, and the losses since."""
        if self.moment is not None:
            return list(self.course.encoder.states(self.n, self.moment))
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
