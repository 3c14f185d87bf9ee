"""The cell as a source of a hub: what its boards have logged, done again by the interpreter.

The logs are read in the thread of the hub, so a step of the run never waits for who looks on.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import fsmkit
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import fail
from fsmkit.inspector.as_messages import MessageEncoder
from fsmkit.inspector.simulation import Delivery, Moment, Simulation, SimulationStep
from fsmkit.inspector.sources import Entry, ended
from fsmkit.language import Value
from fsmkit.runtime.interpreter import initial
from fsmkit.runtime.interpreter.snapshot import Emitted, Macrostep, Occurrence, Snapshot
from fsmkit.runtime.live.messages import AnyMessage, Post, Set, State
from fsmkit.runtime.live.steps import row_of_event
from fsmkit.runtime.live.values import to_json
from fsmkit.system.machine import Machine
from fsmkit.system.system import System

from ..simulation.boards import NAMES
from ..simulation.signals import MODULES
from . import panel
from .driving import AtPanel, Began, Drive, Leaves
from .following import BoardEntry, BoardLog
from .session import pytest_of

ON_BOARD: Mapping[str, tuple[str, ...]] = {
    "a": ("supervisor", "feeder_belt", "feeder", "molder", "extractor"),
    "b": ("extraction_belt", "sorter", "camera", "rotator"),
}
"""The machines of a board, in the order of its instances."""


def system_of(ring: Path) -> System:
    """Return the machines on the boards and the panel, without the plant that is explored."""
    whole = fsmkit.read_system(ring)
    kept = [n for n, machine in enumerate(whole.machines) if machine.name in MODULES]
    place = {old: new for new, old in enumerate(kept)}
    machines = tuple(
        replace(whole.machines[n], shared=(), drives=None, environment=False) for n in kept
    )
    links = tuple(
        replace(link, source=place[link.source], target=place[link.target])
        for link in whole.event_links
        if link.source in place and link.target in place
        and link.port < len(whole.machines[link.source].chart.events)
    )  # fmt: skip
    return System("Production Cell", (*machines, Machine("panel", panel.chart())), links)


class Cell:
    """The view of a driven run: `Followed` by a hub."""

    time = "live"

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        self.system = system_of(drive.options.ring)
        self._encoder = MessageEncoder(Simulation(self.system))
        self._charts: dict[str, Chart] = {m.name: m.chart for m in self.system.machines}
        self._places = {name: number for number, name in enumerate(self._charts)}
        self._snapshots = [initial(machine.chart) for machine in self.system.machines]
        self._told_inputs = [snapshot.inputs for snapshot in self._snapshots]
        self._now = 0
        self._ended_because = ""
        out, names = drive.options.out, () if drive.options.double else NAMES
        self._logs = {
            name: BoardLog(out / f"{name}.input", ON_BOARD[name], self._charts) for name in names
        }
        for log in self._logs.values():
            log.path.unlink(missing_ok=True)  # that of an earlier run

    @property
    def can(self) -> frozenset[str]:
        """The commands that the run supports; boards in loops of their own cannot be stopped."""
        stepped = () if self.drive.options.hz else ("run", "pause", "step")
        return frozenset(("post", *stepped))

    @property
    def begin(self) -> Moment | None:
        """All machines before their start; None if no log has their data."""
        return self._known()

    @property
    def is_running(self) -> bool:
        """Whether the run goes on."""
        return self.drive.is_running

    @property
    def speed(self) -> float:
        """Simulated seconds in a second; 0: as fast as can be."""
        return self.drive.speed

    def run(self, speed: float) -> None:
        """Go on."""
        self.drive.go_on(speed)

    def pause(self) -> None:
        """Stand still."""
        self.drive.pause()

    def step(self, ticks: int) -> None:
        """Go on by some ticks, and stand still."""
        self.drive.step(ticks)

    def post(self, machine: int, occurrence: Occurrence) -> None:
        """Do something at the panel before the next step."""
        name = self.system.machines[machine].name
        if name != "panel":
            raise fail(
                "wrong-command",
                f"`{name}` runs on a board, which takes no events from here",
                help="drive the cell by the machine `panel`",
            )
        self.drive.request(occurrence)

    def set_input(self, machine: int, place: int, value: Value) -> None:
        """Reject the command: the inputs of the machines are wires of the boards."""
        del machine, place, value
        raise fail("wrong-command", "the inputs of a board are its wires", help="use the panel")

    def signals(self) -> Mapping[str, float]:
        """Return the last samples."""
        samples = self.drive.samples
        return {} if samples is None else samples.told()

    def close(self) -> None:
        """Let the run end."""
        self.drive.close()

    def end(self, why: str) -> None:
        """Note that the run has ended; after its last entry there is no other."""
        self._ended_because = why

    def receive(self) -> Sequence[Entry]:
        """Return what came since the last call; `FsmkitError` when the run has ended."""
        why = self._ended_because
        found = list(self._entries())
        if why and not found:
            raise ended(why)
        return found

    def save(self, kind: str) -> str:
        """Return what was done at the panel: a ``script`` (see `session`), or a ``pytest``."""
        session, found = self.drive.session()
        if kind == "script":
            return str(session)
        why = self.drive.why_not_again
        if why or not self.drive.steps:
            why = f"no test does it again, as {why}" if why else "there was no step yet"
            raise fail("wrong-command", why, help="save as `script`")
        return pytest_of(session, found)

    # --- entries -------------------------------------------------------------------------------

    def _entries(self) -> Iterator[Entry]:
        until, events = self.drive.steps, self.drive.events
        found: list[tuple[int, int, Any]] = []
        while events and events[0].at <= until + 1:
            event = events.popleft()
            if isinstance(event, Began):
                found += self._ended(event, until)
            found.append((event.at, 0, event))
        for number, log in enumerate(self._logs.values(), 1):
            found += ((each.at, number, each) for each in log.read(until))
        for at, _, each in sorted(found, key=lambda one: one[:2]):
            self._now = max(self._now, at)
            match each:
                case AtPanel():
                    yield from self._panel_entries(each)
                case Began(board=board):
                    yield self._board_entry(board)
                case Leaves(numbers=numbers):
                    yield self._leaves_entry(numbers)
                case BoardEntry():
                    yield from self._machine_entries(each)

    def _ended(self, event: Began, until: int) -> list[tuple[int, int, Any]]:
        """Read a log to its end before it is written anew."""
        if event.is_alive:
            self._logs[event.board].begin()
            return []
        return [(each.at, -1, each) for each in self._logs[event.board].read(until)]

    def _moment(self) -> Moment:
        snapshots = tuple(self._snapshots)
        return Moment(self._now, snapshots, (1,) * len(snapshots), ({},) * len(snapshots))

    def _known(self) -> Moment | None:
        return self._moment() if self._logs else None

    def _panel_entries(self, event: AtPanel) -> Iterator[Entry]:
        place = self._places["panel"]
        if event.what is not None:
            row = row_of_event(panel.chart(), event.what)
            how = "queued" if event.done else "refused"
            yield Entry(self._known(), (Post(m="panel", n=0, at=event.at, event=row, how=how),))
        for macrostep in event.done:
            yield self._macrostep(place, macrostep, macrostep.after)

    def _machine_entries(self, each: BoardEntry) -> Iterator[Entry]:
        place = self._places[each.machine]
        if each.macrostep is None:
            self._snapshots[place] = each.after
            return
        yield self._macrostep(place, each.macrostep, each.after)

    def _macrostep(self, place: int, macrostep: Macrostep, after: Snapshot) -> Entry:
        self._snapshots[place] = after
        stepped = SimulationStep(place, macrostep, tuple(self._passed(place, macrostep)), ())
        moment = self._moment()
        told: list[AnyMessage] = self._encoder.step(0, moment, stepped)
        changed = self._inputs_of(place, macrostep)
        if changed is not None:
            told.append(changed)
        return Entry(moment if self._logs else None, tuple(told), stepped if self._logs else None)

    def _inputs_of(self, place: int, macrostep: Macrostep) -> Set | None:
        """Return the inputs that changed since the machine's previous report."""
        machine, inputs = self.system.machines[place], macrostep.after.inputs
        pairs = zip(machine.chart.inputs, self._told_inputs[place], inputs, strict=True)
        changed = {each.name: to_json(new, each.type) for each, old, new in pairs if old != new}
        self._told_inputs[place] = inputs
        return Set(m=machine.name, n=0, at=macrostep.at, inputs=changed) if changed else None

    def _passed(self, source: int, macrostep: Macrostep) -> Iterator[Delivery]:
        """Yield what goes to other machines; it is in their logs when it has come."""
        for effect in macrostep.effects:
            if not isinstance(effect, Emitted):
                continue
            event, values = effect.occurrence.event, effect.occurrence.payload
            for link in self.system.event_links:
                if (link.source, link.port) == (source, event):
                    sent = Occurrence(link.event, tuple(values[n] for n in link.arguments))
                    yield Delivery(link, sent, has_room=True)

    def _board_entry(self, board: str) -> Entry:
        """Return the start or the end of a board: its machines have not started."""
        for name in ON_BOARD[board]:
            self._snapshots[self._places[name]] = initial(self._charts[name])
            self._told_inputs[self._places[name]] = self._snapshots[self._places[name]].inputs
        moment = self._moment()
        states = {state.m: state for state in self._encoder.states(0, moment)}
        return Entry(moment, tuple(states[name] for name in ON_BOARD[board]))

    def _leaves_entry(self, numbers: Sequence[int]) -> Entry:
        """Return the states that machines are in of which nothing else is known."""
        states, names = [], self.drive.run_.outcome.states if self.drive.run_ else {}
        for name, number in zip(MODULES, numbers, strict=True):
            chart = self._charts[name]
            leaf = chart.state_index[names[name][number]]
            on = [*reversed([n for n in chart.ancestors(leaf) if n]), leaf]
            states.append(
                State(
                    m=name, n=0, at=self._now, on=[chart.states[n].id for n in on], data={},
                    inputs={}, outputs={}, queue=[], deferred=[], timers=[], status="running",
                    known=False,
                )
            )  # fmt: skip
        return Entry(None, tuple(states))
