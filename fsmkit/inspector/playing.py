"""Advance the view of a session: play back recorded entries, then simulate."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fsmkit.diagnostics import FsmkitError
from fsmkit.inspector.breakpoints import Breakpoints, fault_of
from fsmkit.inspector.simulation import FOR_EVER, Moment, SimulationStep
from fsmkit.inspector.view import View
from fsmkit.runtime.live.messages import AnyMessage, Json, Log

MOST_STEPS = 1_000
"""Steps in one call of `Player.advance`: whoever calls has other work, too."""
CLOCK_EVERY = 100_000
"""Microseconds of real time between two messages of nothing but the time."""


class Player:
    """Advances a view by time, by steps, or to breakpoints."""

    def __init__(
        self,
        view: View,
        points: Breakpoints,
        end: list[Json],
        observer: Callable[[SimulationStep], None] | None = None,
    ) -> None:
        """Start paused; ``end``: the reason to stop at the last entry of a source.

        ``observer`` is called with each macrostep of the interpreter.
        """
        self._observer = observer
        self._view = view
        self._points = points
        self._end = end or ["end"]
        self._simulation = view.course.simulation
        self._due = 0.0
        self._since_clock = 0
        points.log = self._log

    def _log(self, number: int, text: str) -> None:
        self._view.send(Log(n=self._view.n, at=self._view.at, number=number, text=text))

    # --- by time -------------------------------------------------------------------------------

    def run(self, speed: float) -> None:
        """Go on from now on; 0: as fast as can be."""
        view = self._view
        view.speed, view.is_running, view.why = speed, True, []
        self._due = float(view.at)
        view.send(view.mode())

    @property
    def wants_more(self) -> bool:
        """Whether there is more to do than `advance` did."""
        view = self._view
        return view.is_running and (view.speed == 0 or view.at < int(self._due))

    def advance(self, microseconds: int) -> None:
        """Advance by real time; do nothing while paused."""
        view = self._view
        if not view.is_running:
            return
        self._due += microseconds * view.speed / self._simulation.tick
        self._go(FOR_EVER if view.speed == 0 else int(self._due), MOST_STEPS)
        self._since_clock += microseconds
        if view.is_running and self._since_clock >= CLOCK_EVERY:
            self._since_clock = 0
            view.send(view.mode())

    def settle(self) -> None:
        """Process all steps at the present time."""
        if self._view.is_running:
            return
        self._view.is_running = True
        self._go(self._view.at, MOST_STEPS)
        self._view.is_running = False

    def stop(self, why: list[Json]) -> None:
        """Pause, if running."""
        view = self._view
        if view.is_running:
            view.is_running, self._points.until, view.why = False, None, why
            view.send(view.mode())

    # --- by steps ------------------------------------------------------------------------------

    def step(self, how: str, at: int = 0) -> int:
        """Go on by a ``macro`` step, a ``tick``, to the next ``timer`` or to a ``time`` (ticks).

        Return the steps.
        """
        view = self._view
        first, due = view.n, self._next_time
        view.is_running, view.why = True, ["stepped"]
        match how:
            case "macro":
                self._go(FOR_EVER, 1)
            case "tick":
                self._go(view.at + 1, MOST_STEPS)
            case "time":
                while view.is_running and view.at < at:
                    self._go(at, MOST_STEPS)
            case _:
                self._go(view.at if due is None else due, MOST_STEPS)
        view.is_running = False
        view.send(view.mode())
        return view.n - first

    @property
    def _next_time(self) -> int | None:
        """When something happens next (ticks)."""
        view = self._view
        if view.is_past:
            return view.course.at(view.n + 1)
        return None if view.moment is None else self._simulation.next_deadline(view.moment)

    def _go(self, until: int, most: int) -> None:
        """Step until a time, a breakpoint, a fault, or so many steps."""
        for _ in range(most):
            did = self._play(until) if self._view.is_past else self._simulate(until)
            if not did:
                if until == FOR_EVER:
                    self.stop(["idle"])
                return
            if not self._view.is_running:
                return

    def _simulate(self, until: int) -> bool:
        """Take a step in the interpreter; return False if there is none until that time."""
        view = self._view
        before = view.begin_branch()
        try:
            view.moment, done = self._simulation.step(before, until)
        except FsmkitError as error:
            self.stop(["fault", error.diagnostics[0].rule.name, error.diagnostics[0].message])
            return True
        view.at = view.moment.now
        if done is None:
            return False
        view.n = view.history.head + 1
        told = view.course.encoder.step(view.n, view.moment, done)
        view.course.add(view.moment, told)
        view.send_entry(before)
        if self._observer is not None:
            self._observer(done)
        self._look_at(before, told)
        return True

    def _play(self, until: int) -> bool:
        """Show the next entry that a source gave; at the last one stop."""
        view = self._view
        if view.course.at(view.n + 1) > until:
            view.at = until
            return False
        before = view.moment
        view.go(view.n + 1)
        view.send_entry(before)
        self._look_at(before, view.course.messages(view.n))
        if not view.is_past:
            self.stop(self._end)
        return True

    def _look_at(self, before: Moment | None, told: Sequence[AnyMessage]) -> None:
        """Stop where a breakpoint is hit or a machine has a fault."""
        why = self._points.hit(before, self._view.moment, told)
        if why is not None:
            self.stop(why)
        fault = fault_of(told)
        if fault is not None:
            self.stop(fault)
