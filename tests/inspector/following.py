"""Something that runs elsewhere: a gate whose entries a test makes by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import fsmkit
from fsmkit.diagnostics import FsmkitError
from fsmkit.inspector.as_messages import MessageEncoder
from fsmkit.inspector.simulation import Moment, Simulation, SimulationStep
from fsmkit.inspector.sources import Entry
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Occurrence
from fsmkit.runtime.live.messages import Lost, Post
from fsmkit.system.of_one_chart import system_of
from fsmkit.system.system import System


class Elsewhere:
    """A `Followed`: its machine is simulated here, and told entry by entry."""

    time = "live"

    def __init__(self, model: fsmkit.Chart | System, can: frozenset[str] = frozenset()) -> None:
        self.system = system_of(model) if isinstance(model, fsmkit.Chart) else model
        self.can = can
        self.simulation = Simulation(self.system)
        self.encoder = MessageEncoder(self.simulation)
        self.now: Moment = self.simulation.begin()
        self.begin: Moment | None = self.now
        self.is_known = True
        self.waiting: list[Entry] = []
        self.sampled: dict[str, float] = {}
        self.error: FsmkitError | None = None
        self.taken: list[tuple[object, ...]] = []
        self.is_closed = False

    # --- as the hub sees it --------------------------------------------------------------------

    def receive(self) -> Sequence[Entry]:
        if self.error is not None:
            raise self.error
        came, self.waiting = self.waiting, []
        return came

    def post(self, machine: int, occurrence: Occurrence) -> None:
        self.taken.append(("post", machine, occurrence))

    def set_input(self, machine: int, place: int, value: Value) -> None:
        self.taken.append(("set", machine, place, value))

    def signals(self) -> Mapping[str, float]:
        return dict(self.sampled)

    def close(self) -> None:
        self.is_closed = True

    # --- as a test drives it -------------------------------------------------------------------

    def happen(self, event: str = "", *payload: Value, until: int | None = None) -> None:
        """Let an event come, and time pass; what follows of that waits for the hub."""
        if event:
            chart = self.simulation.charts[0]
            occurrence = Occurrence(chart.event_index[event], payload)
            after = self.simulation.post(self.now, 0, occurrence)
            assert after is not None
            self.now = after
            name = self.simulation.names[0]
            self._tell((Post(m=name, n=0, at=self.now.now, event=[event], how="queued"),), None)
        end = self.now.now if until is None else until
        while True:
            self.now, done = self.simulation.step(self.now, end)
            if done is None:
                return
            self._tell(tuple(self.encoder.step(0, self.now, done)), done)

    def lose(self, count: int) -> None:
        """Let messages be lost on the way: nothing is known until `know`."""
        self.is_known = False
        self._tell((Lost(n=0, at=self.now.now, count=count, where="frame"),), None)

    def know(self) -> None:
        """Let a snapshot come: all is known again."""
        self.is_known = True
        self._tell(self.encoder.states(0, self.now), None)

    def _tell(self, messages: tuple[object, ...], done: SimulationStep | None) -> None:
        moment = self.now if self.is_known else None
        stepped = done if self.is_known else None
        self.waiting.append(Entry(moment, messages, stepped))  # type: ignore[arg-type]
