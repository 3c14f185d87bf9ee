"""Macrosteps: selection, microsteps, the loop until the configuration is stable (Appendix D)."""

from __future__ import annotations

from typing import Any

from fsmkit.runtime.python.arithmetic import ContentError, RangeFault
from fsmkit.runtime.python.timers import Timers
from fsmkit.runtime.python.trace import NOTHING


class Stepping(Timers):
    """The reaction of a machine to an event or a timeout."""

    # --- copied from here on into each generated class --------------------------------------------

    # --- macrosteps -------------------------------------------------------------------------------

    def _open(self, event: int) -> None:
        """Start the macrostep of an event whose payload is stored."""
        self._budget = self.MICROSTEPS
        self._event = event
        if self.trace is not None:
            self._cause = f"@{self._now} > event {self._spell(event, self._fields, 0)}"
            self._tell(None)

    def _try_eventless(self) -> None:
        """Take the eventless transitions that the inputs enable."""
        self._budget = self.MICROSTEPS
        self._event = NOTHING
        if self.trace is not None:
            self._cause = f"@{self._now} > eventless"
        self._settle()

    def _take_queued(self) -> bool:
        """Take the oldest recalled event, else the oldest queued one; return whether it exists."""
        # if DEFERRAL
        event = self._recall() if self._deferred_count else self._take_external()
        # else
        event = self._take_external()
        # endif
        if event == NOTHING:
            return False
        self._open(event)
        self._react(event, may_defer=True)
        self._settle()
        return True

    def _react(self, event: int, *, may_defer: bool) -> bool:
        """Take the transitions that an event enables; else defer it or report it as unhandled."""
        self._event = event
        self._is_deferred = False
        self._tried = 0
        self._budget -= 1
        on = self._ON[event]
        if on is not None and on(self):
            return True
        # if DEFERRAL
        if self._is_deferred and may_defer and self._has_room():
            self._defer(event)
            return False
        # endif
        if self.trace is not None:
            self._tell("unhandled " + self.EVENTS[event])
        # if ERROR_FAULTS
        if event in self.ERRORS:
            self._stop(self.EVENTS[event])
        # endif
        return False

    def _settle(self) -> None:
        """Go on until the configuration is stable (SCXML Appendix D, mainEventLoop)."""
        while self._running and self._fault is None:
            self._tried = 0
            chosen = self._select_eventless()
            # if INTERNAL
            if self._fault is not None or not (chosen or self._internal_count):
                break
            # else
            if self._fault is not None or not chosen:
                break
            # endif
            if self._budget <= 0:
                self._stop("microsteps")
            elif chosen:
                self._budget -= 1
                self._microstep(chosen)
            # if INTERNAL
            elif self._internal_count:
                self._react(self._take_internal(), may_defer=False)
            # endif
        if self._fault is not None:
            self._running = self._finished = False
        elif not self._running:
            self._end()
        if self._cause is None and self.trace is not None:
            end = (*self.active(), "finished") if self._finished else self.active()
            self._tell(" ".join(("=", *end)))
        self._cause = None

    def _microstep(self, chosen: int) -> None:
        """Exit, run the content of the transitions, enter (Appendix D, microstep)."""
        # if REGIONS
        if chosen & chosen - 1:
            self._take_several(chosen)
            return
        # endif
        index = chosen.bit_length() - 1
        if (leave := self._LEAVE[index]) is not None:
            leave(self)
        if self.trace is not None:
            self._tell(f"t {index}")
        # if RECORDED
        self._record_taken(index)
        # endif
        # if COVERED
        self._count_taken(index)
        # endif
        if (do := self._DO[index]) is not None:
            do(self)
        if (enter := self._ENTER[index]) is not None:
            enter(self)

    def _take_several(self, chosen: int) -> None:
        """Take several transitions in one microstep."""
        # all leave and enter in document order, but act in the order in which they were selected
        rest = chosen
        while rest:
            index = rest.bit_length() - 1
            rest ^= 1 << index
            if (leave := self._LEAVE[index]) is not None:
                leave(self)
        for index in self._offered:
            if not chosen >> index & 1:
                continue
            if self.trace is not None:
                self._tell(f"t {index}")
            # if RECORDED
            self._record_taken(index)
            # endif
            # if COVERED
            self._count_taken(index)
            # endif
            if (do := self._DO[index]) is not None:
                do(self)
        rest = chosen
        while rest:
            index = (rest & -rest).bit_length() - 1
            rest &= rest - 1
            if (enter := self._ENTER[index]) is not None:
                enter(self)

    def _end(self) -> None:
        """Leave all states, innermost first (Appendix D, exitInterpreter)."""
        rest = self._active & ~1
        while rest:
            state = rest.bit_length() - 1
            rest ^= 1 << state
            if self.trace is not None:
                self._tell("- " + self.STATES[state])
            if (exited := self._EXITED[state]) is not None:
                exited(self)
        self._empty_queues()

    def _exit(self, states: int) -> None:
        """Leave active states, innermost first."""
        while states:
            state = states.bit_length() - 1
            bit = 1 << state
            states ^= bit
            if self.trace is not None:
                self._tell("- " + self.STATES[state])
            if (exited := self._EXITED[state]) is not None:
                exited(self)
            self._active ^= bit

    def _enter(self, states: int, defaults: int) -> None:
        """Enter states, outermost first; ``defaults``: initial transitions with content to run."""
        states &= ~self._active
        while states:
            bit = states & -states
            states ^= bit
            state = bit.bit_length() - 1
            self._active |= bit
            if self.trace is not None:
                self._tell("+ " + self.STATES[state])
            # if COVERED
            self._count(state)
            # endif
            if (entered := self._ENTERED[state]) is not None:
                entered(self, defaults)

    def _finish(self) -> None:
        """Note that a top-level final state was entered."""
        self._running = False
        self._finished = True

    def _field(self, name: str) -> Any:
        """Return a field of the current payload; fails if the current event lacks it."""
        at = self.FIELDS[self._event].get(name) if self._event >= 0 else None
        if at is None:
            raise ContentError(f"the current event has no field {name}")
        return self._fields[at]

    def _event_name(self, texts: tuple[str, ...] | None = None) -> str:
        """Return the name of the current event, or its entry in ``texts``; empty if no event."""
        return (texts or self.EVENTS)[self._event] if self._event >= 0 else ""

    # --- timeouts ---------------------------------------------------------------------------------

    def _fire(self) -> None:
        """Fire the first timer, at its deadline."""
        what = self._timer_what[0]
        self._now = self._timer_due[0]
        # if DELAYS
        if what < 0:
            self._deliver(~what)
            return
        # endif
        # if TIMEOUTS
        self._remove(0)
        self._time_out(what)
        # endif

    def _deliver(self, event: int) -> None:
        """Send the delayed event of the first timer."""
        route = self._timer_route[0]
        peer = self._timer_peer[0]
        # if PAYLOAD
        for k in range(self.WIDTH):
            self._fields[k] = self._timer_fields[k]
        # endif
        self._remove(0)
        self._sends -= 1
        # if DELAYS_INTERNAL
        if route == 1:
            self._open(event)
            self._react(event, may_defer=False)
            self._settle()
        # endif
        # if DELAYS_PORT
        if route == 2:
            port = self._PORTS[event]
            if port is not None:
                port(self, peer)
        # endif
        # if DELAYS_SELF
        if route == 0:
            at = self._enqueue_own(event)
            # if PAYLOAD
            if at >= 0:
                for k in range(self.WIDTH):
                    self._queue_fields[at + k] = self._fields[k]
            # endif
        # endif

    def _time_out(self, transition: int) -> None:
        """Take the first enabled transition that waits for a timer, if any."""
        self._budget = self.MICROSTEPS - 1
        self._event = NOTHING
        if self.trace is not None:
            self._cause = f"@{self._now} > timeout {transition}"
            self._tell(None)
        # if PERIODS
        if self.PERIODS[transition]:
            self._arm(transition, self.PERIODS[transition])
        # endif
        self._tried = 0
        # if TIMED_GUARDS
        if (self._GUARDS[transition] is None or self._test(transition)) and self._fault is None:
            self._microstep(1 << transition)
        # if ALTERNATIVES
        else:
            for other in self.OTHERS[transition]:
                if self._fault is not None:
                    break
                if (self._GUARDS[other] is None or self._test(other)) and self._fault is None:
                    self._microstep(1 << other)
                    break
        # endif
        # else
        if self._fault is None:
            self._microstep(1 << transition)
        # endif
        self._settle()

    # --- selection --------------------------------------------------------------------------------

    def _offer(self, transition: int) -> None:
        """Add an enabled transition unless it is preempted (removeConflictingTransitions)."""
        bit = 1 << transition
        if self._seen & bit:
            return
        self._seen |= bit
        self._offered.append(transition)
        clash = self._chosen & self._clashes(transition)
        if not clash & ~self.OUTER[transition]:
            self._chosen = self._chosen & ~clash | bit

    def _clashes(self, transition: int) -> int:
        """Return the transitions whose exit sets intersect that of `transition`."""
        return self.CLASHES[transition]

    def _test(self, transition: int) -> bool:
        """Evaluate a guard once per selection; a failing guard is false."""
        bit = 1 << transition
        if self._tried & bit:
            return bool(self._held & bit)
        self._tried |= bit
        self._held &= ~bit
        guard = self._GUARDS[transition]
        try:
            is_held = guard is None or guard(self)
        except ContentError:
            self._error_execution()
            return False
        except RangeFault:
            self._stop("range")
            return False
        if is_held:
            self._held |= bit
        return is_held

    def active(self) -> tuple[str, ...]:
        """Return the names of the active atomic states, in document order."""
        leaves = self._active & self.LEAVES
        return tuple([name for bit, name in enumerate(self.STATES) if leaves >> bit & 1])

    def _empty_queues(self) -> None:
        """Drop all events and timers."""
        self._queue_head = 0
        self._queue_count = 0
        self._deferred_count = 0
        self._internal_head = 0
        self._internal_count = 0
        self._timer_count = 0
        self._sends = 0
