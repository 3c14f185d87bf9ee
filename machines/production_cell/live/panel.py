"""The panel: a chart whose operations are obeyed by the orchestrator."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import fsmkit
from fsmkit.chart.chart import Chart
from fsmkit.runtime.host_methods import BoundHost
from fsmkit.runtime.interpreter import post, run, start
from fsmkit.runtime.interpreter.snapshot import Macrostep, Occurrence

from ..simulation import faults
from ..simulation.orchestrator import Orchestrator

CHART = Path(__file__).parent / "panel.yaml"
LONGER: Mapping[str, Mapping[str, object]] = {"loss": {"for": 20}}
"""By hand nothing is broken for ever: there would be no way to mend it."""


@cache
def chart() -> Chart:
    """Return the chart of the panel."""
    return fsmkit.read_chart(CHART)


class Panel:
    """A panel in use. Time is that of the run: a tick is a step."""

    def __init__(self, run: Orchestrator) -> None:
        self._run = run
        self._now = 0
        self._host = BoundHost(chart(), self)
        run.operate(lambda operator: replace(operator, hands_off=True))
        self.first = start(chart(), 0, self._host)
        self.snapshot = self.first.after

    def do(self, now: int, occurrence: Occurrence) -> tuple[Macrostep, ...]:
        """Do something at a step, and what follows from it; nothing if the queue is full.

        Raises `FaultError` or `CellError` for a fault that makes no sense.
        """
        self._now = now
        posted = post(chart(), self.snapshot, occurrence)
        if posted is None:
            return ()
        done = run(chart(), posted, now, self._host)
        self.snapshot = done[-1].after if done else posted
        return done

    # --- the operations of the chart -----------------------------------------------------------

    def press(self, button: str) -> None:
        """Let a button be pressed."""
        self._run.operate(lambda operator: replace(operator, asked=button))

    def open_chain(self, open: bool) -> None:  # noqa: A002  (names of the chart)
        """Open or close the emergency chain."""
        self._run.open_chain(is_open=open)

    def work_by_rule(self, on: bool) -> None:
        """Let the operator press buttons by his rules."""
        self._run.operate(lambda operator: replace(operator, hands_off=not on))

    def lay_block(self) -> None:
        """Let a block be laid when the lamp is on."""
        self._run.operate(lambda operator: replace(operator, extra=min(8, operator.extra + 1)))

    def begin(self, fault: str) -> None:
        """Start a fault by its name."""
        self._break({"fault": fault, **faults.BY_NAME.get(fault, {}), **LONGER.get(fault, {})})

    def jam(self, axis: str) -> None:
        """Jam an axis at once."""
        self._break({"fault": "jam", "axis": axis})

    def take(self, slot: str) -> None:
        """Take a block away from a slot, as soon as one is there."""
        self._break({"fault": "lost_block", "slot": slot})

    def restart(self, board: str) -> None:
        """Restart a dead board."""
        self._run.restart(board)

    def _break(self, line: Mapping[str, object]) -> None:
        for fault in faults.schedule([{"at": self._now / 1000, **line}]):
            self._run.watch_for(fault)
