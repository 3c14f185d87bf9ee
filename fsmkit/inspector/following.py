"""Follow an external program: append its entries, independent of the view."""

from __future__ import annotations

from collections.abc import Mapping

from fsmkit.diagnostics import FsmkitError
from fsmkit.inspector.breakpoints import Breakpoints
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.playing import CLOCK_EVERY
from fsmkit.inspector.sources import DrivenSource, Entry, Followed
from fsmkit.inspector.system_at import time_of
from fsmkit.inspector.view import View
from fsmkit.runtime.live.messages import Json, Signals, to_json
from fsmkit.runtime.live.values import to_json as value_json

SIGNALS_EVERY = 16_600
"""Microseconds of real time between two messages of signals, at least."""


class Follower:
    """Appends the entries of a source, and moves the view along until it is frozen.

    The program always continues; a breakpoint freezes only the view.
    """

    def __init__(self, view: View, points: Breakpoints, source: Followed) -> None:
        self._view = view
        self._points = points
        self.source = source
        self.signals: Mapping[str, float] = dict(source.signals())
        """The samples that were sent last."""
        self._gone: list[Json] | None = None
        """Why the source has ended."""
        self._gathered: list[bytes] = []
        self._since_clock = self._since_signals = 0

    def advance(self, microseconds: int) -> None:
        """Append the entries that have arrived; do nothing after the end of the source."""
        if self._gone is not None:
            return
        view = self._view
        self._since_clock += microseconds
        self._since_signals += microseconds
        try:
            for entry in self.source.receive():
                text = view.course.give(entry)
                if view.is_following:
                    self._show(entry, text)
            signals = self.source.signals()
        except FsmkitError as error:
            first = error.diagnostics[0]
            self._gone = ["fault", first.rule.name, first.message]
            self.freeze(self._gone)
            return
        self._flush()
        self._report_running()
        if view.is_following and self._since_signals >= SIGNALS_EVERY and signals != self.signals:
            self.signals, self._since_signals = dict(signals), 0
            view.send(self.sampled())
        if (
            view.is_live
            and self._since_clock >= CLOCK_EVERY
            and view.told_head != view.history.head
        ):
            self._since_clock = 0
            view.send(view.mode())

    def sampled(self) -> Signals:
        """Return the samples that were sent last, as a message."""
        values = list(map(value_json, self.signals.values()))
        return Signals(n=self._view.n, at=self._view.at, v=values)

    def _report_running(self) -> None:
        """Report to clients when a driven program pauses or changes its speed."""
        view, driven = self._view, self.driven
        if driven is None or (view.is_stopped, view.speed) == (not driven.is_running, driven.speed):
            return
        view.is_stopped, view.speed = not driven.is_running, driven.speed
        if view.is_live:
            view.send(view.mode())

    def _show(self, entry: Entry, text: bytes) -> None:
        """Go on with the view to an entry that came just now."""
        view, before = self._view, self._view.moment
        view.n, view.moment = view.history.head, entry.moment
        view.at = time_of(entry.messages[0])
        self._gathered.append(text)
        if view.is_due(before):
            self._gathered += map(to_json, view.states())
        if self._points:
            why = self._points.hit(before, view.moment, entry.messages)
            if why is not None:
                self.freeze(why)

    def _flush(self) -> None:
        """Send the collected messages of several entries."""
        texts, self._gathered = self._gathered, []
        self._view.clients.send(texts)

    # --- driven programs ------------------------------------------------------------------------

    @property
    def driven(self) -> DrivenSource | None:
        """The source, if it can be stopped from here."""
        source = self.source
        can = self._gone is None and isinstance(source, DrivenSource) and "run" in source.can
        return source if can and isinstance(source, DrivenSource) else None

    def run(self, speed: float) -> None:
        """Let a driven program run; other programs run anyway."""
        if self.driven is not None:
            self.driven.run(speed)
            self._report_running()

    def pause(self) -> None:
        """Pause a driven program; for other programs, pause only the view."""
        if self.driven is None:
            self.freeze(["asked"])
            return
        self.driven.pause()
        self._view.why = ["asked"]
        self._report_running()

    def step(self, how: str) -> int:
        """Advance a driven program by a tick or to its next deadline; return the ticks."""
        view, ticks = self._view, 1
        if how == "timer" and view.moment is not None:
            due = view.course.simulation.next_deadline(view.moment)
            ticks = max(1, (view.at if due is None else due) - view.at)
        if self.driven is not None:
            self.driven.step(ticks)
            view.why = ["stepped"]
            self._report_running()
        return ticks

    def freeze(self, why: list[Json]) -> None:
        """Keep the entry in view while new entries arrive."""
        self._flush()
        self._view.is_following = False
        if self._view.is_live:
            self._view.why = why
            self._view.send(self._view.mode())

    def follow(self) -> bool:
        """Take the newest entry into view and go on with it; whether another branch was left."""
        view = self._view
        was_live = view.is_live
        view.is_running = False
        if not was_live:
            view.course.switch(0)
        view.go(view.history.head)
        view.is_following, view.why = self._gone is None, self._gone or []
        return not was_live

    def may(self, command: str) -> Followed:
        """Return the source if it obeys a command; `FsmkitError` if it does not."""
        if self._gone is not None or command not in self.source.can:
            raise wrong(
                f"the external program does not accept `{command}`",
                "`fork` starts a branch in the interpreter if the data are known",
            )
        return self.source
