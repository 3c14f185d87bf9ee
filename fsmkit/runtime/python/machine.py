"""The part of every generated machine that does not depend on its chart: queues, timers, the loop.

The body of `Machine` is copied into each generated class, which supplies the constants and tables
that are only declared here. Sets of states and of transitions are integers, one bit for each;
queues and timers are lists that never change their length: a step makes nothing that the garbage
collector would have to look after.

The payload of entry ``i`` of a queue is ``fields[i * WIDTH : i * WIDTH + WIDTH]``. Times are ticks
modulo 2^32; deadlines compare by their distance, which is below 2^31.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from fsmkit.runtime.python.arithmetic import ContentError, RangeFault, shown

CLOCK = 0xFFFFFFFF
FAR = 0x80000000
NOTHING = -1


class Machine:
    """A running chart."""

    __slots__ = (
        "_active",
        "_budget",
        "_busy",
        "_cause",
        "_chosen",
        "_deferred_count",
        "_deferred_event",
        "_deferred_fields",
        "_event",
        "_fault",
        "_fields",
        "_finished",
        "_held",
        "_host",
        "_internal_count",
        "_internal_event",
        "_internal_fields",
        "_internal_head",
        "_is_deferred",
        "_now",
        "_queue_count",
        "_queue_event",
        "_queue_fields",
        "_queue_head",
        "_running",
        "_seen",
        "_sends",
        "_timer_count",
        "_timer_due",
        "_timer_fields",
        "_timer_mark",
        "_timer_peer",
        "_timer_route",
        "_timer_what",
        "_tried",
        "log",
        "reply",
        "trace",
    )

    NAME: ClassVar[str]
    STATES: ClassVar[tuple[str, ...]]
    EVENTS: ClassVar[tuple[str, ...]]
    OPERATIONS: ClassVar[tuple[str, ...]]
    FIELDS: ClassVar[tuple[dict[str, int], ...]]
    LEAVES: ClassVar[int]
    WIDTH: ClassVar[int]
    QUEUE: ClassVar[int]
    INTERNAL: ClassVar[int]
    DELAYED: ClassVar[int]
    MICROSTEPS: ClassVar[int]
    TIMERS: ClassVar[int]
    SAMPLES_INPUTS: ClassVar[bool]
    ERRORS: ClassVar[frozenset[int]]
    ERROR_EXECUTION: ClassVar[int]
    ERROR_RANGE: ClassVar[int]
    DEFERRING: ClassVar[tuple[int, ...]]
    PERIODS: ClassVar[tuple[int, ...]]
    OUTER: ClassVar[tuple[int, ...]]
    CLASHES: ClassVar[tuple[int, ...]]
    _POSTABLE: ClassVar[dict[str, tuple[int, int]]]
    _SELECT: ClassVar[tuple[Callable[[Any], int] | None, ...]]
    _LEAVE: ClassVar[tuple[Callable[[Any], None] | None, ...]]
    _DO: ClassVar[tuple[Callable[[Any], None] | None, ...]]
    _ENTER: ClassVar[tuple[Callable[[Any], None] | None, ...]]
    _EXITED: ClassVar[tuple[Callable[[Any], None] | None, ...]]
    _ENTERED: ClassVar[tuple[Callable[[Any, int], None] | None, ...]]
    _GUARDS: ClassVar[tuple[Callable[[Any], bool] | None, ...]]
    _PORTS: ClassVar[tuple[Callable[[Any, str | None], None] | None, ...]]

    trace: Callable[[str], object] | None
    log: Callable[..., object] | None
    reply: Any

    def _reset_data(self) -> None:
        """Give data, outputs and histories their start values."""

    def _begin(self) -> None:
        """Run the script and enter the initial states."""

    def _select_eventless(self) -> int:
        """Return the eventless transitions to take."""
        return 0

    # --- copied from here on into each generated class --------------------------------------------

    def _prepare(self, operations: object | None) -> None:
        """Make all queues and timers that there will ever be."""
        self._host: Any = self if operations is None else operations
        missing = [name for name in self.OPERATIONS if not hasattr(self._host, name)]
        if missing:
            names = ", ".join(missing)
            raise TypeError(f"{type(self._host).__name__} lacks what {self.NAME} calls: {names}")
        self.trace = None
        self.log = None
        self.reply = None
        width = self.WIDTH
        self._fields: list[Any] = [0] * width
        self._queue_event = [0] * self.QUEUE
        self._queue_fields: list[Any] = [0] * (self.QUEUE * width)
        self._deferred_event = [0] * self.QUEUE
        self._deferred_fields: list[Any] = [0] * (self.QUEUE * width)
        self._internal_event = [0] * self.INTERNAL
        self._internal_fields: list[Any] = [0] * (self.INTERNAL * width)
        self._timer_due = [0] * self.TIMERS
        self._timer_what = [0] * self.TIMERS
        self._timer_mark = [0] * self.TIMERS
        self._timer_route = [0] * self.TIMERS
        self._timer_peer: list[str | None] = [None] * self.TIMERS
        self._timer_fields: list[Any] = [0] * (self.TIMERS * width)
        self._busy = False
        self._clear(0)
        self._running = False
        self._reset_data()

    def _clear(self, now: int) -> None:
        self._active = 1
        self._fault: str | None = None
        self._finished = False
        self._running = True
        self._now = now & CLOCK
        self._event = NOTHING
        self._budget = 0
        self._cause: str | None = None
        self._is_deferred = False
        self._tried = self._held = self._seen = self._chosen = 0
        self._empty_queues()

    def _empty_queues(self) -> None:
        self._queue_head = self._queue_count = self._deferred_count = 0
        self._internal_head = self._internal_count = 0
        self._timer_count = self._sends = 0

    # --- what a host calls ------------------------------------------------------------------------

    def start(self, now: int = 0) -> None:
        """Begin, or begin anew, at a time in ticks: enter the initial states."""
        self._claim()
        try:
            self._reset_data()
            self._clear(now)
            if self.trace is not None:
                self._cause = f"@{self._now} > start"
                self._tell(None)
            self._budget = self.MICROSTEPS - 1
            self._begin()
            self._settle()
        finally:
            self._busy = False

    def post(self, event: str, *payload: Any) -> bool:
        """Put an event into the queue; False if that is full or the machine does not run."""
        return self._place(*self._named(event, payload), payload)

    def dispatch(self, event: str, *payload: Any) -> bool:
        """Process one event at once, ahead of the queue; whether it enabled a transition.

        A value given by ``reply`` is then in `reply`.
        """
        index, _ = self._named(event, payload)
        self._claim()
        try:
            self.reply = None
            if not self._running:
                return False
            self._fields[: len(payload)] = payload
            self._open(index)
            is_handled = self._react(index, may_defer=False)
            self._settle()
        finally:
            self._busy = False
        return is_handled

    def run(self, now: int) -> bool:
        """Do all that is to be done until a time in ticks; whether the machine goes on running.

        First the events of the queue, then the timers that are due, each with the events that the
        machine sends itself meanwhile.
        """
        self._claim()
        try:
            now &= CLOCK
            if not self._running:
                return False
            self._now = now
            if self.SAMPLES_INPUTS:
                self._try_eventless()
            allowance = self._queue_count + self._deferred_count + self.MICROSTEPS
            while self._running:
                if allowance > 0 and self._take_queued():
                    allowance -= 1
                elif self._timer_count and (now - self._timer_due[0]) & CLOCK < FAR:
                    self._fire()
                    allowance = self.MICROSTEPS
                else:
                    break
            self._now = now
        finally:
            self._busy = False
        return self._running

    def next_deadline(self) -> int | None:
        """Return when the first timer is due, in ticks; None where none is armed."""
        return self._timer_due[0] if self._timer_count else None

    def is_in(self, state: str) -> bool:
        """Whether the state of that name is active."""
        return bool(self._active >> self.STATES.index(state) & 1)

    def active(self) -> tuple[str, ...]:
        """Return the names of the active atomic states, in document order."""
        leaves = self._active & self.LEAVES
        return tuple([name for bit, name in enumerate(self.STATES) if leaves >> bit & 1])

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
        if self._busy:
            raise RuntimeError(f"{self.NAME} was called from within one of its own steps")
        self._busy = True

    def _named(self, event: str, payload: tuple[Any, ...]) -> tuple[int, int]:
        found = self._POSTABLE.get(event)
        if found is None:
            known = ", ".join(self._POSTABLE)
            raise ValueError(f"{self.NAME} receives no event {event!r}, but {known}")
        if len(payload) != found[1]:
            raise TypeError(f"{event} carries {found[1]} values, not {len(payload)}")
        return found

    def _place(self, event: int, size: int, payload: tuple[Any, ...]) -> bool:
        at = self._enqueue(event)
        if at < 0:
            return False
        self._queue_fields[at : at + size] = payload
        return True

    # --- macrosteps -------------------------------------------------------------------------------

    def _open(self, event: int) -> None:
        """Begin the macrostep of an event, whose payload is at hand."""
        self._budget = self.MICROSTEPS
        self._event = event
        if self.trace is not None:
            self._cause = f"@{self._now} > event {self._spell(event, self._fields, 0)}"
            self._tell(None)

    def _try_eventless(self) -> None:
        self._budget = self.MICROSTEPS
        self._event = NOTHING
        if self.trace is not None:
            self._cause = f"@{self._now} > eventless"
        self._settle()

    def _take_queued(self) -> bool:
        """Take the oldest recalled event, else the oldest of the queue, if there is one."""
        width = self.WIDTH
        for i in range(self._deferred_count):
            event = self._deferred_event[i]
            if not self._active & self.DEFERRING[event]:
                for k in range(width):
                    self._fields[k] = self._deferred_fields[i * width + k]
                self._deferred_count -= 1
                for j in range(i, self._deferred_count):
                    self._deferred_event[j] = self._deferred_event[j + 1]
                for k in range(i * width, self._deferred_count * width):
                    self._deferred_fields[k] = self._deferred_fields[k + width]
                break
        else:
            if not self._queue_count:
                return False
            at = self._queue_head
            event = self._queue_event[at]
            for k in range(width):
                self._fields[k] = self._queue_fields[at * width + k]
            self._queue_head = (at + 1) % self.QUEUE
            self._queue_count -= 1
        self._open(event)
        self._react(event, may_defer=True)
        self._settle()
        return True

    def _react(self, event: int, *, may_defer: bool) -> bool:
        """Take what an event enables; else keep it for later, or tell that nobody wants it."""
        self._event = event
        self._is_deferred = False
        self._tried = 0
        select = self._SELECT[event]
        chosen = 0 if select is None else select(self)
        self._budget -= 1
        if not chosen:
            if self._is_deferred and may_defer:
                self._defer(event)
                return False
            if self.trace is not None:
                self._tell("unhandled " + self.EVENTS[event])
            if event in self.ERRORS:
                self._stop(self.EVENTS[event])
            return False
        if self._fault is not None:
            return False
        self._microstep(chosen)
        return True

    def _settle(self) -> None:
        """Go on until the configuration is stable (SCXML Appendix D, mainEventLoop)."""
        while self._running and self._fault is None:
            self._tried = 0
            chosen = self._select_eventless()
            if not chosen and not self._internal_count:
                break
            if self._budget <= 0:
                self._stop("microsteps")
            elif chosen:
                self._budget -= 1
                if self._fault is None:
                    self._microstep(chosen)
            else:
                self._react(self._take_internal(), may_defer=False)
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
        if not chosen & chosen - 1:
            index = chosen.bit_length() - 1
            if (leave := self._LEAVE[index]) is not None:
                leave(self)
            if self.trace is not None:
                self._tell(f"t {index}")
            if (do := self._DO[index]) is not None:
                do(self)
            if (enter := self._ENTER[index]) is not None:
                enter(self)
            return
        # the transitions lie in different regions, whose order is theirs
        rest = chosen
        while rest:
            index = rest.bit_length() - 1
            rest ^= 1 << index
            if (leave := self._LEAVE[index]) is not None:
                leave(self)
        rest = chosen
        while rest:
            index = (rest & -rest).bit_length() - 1
            rest &= rest - 1
            if self.trace is not None:
                self._tell(f"t {index}")
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
            if (entered := self._ENTERED[state]) is not None:
                entered(self, defaults)

    def _finish(self) -> None:
        """Note that a top-level final state was entered."""
        self._running = False
        self._finished = True

    def _field(self, name: str) -> Any:
        """Return a part of the payload at hand; the event may be one that has no such part."""
        at = self.FIELDS[self._event].get(name) if self._event >= 0 else None
        if at is None:
            raise ContentError(f"no event with {name} is at hand")
        return self._fields[at]

    def _event_name(self) -> str:
        """Return the name of the event at hand, empty where there is none."""
        return self.EVENTS[self._event] if self._event >= 0 else ""

    # --- selection --------------------------------------------------------------------------------

    def _offer(self, transition: int) -> None:
        """Add an enabled transition unless it is preempted (removeConflictingTransitions)."""
        bit = 1 << transition
        if self._seen & bit:
            return
        self._seen |= bit
        clash = self._chosen & self._clashes(transition)
        if not clash & ~self.OUTER[transition]:
            self._chosen = self._chosen & ~clash | bit

    def _clashes(self, transition: int) -> int:
        """Return the transitions whose exit sets meet that of this one."""
        return self.CLASHES[transition]

    def _test(self, transition: int) -> bool:
        """Evaluate a guard, once in a selection; one that fails is false."""
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

    # --- queues and errors ------------------------------------------------------------------------

    def _enqueue(self, event: int) -> int:
        """Make room at the end of the external queue; where its payload goes, or -1."""
        if not self._running or self._queue_count + self._deferred_count >= self.QUEUE:
            return NOTHING
        at = (self._queue_head + self._queue_count) % self.QUEUE
        self._queue_count += 1
        self._queue_event[at] = event
        return at * self.WIDTH

    def _enqueue_own(self, event: int) -> int:
        """Do the same for an event that the machine sends itself, and tell if it is lost."""
        if self._queue_count + self._deferred_count >= self.QUEUE:
            if self.trace is not None:
                self._tell("full queue")
            return NOTHING
        at = (self._queue_head + self._queue_count) % self.QUEUE
        self._queue_count += 1
        self._queue_event[at] = event
        return at * self.WIDTH

    def _enqueue_internal(self, event: int) -> int:
        """Make room at the end of the internal queue; where its payload goes. Full is a fault."""
        if self._internal_count >= self.INTERNAL:
            if self.trace is not None:
                self._tell("full internal")
            self._stop("internal")
            return NOTHING
        at = (self._internal_head + self._internal_count) % self.INTERNAL
        self._internal_count += 1
        self._internal_event[at] = event
        return at * self.WIDTH

    def _take_internal(self) -> int:
        """Take the oldest internal event, with its payload."""
        at = self._internal_head
        self._internal_head = (at + 1) % self.INTERNAL
        self._internal_count -= 1
        width = self.WIDTH
        for k in range(width):
            self._fields[k] = self._internal_fields[at * width + k]
        return self._internal_event[at]

    def _defer(self, event: int) -> None:
        """Keep the event at hand until no active state defers it."""
        at = self._deferred_count
        self._deferred_count += 1
        self._deferred_event[at] = event
        width = self.WIDTH
        for k in range(width):
            self._deferred_fields[at * width + k] = self._fields[k]

    def _stop(self, reason: str) -> None:
        """Put the machine into a fault; the first one counts."""
        if self._fault is None:
            self._fault = reason
            if self.trace is not None:
                self._tell("fault " + reason)

    def _error_execution(self) -> None:
        """Tell that content could not be evaluated."""
        if self.trace is not None:
            self._tell("error error.execution")
        if self.ERROR_EXECUTION >= 0:
            self._enqueue_internal(self.ERROR_EXECUTION)

    def _clamp(self, value: int, lo: int, hi: int) -> int:
        """Return the nearest value of a range, and tell if that is another."""
        if lo <= value <= hi:
            return value
        if self.trace is not None:
            self._tell("error error.range")
        if self.ERROR_RANGE >= 0:
            self._enqueue_internal(self.ERROR_RANGE)
        return lo if value < lo else hi

    # --- timers -----------------------------------------------------------------------------------

    def _insert(self, what: int, delay: int, mark: int, route: int, peer: str | None) -> int:
        """Insert a timer behind those that are due no later; where its payload goes.

        ``what`` is a transition, or the complement of the event to send; ``route`` tells where to.
        """
        due = (self._now + delay) & CLOCK
        at = self._timer_count
        self._timer_count = at + 1
        while at and (due - self._timer_due[at - 1]) & CLOCK >= FAR:
            self._move(at - 1, at)
            at -= 1
        self._timer_due[at] = due
        self._timer_what[at] = what
        self._timer_mark[at] = mark
        self._timer_route[at] = route
        self._timer_peer[at] = peer
        return at * self.WIDTH

    def _move(self, source: int, target: int) -> None:
        self._timer_due[target] = self._timer_due[source]
        self._timer_what[target] = self._timer_what[source]
        self._timer_mark[target] = self._timer_mark[source]
        self._timer_route[target] = self._timer_route[source]
        self._timer_peer[target] = self._timer_peer[source]
        width = self.WIDTH
        for k in range(width):
            self._timer_fields[target * width + k] = self._timer_fields[source * width + k]

    def _remove(self, at: int) -> None:
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
        """Note a delayed send; where its payload goes, or -1 where there are too many."""
        if delay < 0:
            raise ContentError("a delay cannot be negative")
        if self._sends >= self.DELAYED:
            if self.trace is not None:
                self._tell("full delayed")
            return NOTHING
        self._sends += 1
        return self._insert(~event, delay, mark, route, peer)

    def _cancel(self, mark: int) -> None:
        """Drop the delayed sends of an id."""
        at = 0
        while at < self._timer_count:
            if self._timer_what[at] < 0 and self._timer_mark[at] == mark:
                self._remove(at)
                self._sends -= 1
            else:
                at += 1

    def _fire(self) -> None:
        """Fire the first timer, at its deadline."""
        what = self._timer_what[0]
        self._now = self._timer_due[0]
        if what >= 0:
            self._remove(0)
            self._time_out(what)
            return
        event, route, peer, width = ~what, self._timer_route[0], self._timer_peer[0], self.WIDTH
        for k in range(width):
            self._fields[k] = self._timer_fields[k]
        self._remove(0)
        self._sends -= 1
        if route == 1:
            self._open(event)
            self._react(event, may_defer=False)
            self._settle()
        elif route == 2:
            port = self._PORTS[event]
            if port is not None:
                port(self, peer)
        else:
            at = self._enqueue_own(event)
            if at >= 0:
                for k in range(width):
                    self._queue_fields[at + k] = self._fields[k]

    def _time_out(self, transition: int) -> None:
        """Take a transition whose delay has passed, if its guard is true."""
        self._budget = self.MICROSTEPS
        self._event = NOTHING
        if self.trace is not None:
            self._cause = f"@{self._now} > timeout {transition}"
            self._tell(None)
        if self.PERIODS[transition]:
            self._insert(transition, self.PERIODS[transition], NOTHING, 0, None)
        self._tried = 0
        is_enabled = self._GUARDS[transition] is None or self._test(transition)
        self._budget -= 1
        if is_enabled and self._fault is None:
            self._microstep(1 << transition)
        self._settle()

    # --- trace ------------------------------------------------------------------------------------

    def _tell(self, line: str | None) -> None:
        """Give the trace a line, after the one that tells what caused it."""
        trace = self.trace
        if trace is None:
            return
        if self._cause is not None:
            cause, self._cause = self._cause, None
            trace(cause)
        if line is not None:
            trace(line)

    def _spell(self, event: int, fields: list[Any], at: int) -> str:
        """Spell an event with the payload at a place."""
        size = len(self.FIELDS[event])
        return " ".join((self.EVENTS[event], *[shown(v) for v in fields[at : at + size]]))
