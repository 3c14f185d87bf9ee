"""Measure the cost of a live page: nine machines of the cell at 100 Hz, its picture at 50 Hz.

    python -m benchmarks.seen_live [--seconds 20]

A run of the cell is recorded first. Its macrosteps are then repeated, 100 per second for each
machine, with samples of the run 50 times per second, for a page in chromium that shows the
picture, one drawing and all cards. The output is the processor time of the server's thread and of
the interpreter that follows the logs of boards, and the frames per second of the page.
"""

from __future__ import annotations

import argparse
import asyncio
import shutil
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from fsmkit.diagnostics import Findings
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.picture import read_picture
from fsmkit.inspector.server import LiveServer, serve_hub
from fsmkit.inspector.sources import Entry
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Occurrence
from machines.production_cell.live.__main__ import PICTURE
from machines.production_cell.live.driving import Drive
from machines.production_cell.live.following import BoardLog
from machines.production_cell.live.source import ON_BOARD, Cell
from machines.production_cell.simulation.options import Options, prepare
from machines.production_cell.simulation.orchestrator import Orchestrator
from machines.production_cell.simulation.signals import MODULES

HERTZ, SAMPLES = 100, 50
RECORDED = 45_000
"""Steps of the run whose macrosteps are told."""


class Recorded:
    """A run: its entries by machine, and its samples."""

    def __init__(self, folder: Path) -> None:
        options = Options(RECORDED, folder / "out", bad=0.3)
        drive = Drive(options, 0)
        self.cell = Cell(drive)
        setup, world = prepare(replace(options, is_followed=True), folder)
        run = Orchestrator(setup, lambda states: replace(world, states=states), drive)
        thread = threading.Thread(target=run.run)
        thread.start()
        drive.has_begun.wait()
        charts = {machine.name: machine.chart for machine in self.cell.system.machines}
        drive.request(Occurrence(charts["panel"].event_index["by_rule"], ()))
        drive.go_on(0)
        self.entries: dict[str, list[Entry]] = defaultdict(list)
        self.samples: list[Mapping[str, float]] = []
        is_over = False
        while not is_over:
            is_over = not thread.is_alive()
            for entry in self.cell.receive():
                if entry.stepped is not None:
                    machine = self.cell.system.machines[entry.stepped.machine].name
                    self.entries[machine].append(entry)
            self.samples.append(self.cell.signals())
            time.sleep(0.01)
        thread.join()
        # once more, by itself, for the time that it takes
        logs = [
            BoardLog(options.out / f"{name}.input", names, {n: charts[n] for n in names})
            for name, names in ON_BOARD.items()
        ]
        begin = time.thread_time()
        done = sum(each.macrostep is not None for log in logs for each in log.read(RECORDED))
        self.each = (time.thread_time() - begin) / done


class Again:
    """A source that repeats the macrosteps of a run at its own rate."""

    time = "live"
    can: frozenset[str] = frozenset()

    def __init__(self, run: Recorded) -> None:
        self._run = run
        self.system = run.cell.system
        self.begin = None
        self._began = time.monotonic()
        self._told = self._sampled = 0

    def receive(self) -> Sequence[Entry]:
        """Return the entries up to the present time."""
        due = int((time.monotonic() - self._began) * HERTZ)
        found = []
        for number in range(self._told, due):
            for name in MODULES:
                entries = self._run.entries[name]
                found.append(entries[number % len(entries)])
        self._told = due
        return found

    def signals(self) -> Mapping[str, float]:
        """Return the sample of the present time."""
        due = int((time.monotonic() - self._began) * SAMPLES)
        samples = self._run.samples
        return {**samples[due % len(samples)], "time": due / SAMPLES}

    def post(self, machine: int, occurrence: Occurrence) -> None:
        """Take nothing."""

    def set_input(self, machine: int, place: int, value: Value) -> None:
        """Take nothing."""

    def close(self) -> None:
        """Give nothing back."""


def serve(source: Again, found: dict[str, float], ready: threading.Event) -> LiveServer:
    """Serve in a thread, which keeps its processor time."""
    hub = Hub(source, picture=read_picture(PICTURE, Findings()))
    server = LiveServer(hub)

    async def measured() -> None:
        serving = asyncio.create_task(serve_hub(server, lambda _: ready.set()))
        while True:
            await asyncio.sleep(0.25)
            found["cpu"], found["entries"] = time.thread_time(), hub.n
            found["at"] = time.monotonic()
            if serving.done():
                serving.result()

    threading.Thread(target=lambda: asyncio.run(measured()), daemon=True).start()
    return server


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="What it costs to look on.")
    parser.add_argument("--seconds", type=float, default=20)
    seconds = parser.parse_args().seconds
    chromium = shutil.which("chromium")
    if chromium is None:
        print("chromium is not there: make tools", file=sys.stderr)
        return 2
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory(prefix="cell") as folder:
        run = Recorded(Path(folder))
    each = run.each
    found: dict[str, float] = {}
    ready = threading.Event()
    server = serve(Again(run), found, ready)
    ready.wait()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.goto(server.address)
        page.click("#show-both")
        time.sleep(5)
        before, pictures, began = dict(found), page.evaluate("pictures"), time.monotonic()
        time.sleep(seconds)
        passed = time.monotonic() - began
        shown = page.evaluate("pictures") - pictures
        lost = page.evaluate("session.lost")
        browser.close()
    between = found["at"] - before["at"]
    told = (found["entries"] - before["entries"]) / between
    cpu = (found["cpu"] - before["cpu"]) / between
    print(f"{told:.0f} macrosteps a second of nine machines, samples at {SAMPLES} Hz")
    print(f"server: {100 * cpu:.1f} % of a core; messages lost: {lost}")
    print(f"page: {shown / passed:.1f} pictures a second (picture, one drawing, all cards)")
    print(
        f"interpreter that follows the boards' logs: {1e6 * each:.0f} us a macrostep, "
        f"{100 * each * told:.1f} % of a core at this rate"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
