"""Invoking and invoked machines (SCXML 6.4, 6.5), with slots that are allocated once."""

# ruff: noqa: SLF001, SIM110  (machines of one family know each other; a generator is an object)

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from fsmkit.runtime.python.machine import Machine
from fsmkit.runtime.python.trace import CLOCK, FAR, NOTHING


class Invoking(Machine):
    """A machine with slots for others, which know it; each is running or its slot is free."""

    INVOCATIONS: ClassVar[tuple[str, ...]]
    FORWARDING: ClassVar[tuple[int, ...]]
    ADDRESSES: ClassVar[tuple[tuple[int, ...], ...]]
    PASSAGES: ClassVar[tuple[tuple[tuple[int, tuple[tuple[int, Any], ...]] | None, ...], ...]]
    RETURNS: ClassVar[tuple[tuple[int, ...], ...]]
    ERROR_COMMUNICATION: ClassVar[int]
    _INVOKE: ClassVar[tuple[Callable[[Any], None] | None, ...]]
    _FINALIZE: ClassVar[tuple[Callable[[Any], None] | None, ...]]

    _children: tuple[Any, ...]
    _invoker: Any
    _is_cancelled: bool
    _passed: list[Any]
    _relay: Callable[[str], object]
    _slot: int
    _waiting: int

    def _conclude(self) -> None:
        """Send ``done.invoke`` to the invoker, with the data of the final state."""

    # --- copied from here on into each generated class --------------------------------------------

    def _adopt(self, children: tuple[Any, ...]) -> None:
        """Take the machines of all slots, once for ever."""
        self._children = children
        self._invoker = None
        self._slot = 0
        self._relay = self._tell_invoker
        self._passed = [0] * self.WIDTH
        for slot, child in enumerate(children):
            child._invoker = self
            child._slot = slot

    def _clear(self, now: int) -> None:
        super()._clear(now)
        self._waiting = 0
        self._is_cancelled = False
        for child in self._children:
            child._running = False

    def _claim(self) -> None:
        super()._claim()
        self._share()

    def _share(self) -> None:
        """Give the invoked machines the trace function of this machine."""
        for child in self._children:
            child.trace = None if self.trace is None else child._relay
            child.log = self.log
            child._share()

    def _tell_invoker(self, line: str) -> None:
        self._invoker._tell(f"{self._invoker.INVOCATIONS[self._slot]}: {line}")

    # --- interface for hosts ------------------------------------------------------------------

    def _is_due(self, now: int) -> bool:
        due = self.next_deadline()
        return due is not None and (now - due) & CLOCK < FAR

    def next_deadline(self) -> int | None:
        """Return the first deadline in ticks, or None if no timer is armed."""
        first = super().next_deadline()
        for child in self._children:
            if child._running:
                due: int | None = child.next_deadline()
                if due is not None and (first is None or (due - first) & CLOCK >= FAR):
                    first = due
        return first

    # --- macrosteps -------------------------------------------------------------------------------

    def _open(self, event: int) -> None:
        """Start the macrostep of an event that has just left the external queue."""
        super()._open(event)
        if (finalize := self._FINALIZE[event]) is not None:
            finalize(self)
        for slot in self.FORWARDING:
            self._forward(slot, event, self._fields)

    def _take_queued(self) -> bool:
        """Take an event as a machine alone does; without any, let the invoked ones go on."""
        waiting = self._deferred_count
        event = self._recall() if waiting else self._take_external()
        if event == NOTHING:
            is_done = self._settle_invoked()
            self._close()
            return is_done
        if self._deferred_count < waiting:  # it was opened when it was deferred
            super()._open(event)
        else:
            self._open(event)
        self._react(event, may_defer=True)
        self._settle()
        return True

    def _settle(self) -> None:
        """Run to a stable configuration and start its invocations."""
        self._complete()
        while self._waiting and self._running and self._fault is None:
            rest, self._waiting = self._waiting, 0
            while rest:
                state = (rest & -rest).bit_length() - 1
                rest &= rest - 1
                if (invoke := self._INVOKE[state]) is not None:
                    invoke(self)
            if self._internal_count:  # invoking may have raised errors
                self._complete()
        if self._running and self._fault is None:
            self._settle_invoked()
        if self._fault is None and not self._running:
            self._end()
        else:
            self._close()
        if self._cause is None and self.trace is not None:
            end = (*self.active(), "finished") if self._finished else self.active()
            self._tell(" ".join(("=", *end)))
        self._cause = None

    def _complete(self) -> None:
        """Go on until the configuration is stable (SCXML Appendix D, mainEventLoop)."""
        while self._running and self._fault is None:
            self._tried = 0
            chosen = self._select_eventless()
            if self._fault is not None or not (chosen or self._internal_count):
                break
            if self._budget <= 0:
                self._stop("microsteps")
            elif chosen:
                self._budget -= 1
                self._microstep(chosen)
            else:
                self._react(self._take_internal(), may_defer=False)

    def _close(self) -> None:
        if self._fault is not None:
            self._running = self._finished = False

    def _end(self) -> None:
        """Exit all states (Appendix D, exitInterpreter), and notify the invoker."""
        super()._end()
        if self._finished:
            self._conclude()

    def _fire(self) -> None:
        """Fire the first timer at its deadline; of equal ones, the machine's own comes first."""
        due = self.next_deadline()
        if not self._timer_count or self._timer_due[0] != due:
            self._now = due or 0
            for child in self._children:
                if child._running and child.next_deadline() == due:
                    child._fire()
                    self._absorb(child)
                    break
            if self._fault is None:
                self._settle_invoked()
            self._close()
            return
        route = self._timer_route[0]
        if self._timer_what[0] >= 0 or route in (0, 2):
            super()._fire()
            return
        event, peer = ~self._timer_what[0], self._timer_peer[0]
        self._now = self._timer_due[0]
        for k in range(self.WIDTH):
            self._fields[k] = self._timer_fields[k]
        self._remove(0)
        self._sends -= 1
        if route >= 4 and not self._has_running(self.ADDRESSES[route - 4]):
            event, route = self.ERROR_COMMUNICATION, 1
        if route == 1:
            super()._open(event)
            self._react(event, may_defer=False)
            self._settle()
            return
        if route == 3:
            self._answer(event, self._fields)
        else:
            self._hand(self.ADDRESSES[route - 4], event, self._fields, peer)
        self._settle_invoked()
        self._close()

    # --- invoked machines -------------------------------------------------------------------------

    def _commence(self, child: Any) -> None:
        """Start an invoked machine whose data are set, and run its first macrostep."""
        child._clear(self._now)
        if child.trace is not None:
            child._cause = f"@{self._now} > start"
            child._tell(None)
        # if RECORDED
        child._record_started()
        # endif
        child._budget = child.MICROSTEPS - 1
        child._begin()
        child._settle()
        self._absorb(child)

    def _settle_invoked(self) -> bool:
        """Let each invoked machine take one event in turn, in document order, until all are quiet.

        This repeats at most `MICROSTEPS` times. The rest waits for the next step.
        """
        is_done = False
        for _ in range(self.MICROSTEPS):
            is_quiet = True
            for child in self._children:
                if child._running and self._fault is None:
                    child._now = self._now
                    if child._take_queued():
                        is_quiet = False
                        self._absorb(child)
            if is_quiet:
                break
            is_done = True
        return is_done

    def _absorb(self, child: Any) -> None:
        """Make the fault of an invoked machine one of this."""
        if child._fault is not None:
            self._stop("invoked")

    def _dismiss(self, slot: int) -> None:
        """Cancel an invoked machine: it exits its states; its events are dropped (SCXML 6.4.3)."""
        child = self._children[slot]
        if child._running:
            child._now = self._now
            child._is_cancelled = True
            child._running = False
            child._end()
            self._absorb(child)

    # --- events between them ----------------------------------------------------------------------

    def _answer(self, event: int, fields: list[Any]) -> None:
        """Put an event into the queue of the invoker, which may be cancelling this machine."""
        if self.trace is not None:
            self._tell(f"out {self._spell(event, fields, 0)} to #_parent")
        if self._is_cancelled:
            return
        invoker = self._invoker
        if invoker is None or invoker._queue_count + invoker._deferred_count >= invoker.QUEUE:
            if self.trace is not None:
                self._tell("full queue")
            return
        there = invoker.RETURNS[self._slot][event]
        if there < 0:
            return
        at = invoker._enqueue(there)
        for k in range(len(self.FIELDS[event])):
            invoker._queue_fields[at + k] = fields[k]

    def _hand(
        self, slots: tuple[int, ...], event: int, fields: list[Any], peer: str | None
    ) -> None:
        """Put an event into the queue of the first invoked machine that is running."""
        if self.trace is not None:
            to = "" if peer is None else f" to {peer}"
            self._tell(f"out {self._spell(event, fields, 0)}{to}")
        for slot in slots:
            if self._children[slot]._running:
                self._forward(slot, event, fields)
                return
        if self.trace is not None:
            self._tell("error error.communication")
        if self.ERROR_COMMUNICATION >= 0:
            self._enqueue_internal(self.ERROR_COMMUNICATION)

    def _forward(self, slot: int, event: int, fields: list[Any]) -> None:
        """Put an event into the queue of an invoked machine, if it runs and knows that event."""
        child = self._children[slot]
        passage = self.PASSAGES[slot][event]
        if passage is None or not child._running:
            return
        at = child._enqueue(passage[0])
        if at < 0:
            if self.trace is not None:
                self._tell("full queue")
            return
        for place, absent in passage[1]:
            child._queue_fields[at] = absent if place < 0 else fields[place]
            at += 1

    def _has_running(self, slots: tuple[int, ...]) -> bool:
        for slot in slots:
            if self._children[slot]._running:
                return True
        return False
