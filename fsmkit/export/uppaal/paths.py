"""Enumerate the paths through the macrosteps of a machine, with its data as variables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from fsmkit.chart.statements import Destination
from fsmkit.export.uppaal.entries import (
    AT_HAND,
    FIRST_SLOT,
    Entry,
    History,
    Key,
    Output,
    Path,
    Payload,
    QueuedEvent,
    TimerStart,
    scratch,
)
from fsmkit.export.uppaal.recorder import Recorder
from fsmkit.export.uppaal.terms import unsupported
from fsmkit.language import Expr, Literal, Storage, Variable
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.runtime.interpreter.macrostep import start, step
from fsmkit.runtime.interpreter.run import step_timer
from fsmkit.system.machine import OBSERVED
from fsmkit.verify.statespace.closed_system import ClosedSystem

MOST_PATHS = 4096
"""Paths through one macrostep; with more, the chart is rejected."""
STANDING = 1 << 60
"""From here on lie the deadlines of timers that were armed before."""


class Paths:
    """The macrosteps of one machine of a closed system."""

    def __init__(
        self, closed: ClosedSystem, machine: int, constants: Mapping[str, Literal]
    ) -> None:
        """Record a machine; ``constants``: inputs that never change."""
        self._untimed = closed.untimed
        self.chart = closed.charts[machine]
        self._wired = {link.port for link in closed.system.event_links if link.source == machine}
        # ports of operations count the events of the source chart, as wires do
        written = closed.system.machines[machine].chart
        added = len(self.chart.events) - len(written.events)
        self._shift = len(written.events), added
        self._recorder = Recorder(
            self.chart, closed.results[machine], lambda port: self.wire(port) in self._wired
        )
        self._recorder.constants = constants
        self._recording = self._recorder.chart

    def wire(self, port: int) -> int:
        """Return the port number in wires for a port of the explored chart."""
        events, added = self._shift
        return port - added if port >= events + added else port

    def is_observed(self, event: int) -> bool:
        """Whether a monitor observes that the machine takes an event."""
        return OBSERVED + event in self._wired

    # --- the steps -------------------------------------------------------------------------------

    def start(self) -> list[Path]:
        """Return the paths of the start of the machine."""
        return self._all(None, {}, lambda: start(self._recording, 0, self._recorder))

    def eventless(self, key: Key, history: History) -> list[Path]:
        """Return the paths of eventless transitions; one without a microstep has no effect."""
        snapshot = self._snapshot(key, history)
        return self._all(key, {}, lambda: step(self._recording, snapshot, None, self._recorder))

    def event(self, key: Key, history: History, event: int, payload: Payload) -> list[Path]:
        """Return the reactions to an event."""
        snapshot = self._snapshot(key, history)
        at_hand = snap.Occurrence(event, (AT_HAND,))
        given = {(AT_HAND, field): value for field, value in payload.items()}
        return self._all(
            key,
            given,
            lambda: step(self._recording, snapshot, at_hand, self._recorder),
            event,
        )

    def open_payload(self, event: int) -> dict[str, Expr]:
        """Return an unknown payload."""
        declared = self.chart.events[event]
        span = self.chart.root.span
        return {
            f.name: Variable(scratch(AT_HAND, f.name), f.type, Storage.DATA, span)
            for f in declared.fields
        }

    def fire(self, key: Key, history: History, place: int) -> list[Path]:
        """Return the paths of an expired timer."""
        timers = list(key.timers)
        fired = timers.pop(place)
        snapshot = self._snapshot(replace(key, timers=tuple(timers)), history)
        snapshot = replace(snapshot, timers=(snap.Timer(0, fired.what), *snapshot.timers))

        def act() -> snap.Macrostep:
            done = step_timer(self._recording, snapshot, self._recorder)
            assert done is not None  # noqa: S101  (it runs, and a timer is armed)
            return done

        found = self._all(key, {}, act, fired=fired)
        if fired.greatest is None and isinstance(fired.what, snap.Timeout):
            return [path for path in found if path.took]
        return found

    # --- recording -------------------------------------------------------------------------------

    def _snapshot(self, key: Key, history: History) -> snap.Snapshot:
        blank = index_of(self._recording).initial
        timers = tuple(snap.Timer(STANDING + n, t.what) for n, t in enumerate(key.timers))
        return replace(
            blank, configuration=key.configuration, history=history, timers=timers, running=True
        )

    def _all(
        self,
        key: Key | None,
        payload: Mapping[tuple[int, str], Expr],
        act: Callable[[], snap.Macrostep],
        event: int | None = None,
        fired: TimerStart | None = None,
    ) -> list[Path]:
        events = {} if event is None else {AT_HAND: event}
        given = dict(payload)
        for timer in () if key is None else key.timers:
            if isinstance(timer.what, snap.Delayed) and timer.slot is not None:
                events[timer.slot] = timer.what.occurrence.event
                for field in self.chart.events[timer.what.occurrence.event].fields:
                    name = scratch(timer.slot, field.name)
                    span = self.chart.root.span
                    value = Variable(name, field.type, Storage.DATA, span)
                    given[timer.slot, field.name] = value
        found: dict[Path, None] = {}
        recorder = self._recorder
        recorder.chosen, recorder.limits = [], []
        while True:
            recorder.start(events, given)
            done = act()
            found[self._path(key, done, fired)] = None
            if len(found) > MOST_PATHS:
                raise unsupported(
                    f"a step of `{self.chart.name}` has more than {MOST_PATHS} paths",
                    self.chart.root.span,
                    "let fewer guards be evaluated in one macrostep, or bound its loops",
                )
            if not recorder.advance():
                return list(found)

    def _path(self, key: Key | None, done: snap.Macrostep, fired: TimerStart | None) -> Path:
        entries = [*self._observed(done), *self._recorder.entries, *self._sent(done)]
        after = done.after
        fresh = [self._armed(timer) for timer in after.timers if timer.deadline < STANDING]
        standing = {t.what for t in after.timers if t.deadline >= STANDING}
        stayed = [t for t in (() if key is None else key.timers) if t.what in standing]
        if fired is not None and fired in stayed:
            stayed.remove(fired)
        target = Key(
            after.configuration,
            self._ordered([*stayed, *fresh]) if after.running else (),
            after.running,
            _fault(after.fault),
        )
        index = index_of(self.chart)
        written: set[int] = set()
        for effect in done.effects if after.running else ():
            if isinstance(effect, snap.Exited):
                written.update(index.histories[effect.state])
            elif isinstance(effect, snap.Entered):
                written.update(index.forgotten[effect.state])
        recorded = dict(after.history)
        took = any(small.transitions for small in done.microsteps)
        return Path(
            tuple(entries),
            target,
            tuple((h, recorded.get(h)) for h in sorted(written)),
            tuple(fresh) if after.running else (),
            took,
            took or target != key,
        )

    def _observed(self, done: snap.Macrostep) -> list[Entry]:
        """Return the output to monitors that observe a taken event."""
        if not isinstance(done.event, snap.Occurrence) or not self.is_observed(done.event.event):
            return []
        (number,) = done.event.payload
        return [Output(OBSERVED + done.event.event, self._carried(number, done.event.event))]

    def _carried(self, number: object, event: int) -> tuple[Expr, ...]:
        assert isinstance(number, int)  # noqa: S101  (given when recorded)
        fields = self.chart.events[event].fields
        return tuple(self._recorder.payload[number, field.name] for field in fields)

    def _sent(self, done: snap.Macrostep) -> list[Entry]:
        """Return the effect of an expired delayed send."""
        if not isinstance(done.event, snap.Delayed):
            return []
        (number,) = done.event.occurrence.payload
        event = done.event.occurrence.event
        values = self._carried(number, event)
        if done.event.destination is Destination.SELF:
            return [QueuedEvent(event, values)]
        leaves = any(isinstance(effect, snap.Emitted) for effect in done.effects)
        return [Output(event, values)] if leaves and event in self._wired else []

    def _armed(self, timer: snap.Timer) -> TimerStart:
        if isinstance(timer.what, snap.Delayed):
            return TimerStart(timer.what, timer.deadline, timer.deadline)
        transition = self.chart.transitions[timer.what.transition]
        if transition.least is None:
            return TimerStart(timer.what, timer.deadline, timer.deadline)
        end = None if transition.is_open_ended else transition.delay
        return TimerStart(timer.what, transition.least, end, is_interval=True)

    def _ordered(self, timers: list[TimerStart]) -> tuple[TimerStart, ...]:
        if self._untimed:
            return tuple(sorted(timers, key=_name))
        bounded = [t for t in timers if t.greatest is not None]
        others = sorted((t for t in timers if t.greatest is None), key=_name)
        bounded.sort(key=lambda t: -(t.greatest or 0))
        return (*bounded, *others)


def _name(timer: TimerStart) -> tuple[int, int, int]:
    match timer.what:
        case snap.Timeout(transition):
            return 0, transition, 0
        case snap.Delayed(occurrence):
            return 1, occurrence.event, timer.slot or FIRST_SLOT


def _fault(fault: str | None) -> str:
    if fault is None:
        return ""
    return "error" if fault.startswith("error.") else fault
