"""Shows the cell while it runs: ``python -m machines.production_cell.live``."""

from __future__ import annotations

import asyncio
import secrets
import signal
import sys
import tempfile
import threading
import webbrowser
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
from rich.text import Text

from fsmkit.diagnostics import Findings
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.picture import Picture, check_names, read_picture
from fsmkit.inspector.server import LiveServer, serve_hub

from ..simulation.__main__ import OUT, console, reported_errors, stay_on_one_core, tell
from ..simulation.options import Options, prepare, run_options, steps_of
from ..simulation.orchestrator import Orchestrator, Outcome
from .driving import Drive
from .session import pytest_of
from .source import Cell

PICTURE = Path(__file__).parent / "cell.svg"
LONGEST = 1000.0
"""Hours that a run goes on if nobody ends it."""


class Run:
    """A run in a thread, and the hub that shows it."""

    def __init__(self, options: Options, drive: Drive, folder: Path, picture: Picture) -> None:
        self.drive = drive
        self.cell = Cell(drive)
        check_names(picture, self.cell.system)
        self.outcome: Outcome | None = None
        self.error: Exception | None = None
        setup, world = prepare(replace(options, is_followed=True), folder)
        self._pace = setup.pace
        self._run = Orchestrator(setup, lambda states: replace(world, states=states), drive)
        self.thread = threading.Thread(target=self._go, name="cell")
        self.thread.start()
        while drive.samples is None and self.thread.is_alive():
            drive.has_begun.wait(0.1)
        if self.error is not None:
            raise self.error
        self.hub = Hub(self.cell, session=secrets.token_hex(4), picture=picture)

    def _go(self) -> None:
        if not self._pace.hz:
            stay_on_one_core()
        elif refusal := self._pace.raise_priority():
            console.print(Text(f"priority of orchestrator and plant: {refusal}", style="yellow"))
        try:
            self.outcome = self._run.run()
        except Exception as error:  # noqa: BLE001  (reported by the thread that waits)
            self.error = error
        self.cell.end(str(self.error) if self.error else "the run has ended")


async def _serve(server: LiveServer, ready: Callable[[str], None]) -> None:
    """Serve until Ctrl-C; a run that has ended is still looked at."""
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)

    await serve_hub(server, ready, stop=stop)


def finish(run: Run, options: Options) -> int:
    """End a run; write the session, and print its results."""
    run.drive.close()
    run.thread.join()
    for note in run.drive.notes:
        console.print(Text(note, style="yellow"))
    session, found = run.drive.session()
    if run.drive.steps:
        (options.out / "session.yaml").write_text(str(session), encoding="utf-8")
        console.print(f"The session is in {options.out / 'session.yaml'}.")
    test = options.out / "test_session.py"
    test.unlink(missing_ok=True)
    if run.error is not None:
        raise run.error
    if run.outcome is None or not run.outcome.steps:
        console.print("ended before the first step")
        return 0
    if why := run.drive.why_not_again:
        console.print(f"No test was made of it, as {why}.")
    else:
        test.write_text(pytest_of(session, found), encoding="utf-8")
        console.print(f"A test of it is {test}.")
    return tell(options.out, run.outcome, has_faults=True, ring=options.ring)


@click.command()
@click.option("--hours", type=float, default=LONGEST, help="Simulated time; else until Ctrl-C.")
@click.option("--seconds", type=float, help="Simulated time, instead of hours.")
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="Any free one by default.")
@click.option("--open", "is_opened", is_flag=True, help="Open the page in a browser.")
@click.option("--read-only", "is_readonly", is_flag=True, help="Whoever connects only looks on.")
@click.option("--paused", "is_paused", is_flag=True, help="Stand still until the page says run.")
@click.option(
    "--speed", type=click.FloatRange(0, 1000), default=1.0, show_default=True,
    help="Simulated seconds in a second; 0: as fast as it can.",
)  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path), default=OUT, help="Where results go.")
@run_options
def main(
    hours: float, seconds: float | None, port: int, is_opened: bool, is_readonly: bool,
    is_paused: bool, speed: float, out: Path, **given: Any,
) -> None:  # fmt: skip
    """Show boards and plant of the Production Cell in a page while they run, and drive them."""
    options = Options(steps_of(hours, seconds), out.resolve(), **given)
    drive = Drive(options, speed=speed)
    with reported_errors(), tempfile.TemporaryDirectory(prefix="cell") as folder:
        picture = read_picture(PICTURE, Findings())
        console.print("building the boards")
        run = Run(options, drive, Path(folder), picture)
        server = LiveServer(run.hub, port=port, is_readonly=is_readonly)

        def ready(address: str) -> None:
            console.print(f"the cell: {address}", markup=False, soft_wrap=True)
            console.print("Ctrl-C ends the run.")
            if is_opened:
                webbrowser.open(address)
            if not is_paused:
                drive.go_on(speed)

        try:
            asyncio.run(_serve(server, ready))
        finally:
            code = finish(run, options)
        sys.exit(code)


if __name__ == "__main__":
    main()
