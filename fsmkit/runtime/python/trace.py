"""The attributes that each machine declares, and its trace.

Sets of states and of transitions are integers, one bit for each. Queues and timers are lists of
constant length, so that a step creates nothing that the garbage collector tracks.

The payload of entry ``i`` of a queue is ``fields[i * WIDTH : i * WIDTH + WIDTH]``. Times are ticks
modulo 2^32; deadlines compare by their distance, which is below 2^31.
"""

# ruff: noqa: SLF001  (machines of one family know each other)

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from fsmkit.runtime.python.arithmetic import shown
from fsmkit.runtime.python.unrecorded import Unrecorded

CLOCK = 0xFFFFFFFF
FAR = 0x80000000
NOTHING = -1


class Traced(Unrecorded):
    """The variables of a machine, and the trace it gives."""

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
    ERRORS: ClassVar[tuple[int, ...]]
    ERROR_EXECUTION: ClassVar[int]
    ERROR_RANGE: ClassVar[int]
    DEFERRING: ClassVar[tuple[int, ...]]
    PERIODS: ClassVar[tuple[int, ...]]
    OTHERS: ClassVar[tuple[tuple[int, ...], ...]]
    OUTER: ClassVar[tuple[int, ...]]
    CLASHES: ClassVar[tuple[int, ...]]
    _BITS: ClassVar[dict[str, int]]
    _POSTABLE: ClassVar[dict[str, tuple[int, int]]]
    _ON: ClassVar[tuple[Callable[[Any], bool] | None, ...]]
    _LEAVE: ClassVar[tuple[Callable[[Any], None] | None, ...]]
    _DO: ClassVar[tuple[Callable[[Any], None] | None, ...]]
    _ENTER: ClassVar[tuple[Callable[[Any], None] | None, ...]]
    _EXITED: ClassVar[tuple[Callable[[Any], None] | None, ...]]
    _ENTERED: ClassVar[tuple[Callable[[Any, int], None] | None, ...]]
    _GUARDS: ClassVar[tuple[Callable[[Any], bool] | None, ...]]
    _PORTS: ClassVar[tuple[Callable[[Any, str | None], None] | None, ...]]

    _active: int
    _budget: int
    _busy: bool
    _cause: str | None
    _chosen: int
    _deferred_count: int
    _deferred_event: list[int]
    _deferred_fields: list[Any]
    _event: int
    _fault: str | None
    _fields: list[Any]
    _finished: bool
    _held: int
    _host: Any
    _internal_count: int
    _internal_event: list[int]
    _internal_fields: list[Any]
    _internal_head: int
    _is_deferred: bool
    _now: int
    _offered: list[int]
    _queue_count: int
    _queue_event: list[int]
    _queue_fields: list[Any]
    _queue_head: int
    _running: bool
    _seen: int
    _sends: int
    _timer_count: int
    _timer_due: list[int]
    _timer_fields: list[Any]
    _timer_mark: list[int]
    _timer_peer: list[str | None]
    _timer_route: list[int]
    _timer_what: list[int]
    _tried: int
    log: Callable[..., object] | None
    reply: Any
    trace: Callable[[str], object] | None

    def _reset_data(self) -> None:
        """Give data, outputs and histories their start values."""

    def _begin(self) -> None:
        """Run the script and enter the initial states."""

    def _select_eventless(self) -> int:
        """Return the eventless transitions to take."""
        return 0

    # --- copied from here on into each generated class --------------------------------------------

    # --- trace ------------------------------------------------------------------------------------

    def _tell(self, line: str | None) -> None:
        """Write a line to the trace, after the line of its cause."""
        # if RECORDED
        self._record_root._record_is_open = True
        # endif
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
