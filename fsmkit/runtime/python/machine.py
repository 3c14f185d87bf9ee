"""The interface for hosts of every generated machine."""

from __future__ import annotations

from typing import Any

from fsmkit.runtime.python.stepping import Stepping
from fsmkit.runtime.python.trace import CLOCK, FAR, NOTHING


class Machine(Stepping):
    """A running chart. Each generated class contains a copy of this class and its bases."""

    # --- copied from here on into each generated class --------------------------------------------

    def _prepare(self, operations: object | None) -> None:
        """Make all queues and timers that there will ever be."""
        self._host = self if operations is None else operations
        missing = [name for name in self.OPERATIONS if not hasattr(self._host, name)]
        if missing:
            names = ", ".join(missing)
            raise TypeError(f"{type(self._host).__name__} lacks what {self.NAME} calls: {names}")
        self.trace = None
        self.log = None
        self.reply = None
        self._fields = [0] * self.WIDTH
        self._queue_event = [0] * self.QUEUE
        self._queue_fields = [0] * (self.QUEUE * self.WIDTH)
        self._deferred_event = [0] * self.QUEUE
        self._deferred_fields = [0] * (self.QUEUE * self.WIDTH)
        self._internal_event = [0] * self.INTERNAL
        self._internal_fields = [0] * (self.INTERNAL * self.WIDTH)
        self._timer_due = [0] * self.TIMERS
        self._timer_what = [0] * self.TIMERS
        self._timer_mark = [0] * self.TIMERS
        self._timer_route = [0] * self.TIMERS
        self._timer_peer = [None] * self.TIMERS
        self._timer_fields = [0] * (self.TIMERS * self.WIDTH)
        self._offered = []
        self._busy = False
        self._clear(0)
        self._running = False
        self._reset_data()
        # if RECORDED
        self._record_prepare()
        # endif

    def _clear(self, now: int) -> None:
        """Reset to a newly started machine without active states."""
        self._active = 1
        self._fault = None
        self._finished = False
        self._running = True
        self._now = now & CLOCK
        self._event = NOTHING
        self._budget = 0
        self._cause = None
        self._is_deferred = False
        self._tried = 0
        self._held = 0
        self._seen = 0
        self._chosen = 0
        self._empty_queues()

    # --- interface for hosts ------------------------------------------------------------------

    def start(self, now: int = 0) -> None:
        """Start or restart at a time in ticks: enter the initial states."""
        self._claim()
        try:
            # if RECORDED
            self._record_starting(now & CLOCK)
            # endif
            self._reset_data()
            self._clear(now)
            if self.trace is not None:
                self._cause = f"@{self._now} > start"
                self._tell(None)
            # if RECORDED
            self._record_started()
            # endif
            self._budget = self.MICROSTEPS - 1
            self._begin()
            self._settle()
            # if RECORDED
            self._record_end()
            # endif
        # if CALLS_HOST
        except BaseException:
            self._break_off()
            raise
        # endif
        finally:
            self._busy = False

    def post(self, event: str, *payload: Any) -> bool:
        """Put an event into the queue; False if that is full or the machine does not run."""
        return self._place(*self._named(event, payload), payload)

    def dispatch(self, event: str, *payload: Any, now: int | None = None) -> bool:
        """Process an event immediately, ahead of the queue; return whether it enabled a transition.

        `now` is a time in ticks; by default, that of the last call. A value given by ``reply`` is
        then in `reply`.
        """
        index, _ = self._named(event, payload)
        self._claim()
        if now is not None and self._running:
            self._now = now & CLOCK
        # if PAYLOAD
        if self.WIDTH:
            self._fields[: len(payload)] = payload
        # endif
        return self._process(index)

    def _process(self, event: int) -> bool:
        """Process an event whose payload is stored; the machine must be claimed."""
        try:
            self.reply = None
            if not self._running:
                return False
            # if RECORDED
            self._record_calling(self._now)
            self._record_dispatched(event)
            # endif
            self._open(event)
            is_handled = self._react(event, may_defer=False)
            self._settle()
            # if RECORDED
            self._record_end()
            # endif
        # if CALLS_HOST
        except BaseException:
            self._break_off()
            raise
        # endif
        finally:
            self._busy = False
        return is_handled

    def run(self, now: int) -> bool:
        """Process all events and timers up to `now` (ticks); return whether the machine still runs.

        The queue comes first, then the expired timers, each followed by the events that the
        machine sent to itself.
        """
        self._claim()
        try:
            now &= CLOCK
            # if RECORDED
            self._record_calling(now)
            # endif
            if not self._running:
                # if RECORDED
                self._record_end()
                # endif
                return False
            self._now = now
            # if SAMPLES_INPUTS
            if self.SAMPLES_INPUTS:
                self._try_eventless()
            # endif
            allowance = self._queue_count + self.MICROSTEPS
            # if DEFERRAL
            allowance += self._deferred_count
            # endif
            while self._running:
                if allowance > 0 and self._take_queued():
                    allowance -= 1
                # if TIMED
                elif self._is_due(now):
                    self._fire()
                    allowance = self.MICROSTEPS
                # endif
                else:
                    break
            self._now = now
            # if RECORDED
            self._record_end()
            # endif
        # if CALLS_HOST
        except BaseException:
            self._break_off()
            raise
        # endif
        finally:
            self._busy = False
        return self._running

    def _is_due(self, now: int) -> bool:
        """Return whether a timer has expired."""
        return self._timer_count > 0 and (now - self._timer_due[0]) & CLOCK < FAR

    def next_deadline(self) -> int | None:
        """Return the first deadline in ticks, or None if no timer is armed."""
        # if TIMED
        if self._timer_count:
            return self._timer_due[0]
        # endif
        return None

    def is_in(self, state: str) -> bool:
        """Whether the state of that name is active."""
        bit = self._BITS.get(state)
        if bit is None:
            raise ValueError(f"{self.NAME} has no state {state!r}")
        return self._active & bit != 0

    @property
    def running(self) -> bool:
        """Whether the machine was started and neither finished nor stopped by a fault."""
        return self._running

    @property
    def finished(self) -> bool:
        """Whether the machine ended in a top-level final state."""
        return self._finished

    @property
    def fault(self) -> str | None:
        """Why the machine stopped; None if it did not."""
        return self._fault

    def _claim(self) -> None:
        """Start a call of the host; it fails if another call is in progress."""
        if self._busy:
            raise RuntimeError(f"{self.NAME} was called from within one of its own steps")
        self._busy = True

    def _named(self, event: str, payload: tuple[Any, ...]) -> tuple[int, int]:
        """Return the number of an event and the size of its payload."""
        found = self._POSTABLE.get(event)
        if found is None:
            known = ", ".join(self._POSTABLE)
            raise ValueError(f"{self.NAME} receives no event {event!r}, but {known}")
        if len(payload) != found[1]:
            raise TypeError(f"{event} carries {found[1]} values, not {len(payload)}")
        return found

    def _place(self, event: int, size: int, payload: tuple[Any, ...]) -> bool:
        """Put an event into the queue; False if that is full or the machine does not run."""
        # if RECORDED
        self._record_posted(event, payload)
        # endif
        at = self._enqueue(event)
        if at < 0:
            return False
        # if PAYLOAD
        if self.WIDTH:
            self._queue_fields[at : at + size] = payload
        # endif
        return True
