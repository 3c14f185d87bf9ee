"""Hosts that act during a call: they look at the machine, post events and start steps.

A step within a step is excluded by the machine. Events that an operation posts enter the queue at
once. What the host sees, and what the functions that it calls return, becomes part of the trace.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import fsmkit.language as lang
from fsmkit.chart.analysis.host_events import sent_events
from fsmkit.chart.chart import Chart
from fsmkit.runtime.interpreter import snapshot as snap

LOOKING, POSTING, NESTING, FULL = 1, 2, 4, 8
"""The manners of ``driver.h``: bits of one number."""
BUSY = 2
"""``FSM_BUSY``."""


Result = tuple[str, lang.Value | None]
"""The name of an operation and what it returned."""


@dataclass(frozen=True, slots=True)
class Manner:
    """The actions of a host during each call of a step.

    ``bits``: `LOOKING` and so on. ``event``: the event that it posts and dispatches; ``posts``: how
    often it posts it in one call, and ``most`` in the whole step.
    """

    bits: int = 0
    event: snap.Occurrence | None = None
    posts: int = 0
    most: int = 0


PLAIN = Manner()


@dataclass(frozen=True, slots=True)
class Sight:
    """The view of a machine during a call, as a trace holds it."""

    looked: Callable[[snap.Snapshot], bytes]
    nested: bytes
    """The results of the functions that a step excludes."""
    most_looks: int


class CallingHost:
    """The host of a step: it does what a manner says during each call, and records it.

    Operations return the ``results``, then those that ``other`` returns.
    """

    def __init__(
        self,
        chart: Chart,
        manner: Manner,
        sight: Sight,
        results: Iterable[Result],
        other: Callable[[str], lang.Value | None],
    ) -> None:
        """Take the chart of the machine and what its host does."""
        self.reports: list[bytes] = []
        """A report of each call."""
        self._chart, self._manner, self._sight = chart, manner, sight
        self._results = iter(results)
        self._other = other
        self._posts, self._looks = manner.most, sight.most_looks
        self._post: snap.Post | None = None
        self._view: Callable[[], snap.Snapshot] | None = None

    def accept_posts(self, chart: Chart, post: snap.Post) -> None:
        """Store the function that posts to the machine, not to one in a slot."""
        if chart is self._chart:
            self._post = post

    def accept_view(self, chart: Chart, view: Callable[[], snap.Snapshot]) -> None:
        """Store the function that returns the machine as it is."""
        if chart is self._chart:
            self._view = view

    def call(self, operation: str, arguments: tuple[lang.Value, ...]) -> lang.Value | None:
        """Return the result of an operation (the `Host` of a step)."""
        del arguments
        self._act()
        called, result = next(self._results, ("", None))
        return result if called == operation else self._other(operation)

    def emitted(self, chart: Chart, occurrence: snap.Occurrence) -> None:
        """Take an event that leaves the machine."""
        if occurrence.event in sent_events(chart):
            self._act()

    def _act(self) -> None:
        bits, report = self._manner.bits, b""
        assert self._view is not None  # noqa: S101
        assert self._post is not None  # noqa: S101
        if bits & LOOKING and self._looks > 0:
            self._looks -= 1
            report += self._sight.looked(self._view())
        if bits & NESTING:
            report += self._sight.nested
        if bits & POSTING:
            assert self._manner.event is not None  # noqa: S101
            for _ in range(min(self._manner.posts, self._posts)):
                self._posts -= 1
                report += bytes([self._post(self._manner.event)])
        self.reports.append(report)


def counted(done: Sequence[snap.Macrostep]) -> tuple[int, int]:
    """Return how many events of macrosteps enabled nothing, and how many found a queue full."""
    unhandled = rejected = 0
    for macrostep in done:
        for effect in macrostep.effects:
            match effect:
                case snap.Unhandled():
                    unhandled += 1
                case snap.Posted(fits=False) | snap.Overflowed("queue" | "delayed"):
                    rejected += 1
                case _:
                    pass
    return unhandled, rejected


def results_of(done: Iterable[snap.Macrostep]) -> Iterator[Result]:
    """Yield the calls of macrosteps with their results, in order."""
    for macrostep in done:
        for effect in macrostep.effects:
            match effect:
                case snap.Called(operation, _, result):
                    yield operation, result
                case snap.InvokedMacrostep(_, inner):
                    yield from results_of((inner,))
                case _:
                    pass


def packed(numbers: Sequence[int]) -> bytes:
    """Return numbers of 16 bits."""
    return struct.pack(f"<{len(numbers)}H", *numbers)
