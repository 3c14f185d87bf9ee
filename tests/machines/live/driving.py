"""A run that is driven by a client of a hub, as fast as it can."""

from __future__ import annotations

import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from fsmkit.inspector.hub import Hub
from machines.production_cell.live.driving import Drive
from machines.production_cell.live.source import Cell
from machines.production_cell.simulation.options import Options, prepare
from machines.production_cell.simulation.orchestrator import Orchestrator
from tests.inspector.conftest import Client

PATIENCE = 120.0
"""Seconds until what is waited for must be so."""


class Driven:
    """A run, the hub that shows it, and a client."""

    def __init__(self, options: Options, folder: Path) -> None:
        self.drive = Drive(options, speed=0)
        self.cell = Cell(self.drive)
        setup, world = prepare(replace(options, is_followed=True), folder)
        self.run = Orchestrator(setup, lambda states: replace(world, states=states), self.drive)
        self.error: Exception | None = None
        self.thread = threading.Thread(target=self._go)
        self.thread.start()
        assert self.drive.has_begun.wait(PATIENCE)
        self.hub = Hub(self.cell)
        self.client = Client(self.hub)

    def _go(self) -> None:
        try:
            self.run.run()
        except Exception as error:  # noqa: BLE001  (looked at by the test)
            self.error = error
        self.cell.end(str(self.error or "the run has ended"))

    def wait(self, condition: Callable[[], bool]) -> None:
        """Let the run go on until something is so."""
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, "it did not become so"
            assert self.thread.is_alive() or self.error is None, self.error
            self.hub.advance(20_000)
            time.sleep(0.01)

    def states(self, machine: str) -> list[str]:
        """Return what is active in a machine, as the client was told."""
        on: list[str] = []
        for message in self.client.told:
            if message.get("m") != machine or message["k"] not in ("state", "step"):
                continue
            if message["k"] == "state":
                on = list(message["on"])
                continue
            for row in message["do"]:
                if row[0] == "+":
                    on.append(row[1])
                elif row[0] == "-" and row[1] in on:
                    on.remove(row[1])
        return on

    def signal(self, name: str) -> float:
        """Return the last sample of a signal."""
        hello, sampled = self.client.last("hello"), self.client.last("signals")
        return float(sampled["v"][hello["signals"].index(name)])

    def post(self, event: str, **payload: Any) -> None:
        """Do something at the panel, and wait until it is done."""
        done = len(self.drive.deeds)
        self.client.result("post", m="panel", event=event, **{"with": payload})
        self.wait(lambda: len(self.drive.deeds) > done)


@contextmanager
def driven(options: Options) -> Iterator[Driven]:
    """Drive a run while the block runs; it has ended after it."""
    with tempfile.TemporaryDirectory(prefix="cell") as folder:
        made = Driven(options, Path(folder))
        try:
            yield made
        finally:
            made.drive.close()
            made.thread.join(PATIENCE)
            assert not made.thread.is_alive()
