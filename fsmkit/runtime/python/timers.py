"""The timers of a machine, in order of their deadlines."""

from __future__ import annotations

from fsmkit.runtime.python.arithmetic import ContentError
from fsmkit.runtime.python.queues import Queues
from fsmkit.runtime.python.trace import CLOCK, FAR, NOTHING


class Timers(Queues):
    """Timeouts and delayed sends that wait."""

    # --- copied from here on into each generated class --------------------------------------------

    # --- timers -----------------------------------------------------------------------------------

    def _arm(self, what: int, delay: int) -> int:
        """Insert a timer after those with an earlier or equal deadline; return its index.

        ``what`` is a transition, or the complement of the event to send.
        """
        due = (self._now + delay) & CLOCK
        at = self._timer_count
        self._timer_count = at + 1
        while at and (due - self._timer_due[at - 1]) & CLOCK >= FAR:
            self._move(at - 1, at)
            at -= 1
        self._timer_due[at] = due
        self._timer_what[at] = what
        return at

    def _move(self, source: int, target: int) -> None:
        """Copy a timer to another place."""
        self._timer_due[target] = self._timer_due[source]
        self._timer_what[target] = self._timer_what[source]
        # if DELAYS
        if self._sends:
            self._timer_mark[target] = self._timer_mark[source]
            self._timer_route[target] = self._timer_route[source]
            self._timer_peer[target] = self._timer_peer[source]
            # if PAYLOAD
            for k in range(self.WIDTH):
                part = self._timer_fields[source * self.WIDTH + k]
                self._timer_fields[target * self.WIDTH + k] = part
            # endif
        # endif

    def _remove(self, at: int) -> None:
        """Drop the timer at a place."""
        self._timer_count -= 1
        for i in range(at, self._timer_count):
            self._move(i + 1, i)

    def _disarm(self, transition: int) -> None:
        """Cancel the timer of a transition."""
        for at in range(self._timer_count):
            if self._timer_what[at] == transition:
                self._remove(at)
                return

    def _later(self, event: int, delay: int, mark: int, route: int, peer: str | None) -> int:
        """Store a delayed send; return the index for its payload, or -1 if the table is full."""
        if delay < 0:
            raise ContentError("a delay cannot be negative")
        if self._sends >= self.DELAYED:
            if self.trace is not None:
                self._tell("full delayed")
            return NOTHING
        self._sends += 1
        at = self._arm(~event, delay)
        self._timer_mark[at] = mark
        self._timer_route[at] = route
        self._timer_peer[at] = peer
        # if PAYLOAD
        at *= self.WIDTH
        # endif
        return at

    def _cancel(self, mark: int) -> None:
        """Drop the delayed sends of an id."""
        at = 0
        while at < self._timer_count:
            if self._timer_what[at] < 0 and self._timer_mark[at] == mark:
                self._remove(at)
                self._sends -= 1
            else:
                at += 1
