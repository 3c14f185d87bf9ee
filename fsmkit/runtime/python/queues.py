"""The queues of a machine, and the errors it raises."""

from __future__ import annotations

from fsmkit.runtime.python.trace import NOTHING, Traced


class Queues(Traced):
    """Events that wait: external, deferred, internal."""

    # --- copied from here on into each generated class --------------------------------------------

    # --- queues and errors ------------------------------------------------------------------------

    def _has_room(self) -> bool:
        """Whether the external queue takes one more event, deferred ones included."""
        waiting = self._queue_count
        # if DEFERRAL
        waiting += self._deferred_count
        # endif
        return waiting < self.QUEUE

    def _enqueue(self, event: int) -> int:
        """Append to the external queue; return the index for the payload, or -1 if full."""
        if not self._running or not self._has_room():
            return NOTHING
        at = (self._queue_head + self._queue_count) % self.QUEUE
        self._queue_count += 1
        self._queue_event[at] = event
        # if PAYLOAD
        at *= self.WIDTH
        # endif
        return at

    def _enqueue_own(self, event: int) -> int:
        """Append an event that the machine sends to itself, and report an overflow."""
        if not self._has_room():
            if self.trace is not None:
                self._tell("full queue")
            return NOTHING
        at = (self._queue_head + self._queue_count) % self.QUEUE
        self._queue_count += 1
        self._queue_event[at] = event
        # if PAYLOAD
        at *= self.WIDTH
        # endif
        return at

    def _enqueue_internal(self, event: int) -> int:
        """Append to the internal queue; return the index for the payload. Overflow is a fault."""
        if self._internal_count >= self.INTERNAL:
            if self.trace is not None:
                self._tell("full internal")
            self._stop("internal")
            return NOTHING
        at = (self._internal_head + self._internal_count) % self.INTERNAL
        self._internal_count += 1
        self._internal_event[at] = event
        # if PAYLOAD
        if self.WIDTH:
            self._internal_fields[at * self.WIDTH] = ""  # the only payload of an error is an id
        # endif
        # if PAYLOAD
        at *= self.WIDTH
        # endif
        return at

    def _recall(self) -> int:
        """Take the oldest event that no active state defers now, else the oldest queued one."""
        for i in range(self._deferred_count):
            event = self._deferred_event[i]
            if not self._active & self.DEFERRING[event]:
                # if PAYLOAD
                for k in range(self.WIDTH):
                    self._fields[k] = self._deferred_fields[i * self.WIDTH + k]
                # endif
                self._deferred_count -= 1
                for j in range(i, self._deferred_count):
                    self._deferred_event[j] = self._deferred_event[j + 1]
                # if PAYLOAD
                for k in range(i * self.WIDTH, self._deferred_count * self.WIDTH):
                    self._deferred_fields[k] = self._deferred_fields[k + self.WIDTH]
                # endif
                return event
        return self._take_external()

    def _take_external(self) -> int:
        """Take the oldest event of the queue, with its payload."""
        if not self._queue_count:
            return NOTHING
        at = self._queue_head
        self._queue_head = (at + 1) % self.QUEUE
        self._queue_count -= 1
        # if PAYLOAD
        for k in range(self.WIDTH):
            self._fields[k] = self._queue_fields[at * self.WIDTH + k]
        # endif
        return self._queue_event[at]

    def _take_internal(self) -> int:
        """Take the oldest internal event, with its payload."""
        at = self._internal_head
        self._internal_head = (at + 1) % self.INTERNAL
        self._internal_count -= 1
        # if PAYLOAD
        for k in range(self.WIDTH):
            self._fields[k] = self._internal_fields[at * self.WIDTH + k]
        # endif
        return self._internal_event[at]

    def _defer(self, event: int) -> None:
        """Keep the current event until no active state defers it."""
        at = self._deferred_count
        self._deferred_count += 1
        self._deferred_event[at] = event
        # if PAYLOAD
        for k in range(self.WIDTH):
            self._deferred_fields[at * self.WIDTH + k] = self._fields[k]
        # endif

    def _stop(self, reason: str) -> None:
        """Put the machine into a fault; the first one counts."""
        if self._fault is None:
            self._fault = reason
            if self.trace is not None:
                self._tell("fault " + reason)

    def _break_off(self) -> None:
        """Stop in the midst of a step, in which the host raised an exception."""
        if self._fault is None:
            self._fault = "exception"
        self._running = self._finished = False
        # if RECORDED
        self._record_broken()
        # endif

    def _error_execution(self) -> None:
        """Report content that could not be evaluated."""
        if self.trace is not None:
            self._tell("error error.execution")
        if self.ERROR_EXECUTION >= 0:
            self._enqueue_internal(self.ERROR_EXECUTION)

    def _clamp(self, value: int, lo: int, hi: int) -> int:
        """Return the nearest value of a range, and report a change."""
        if lo <= value <= hi:
            return value
        if self.trace is not None:
            self._tell("error error.range")
        if self.ERROR_RANGE >= 0:
            self._enqueue_internal(self.ERROR_RANGE)
        return lo if value < lo else hi
