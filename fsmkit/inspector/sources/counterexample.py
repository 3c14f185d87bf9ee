"""Replay counterexamples and witnesses of ``fsmkit check``, with every moment known.

The machines of the file are shown. Machines added by `check` (monitors, a schedule, drivers of
inputs) are visible by their effects. Dense times and paths without time are shown in whole ticks:
a time is rounded down, a timer without time has its full delay.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import zip_longest
from math import floor
from pathlib import Path
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import read_bytes
from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.diagnostics.parsing import parse_json
from fsmkit.diagnostics.paths import is_file
from fsmkit.inspector.as_messages import MessageEncoder
from fsmkit.inspector.simulation import Delivery, InputChange, Moment, Simulation, SimulationStep
from fsmkit.inspector.sources import Entry
from fsmkit.inspector.sources.recording import Recording
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.live.messages import AnyMessage, Json, Post, Set
from fsmkit.runtime.live.steps import row_of_event
from fsmkit.runtime.live.values import to_json
from fsmkit.system.system import System
from fsmkit.verify.replay import load_trace
from fsmkit.verify.report.counterexample import Replay, ReplayError, TraceStep
from fsmkit.verify.statespace.actions import Action, Message
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.exploration import Trail

WRONG = (KeyError, IndexError, TypeError, ValueError, AttributeError, ZeroDivisionError)
"""Errors caused by an invalid trace, or by one of another version of the charts."""


def read_trace(path: Path) -> tuple[Recording, Path]:
    """Return a trace of ``check --save-trace``, and the file of its chart or system.

    Raises `FsmkitError`: ``unreadable-log`` for an invalid file, ``replay-parts`` if the charts
    cannot replay it, and the findings of the charts. A missing file is searched beside the trace.
    """
    text = read_bytes(path)
    try:
        document = parse_json(text)
    except ValueError as error:
        raise _unreadable(path, str(error)) from error
    if not isinstance(document, dict) or not isinstance(document.get("trail"), list):
        raise _unreadable(path, "it has no `trail`")
    file = Path(str(document.get("file", "")))
    if not is_file(file) and is_file(path.parent / file.name):
        file = path.parent / file.name
        document["file"] = str(file)
    return recording_of(document), file


def _unreadable(path: Path, why: str) -> FsmkitError:
    return fail(
        "unreadable-log",
        f"`{path}` is not a trace: {why}",
        help="save one with `fsmkit check --save-trace`",
    )


def recording_of(document: Mapping[str, Any]) -> Recording:
    """Return a saved trace, as `verify.testgen.save.document` makes it, performed again."""
    try:
        system, closed, trail = load_trace(document)
        why: list[Json] = ["property", str(document.get("property", ""))]
        lines = [tuple(step["lines"]) for step in document.get("steps", ())]
        return recording_of_trail(system, closed, trail, why, document.get("loop"), lines)
    except ReplayError as error:
        raise _parted(str(error)) from error
    except WRONG as error:
        raise _parted(f"{type(error).__name__}: {error}") from error


def _parted(why: str) -> FsmkitError:
    return fail(
        "replay-parts",
        f"the trace cannot be performed again: {why}",
        help="the charts have changed since; check again, and save the trace again",
    )


def recording_of_trail(
    system: System,
    closed: ClosedSystem,
    trail: Trail,
    why: list[Json],
    loop: int | None = None,
    lines: Sequence[tuple[str, ...]] = (),
) -> Recording:
    """Return a path of a system as a recording that starts at its end.

    ``closed``: ``system``, ready for exploration. ``loop``: the first step of the repeated part,
    reported as ``[*why, "loop", entry]``. ``lines``: the trace of each step, if stored. Raises
    `ReplayError` if a step is impossible or has another trace.
    """
    making = _EntryBuilder(system, closed)
    begin = making.moment
    entries: list[Entry] = []
    for number, told in enumerate(making.replay.walk(trail)):
        if number == loop:
            why = [*why, "loop", len(entries) + 1]
        if number < len(lines) and told.lines != lines[number]:
            pairs = zip_longest(lines[number], told.lines, fillvalue="nothing more")
            was, now = next((was, now) for was, now in pairs if was != now)
            raise ReplayError(f"step {number + 1} of `{told.machine}` was `{was}`, and is `{now}`")
        entries += making.entries(told)
    return Recording(system, begin, entries, at_end=True, why=why)


@dataclass(slots=True)
class _EntryBuilder:
    """A path while it is performed."""

    system: System
    closed: ClosedSystem
    replay: Replay = field(init=False)
    simulation: Simulation = field(init=False)
    encoder: MessageEncoder = field(init=False)
    moment: Moment = field(init=False)
    pending: tuple[Delivery, ...] = ()
    """Events sent while the machines started."""

    def __post_init__(self) -> None:
        self.replay = Replay(self.closed)
        self.simulation = Simulation(self.system)
        self.encoder = MessageEncoder(self.simulation)
        self.moment = self.simulation.begin()

    def entries(self, told: TraceStep) -> Iterator[Entry]:
        """Yield the entries of a step that was just performed."""
        step, done = told.step, told.done
        if step is None or done is None:
            self.moment = replace(self._absolute(), turn=None, at_once=0)
            return
        if step.machine >= len(self.simulation.charts):
            yield from self._external_entries(told.messages)
            return
        machine, chart = step.machine, self.simulation.charts[step.machine]
        before = self.moment.snapshots[machine]
        for place, value in enumerate(done.before.inputs):
            if value != before.inputs[place] and self.closed.is_open:
                yield self._set(machine, place, value)
        if step.action is Action.OCCUR:
            possible = self.closed.possible[step.argument]
            if possible.spontaneous:
                number = self.closed.charts[machine].events[possible.event].name.rpartition(".")[2]
                done = replace(done, event=snap.Timeout(int(number)))
            else:
                yield self._post(machine, snap.Occurrence(possible.event, possible.payload))
        done = self._shifted(chart, done)
        queues = [len(each.queue) for each in self.moment.snapshots]
        queues[machine] = len(done.after.queue)
        moment = self._after(machine, done)
        passed = tuple(self._passed(machine, told.messages, moment, queues))
        if step.action is Action.START:
            self.pending += passed
            passed = () if moment.to_start else self.pending
        driven = tuple(
            InputChange(message.target, message.input, message.value)
            for message in told.messages
            if message.event is None and message.target < len(self.simulation.charts)
        )
        self.moment = moment
        stepped = SimulationStep(machine, done, passed, driven)
        yield Entry(moment, tuple(self.encoder.step(0, moment, stepped)), stepped)

    # --- external changes ---------------------------------------------------------------

    def _external_entries(self, messages: tuple[Message, ...]) -> Iterator[Entry]:
        """Yield the effects of a hidden machine on those that are shown."""
        for message in messages:
            if message.target >= len(self.simulation.charts):
                continue
            if message.event is not None:
                yield self._post(message.target, message.event, is_first=False)
            elif message.input < len(self.simulation.charts[message.target].inputs):
                yield self._set(message.target, message.input, message.value)

    def _post(self, machine: int, occurrence: snap.Occurrence, *, is_first: bool = True) -> Entry:
        """Return that an event came, ahead of the queue or after it."""
        before = self.moment.snapshots[machine]
        one = (occurrence,)
        queue = one + before.queue if is_first else before.queue + one
        self._put(machine, replace(before, queue=queue))
        row = row_of_event(self.simulation.charts[machine], occurrence)
        name = self.simulation.names[machine]
        return self._entry(Post(m=name, n=0, at=self.moment.now, event=row, how="queued"))

    def _set(self, machine: int, place: int, value: Any) -> Entry:
        """Return that an input has another value."""
        before = self.moment.snapshots[machine]
        inputs = (*before.inputs[:place], value, *before.inputs[place + 1 :])
        self._put(machine, replace(before, inputs=inputs))
        declared = self.simulation.charts[machine].inputs[place]
        told = {declared.name: to_json(value, declared.type)}
        name = self.simulation.names[machine]
        return self._entry(Set(m=name, n=0, at=self.moment.now, inputs=told))

    def _put(self, machine: int, snapshot: snap.Snapshot) -> None:
        snapshots = list(self.moment.snapshots)
        snapshots[machine] = snapshot
        self.moment = replace(self.moment, snapshots=tuple(snapshots))

    def _entry(self, message: AnyMessage) -> Entry:
        return Entry(self.moment, (message,))

    # --- a step --------------------------------------------------------------------------------

    def _after(self, machine: int, done: snap.Macrostep) -> Moment:
        """Return the system after a step, by the machines of the replay."""
        moment = self._absolute()
        snapshots = list(moment.snapshots)
        if self.closed.is_open:
            snapshots[machine] = replace(snapshots[machine], inputs=done.after.inputs)
        to_start, started = moment.to_start, moment.started
        if machine in to_start:
            to_start = tuple(each for each in to_start if each != machine)
            started = (*started, (machine, done)) if to_start else ()
        return replace(
            moment, snapshots=tuple(snapshots), to_start=to_start, started=started, turn=None
        )

    def _absolute(self) -> Moment:
        """Return the system as the replay has it now, with the times since the start."""
        ticks, is_open = self.replay.ticks, self.closed.is_open
        own = zip(self.simulation.charts, self.replay.snapshots, strict=False)
        found = [self._at(chart, snapshot, ticks) for chart, snapshot in own]
        if is_open:  # whose inputs count only while it moves
            was = (each.inputs for each in self.moment.snapshots)
            found = [replace(each, inputs=i) for each, i in zip(found, was, strict=True)]
        return replace(self.moment, now=floor(ticks), snapshots=tuple(found))

    def _at(self, chart: Chart, snapshot: snap.Snapshot, ticks: Fraction) -> snap.Snapshot:
        """Return a snapshot with times since the start; those of a path are relative to now."""
        invoked = tuple(
            None if child is None else self._at(invocation.chart, child, ticks)
            for invocation, child in zip(chart.invocations, snapshot.invoked, strict=True)
        )
        timers = (
            snap.Timer(floor(ticks + self._left(chart, each)), each.what)
            for each in snapshot.timers
        )
        return replace(snapshot, now=floor(ticks), timers=tuple(timers), invoked=invoked)

    def _left(self, chart: Chart, timer: snap.Timer) -> Fraction | int:
        """Return the time that a timer has left."""
        if self.closed.untimed and isinstance(timer.what, snap.Timeout):
            return chart.transitions[timer.what.transition].delay or 0
        return timer.deadline

    def _shifted(self, chart: Chart, done: snap.Macrostep) -> snap.Macrostep:
        """Return a step with times since the start."""
        ticks = self.replay.ticks
        microsteps = tuple(
            replace(
                small,
                effects=tuple(
                    replace(
                        effect,
                        macrostep=self._shifted(
                            chart.invocations[effect.invocation].chart, effect.macrostep
                        ),
                    )
                    if isinstance(effect, snap.InvokedMacrostep)
                    else effect
                    for effect in small.effects
                ),
            )
            for small in done.microsteps
        )
        return replace(
            done,
            before=self._at(chart, done.before, ticks),
            after=self._at(chart, done.after, ticks),
            at=floor(ticks),
            microsteps=microsteps,
        )

    def _passed(
        self, machine: int, messages: tuple[Message, ...], moment: Moment, queues: list[int]
    ) -> Iterator[Delivery]:
        """Yield the events that went to other machines; ``queues``: how many waited before."""
        for message in messages:
            target, event = message.target, message.event
            if event is None or target >= len(self.simulation.charts):
                continue
            link = next(
                each
                for each in self.system.event_links
                if (each.source, each.target, each.event) == (machine, target, event.event)
            )
            queues[target] += 1
            has_room = queues[target] <= len(moment.snapshots[target].queue)
            yield Delivery(link, event, has_room or bool(moment.to_start))
