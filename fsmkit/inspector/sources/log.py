"""Logs of machines in C, done again by the interpreter: every moment is known."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Source, Span, Text, fail
from fsmkit.inspector.as_messages import MessageEncoder
from fsmkit.inspector.simulation import Moment, Simulation, SimulationStep
from fsmkit.inspector.sources import Entry
from fsmkit.inspector.sources.recording import Recording
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.runtime.live.messages import Post, Set
from fsmkit.runtime.live.steps import row_of_event
from fsmkit.runtime.live.values import to_json
from fsmkit.runtime.recording import RING, ReplayedLine, replay_lines
from fsmkit.runtime.script import read_line
from fsmkit.system.of_one_chart import system_of


def read_log(chart: Chart, data: bytes, instance: int | None = None) -> Recording:
    """Return the log of a machine as a recording; ``instance``: the machine in the log.

    Raises `FsmkitError`: ``unreadable-log``, ``foreign-log``, and ``replay-parts`` if the replay
    diverges from the C.
    """
    if data.startswith(RING):
        raise fail(
            "unreadable-log",
            "a ring holds the last transitions alone, from which no moment follows",
            help="print it with `fsmkit run --replay`; log calls with `FSM_LOGGED`",
        )
    system = system_of(chart)
    simulation = Simulation(system)
    making = _EntryBuilder(chart, MessageEncoder(simulation), simulation.begin())
    begin = making.moment
    entries = [
        entry for done in replay_lines(chart, data, instance) for entry in making.entries(done)
    ]
    return Recording(system, begin, entries)


class _EntryBuilder:
    """A log while it is done again."""

    def __init__(self, chart: Chart, encoder: MessageEncoder, begin: Moment) -> None:
        self._chart = chart
        self._encoder = encoder
        self.moment = begin

    def entries(self, done: ReplayedLine) -> Iterator[Entry]:
        """Yield the entries of a line."""
        chart, name = self._chart, self._chart.name
        text = Text(done.line, Span(Source("<log>", done.line), 0, len(done.line)))
        line = read_line(chart, text)
        before = self.moment.snapshots[0]
        if line.verb in ("start", "restore"):
            self.moment = replace(self.moment, to_start=())
        match line.verb:
            case "input" if line.value != before.inputs[line.number]:
                self._go(done.after, done.now)
                declared = chart.inputs[line.number]
                told = {declared.name: to_json(line.value, declared.type)}
                yield Entry(self.moment, (Set(m=name, n=0, at=done.now, inputs=told),))
            case "post" | "dispatch":
                how = "refused" if "full queue" in done.results else "queued"
                waits = (*before.queue, line.event)
                if line.verb == "dispatch":  # ahead of all queued events
                    waits = (line.event, *before.queue)
                if how == "queued":
                    self._go(replace(before, queue=waits), done.now)
                row = row_of_event(chart, line.event)
                yield Entry(self.moment, (Post(m=name, n=0, at=done.now, event=row, how=how),))
            case "restore":
                self._go(done.after, done.now)
                yield Entry(self.moment, self._encoder.states(0, self.moment))
            case _:
                pass
        macrosteps = [each for each in done.results if not isinstance(each, str)]
        for macrostep in macrosteps:
            is_last = macrostep is macrosteps[-1]
            self._go(done.after if is_last else macrostep.after, macrostep.at)
            stepped = SimulationStep(0, macrostep, (), ())
            yield Entry(self.moment, tuple(self._encoder.step(0, self.moment, stepped)), stepped)
        if line.verb in ("run", "at"):
            self._go(done.after, done.now)

    def _go(self, snapshot: Snapshot, now: int) -> None:
        self.moment = replace(self.moment, now=now, snapshots=(snapshot,))
