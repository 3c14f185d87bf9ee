"""Runs the cell: ``python -m machines.production_cell.simulation --hours 1 --blocks 3``."""

from __future__ import annotations

import json
import os
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from fsmkit.diagnostics import FsmkitError

from . import faults, monitor, nodes, picture, recording
from .effects import Effect, effects
from .kept import kept as keeping
from .monitor import Judged
from .options import Options, prepare, run_options, steps_of
from .orchestrator import Orchestrator, Outcome, Setup
from .pace import Pace
from .tally import Tally, tally
from .world import World

ROOT = Path(__file__).resolve().parents[3]
OUT = ROOT / "build" / "cell"
SHOWN = 60.0
"""How much of a run is drawn, in s."""

MOST_LINES = 60
"""Maximum number of reported events about faults."""

console = Console(highlight=False, width=None if sys.stdout.isatty() else 110)


@click.command()
@click.option("--hours", type=float, default=1.0, show_default=True, help="Simulated time.")
@click.option("--seconds", type=float, help="Simulated time, instead of hours.")
@click.option("--strict", is_flag=True, help="End with 1 if a fault had no effect.")
@click.option("--kept", is_flag=True, help="supervisord starts and restarts the boards.")
@click.option("--out", type=click.Path(path_type=Path), default=OUT, help="Where results go.")
@run_options
def main(
    hours: float, seconds: float | None, strict: bool, kept: bool, out: Path, **given: Any
) -> None:
    """Run boards and plant of the Production Cell together, and print the results."""
    options = Options(steps_of(hours, seconds), out.resolve(), **given)
    with reported_errors():
        with tempfile.TemporaryDirectory(prefix="cell") as folder:
            setup, world = prepare(options, Path(folder))
            _schedule(setup.pace)
            with keeping(setup) if kept else nullcontext(setup) as setup:
                outcome = _run(setup, world)
        code = tell(options.out, outcome, bool(options.fault), strict, options.ring)
        if outcome.not_begun:
            console.print(
                f"A fault did not occur in {outcome.steps / 1000:g} s. Simulate longer: --seconds.",
                style="red",
            )
        sys.exit(code or int(bool(outcome.not_begun)))


@contextmanager
def reported_errors() -> Iterator[None]:
    """Print what goes wrong, and end with 2."""
    try:
        yield
    except (
        nodes.CellError,
        faults.FaultError,
        recording.RecordingError,
        FsmkitError,
        OSError,
    ) as error:
        text = str(error) if isinstance(error, FsmkitError) else f"error: {error}"
        console.print(Text(text, style="red"))
        sys.exit(2)


def stay_on_one_core() -> None:
    """Keep all processes of a run on one core: they take turns.

    To wake one on another core takes longer than its step; on two cores a run is slower by half.
    """
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def _schedule(pace: Pace) -> None:
    """Give this process its core or its priority, which its child processes inherit."""
    if not pace.hz:
        stay_on_one_core()
    elif refusal := pace.raise_priority():
        console.print(Text(f"priority of orchestrator and plant: {refusal}", style="yellow"))


def _run(setup: Setup, world: World) -> Outcome:
    """Run to the end, or to Ctrl-C, and report the recording; a second Ctrl-C aborts."""
    run = Orchestrator(setup, lambda states: replace(world, states=states))
    began = time.monotonic()

    def interrupt(number: int, frame: object) -> None:
        del number, frame
        run.stop()
        signal.signal(signal.SIGINT, signal.default_int_handler)

    signal.signal(signal.SIGINT, interrupt)
    signal.signal(signal.SIGTERM, interrupt)
    with console.status("connecting") as status:

        def progress(step: int) -> None:
            rate = step / max(time.monotonic() - began, 1e-6)
            status.update(
                f"{step / 1000:,.0f} of {setup.steps / 1000:,.0f} s, {rate:,.0f} steps a second"
            )

        try:
            outcome = run.run(progress)
        except KeyboardInterrupt:
            raise nodes.CellError("interrupted") from None
    if not outcome.steps:
        raise nodes.CellError("interrupted before the first step")
    if outcome.steps < setup.steps:
        console.print(f"interrupted after {outcome.steps / 1000:g} s")
    return outcome


def tell(
    out: Path, outcome: Outcome, has_faults: bool, strict: bool = False, ring: Path = monitor.RING
) -> int:
    """Print and write the results; return 0 if everything is as it should be, else 1.

    ``ring``: the system whose properties are judged.
    """
    record = recording.read(out / "run.rec")
    events = outcome.reports.get("plant", {}).get("events", [])
    figures = tally(record, outcome)
    judged = monitor.judge(record, events, ring)
    came = effects(record, outcome)
    result = {
        "figures": figures.as_json(),
        "properties": [asdict(j) for j in judged],
        "faults": [effect.as_json() for effect in came],
        "faults_not_begun": outcome.not_begun,
        "events": events,
        "reports": outcome.reports,
        "earlier_lives": outcome.lives,
        **({"pace": outcome.pace, "back": outcome.back} if outcome.pace else {}),
    }
    (out / "result.json").write_text(json.dumps(result, indent=1))
    console.print(_figures(figures))
    if outcome.pace:
        console.print(_pace(outcome))
    console.print(_properties(judged, has_faults, ring))
    if has_faults:
        console.print(_effects(came, outcome.not_begun))
        for at, what in figures.timeline[:MOST_LINES]:
            console.print(f"{at:10.3f} s  {what}", markup=False)
        if len(figures.timeline) > MOST_LINES:
            console.print(f"and {len(figures.timeline) - MOST_LINES} more: result.json")
    for event in [e for e in events if e["kind"] not in {"ejected", "removed"}][:20]:
        console.print(
            f"{event['time']:10.3f} s  {event['kind']} {event['block'] or ''} {event['detail']}"
        )
    _draw(out, record, figures)
    console.print(f"Everything is in {out}.")
    broken = [
        j for j in judged
        if j.holds is False and j.name != "produces"
        and not (has_faults and j.name in monitor.OF_FAULTS)
    ]  # fmt: skip
    bad = figures.collisions or broken or not figures.is_accounted_for
    idle = any(effect.is_idle for effect in came)
    return int(bool(bad) or (bool(figures.lost) and not has_faults) or (strict and idle))


def _figures(figures: Tally) -> Table:
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column()
    table.add_column(justify="right")
    rows = (
        ("simulated", f"{figures.simulated:,.0f} s, {figures.producing:,.0f} s of them producing"),
        ("blocks processed", f"{figures.processed:,}"),
        ("moulded", f"{figures.moulded:,}, {figures.throughput:.2f} a minute"),
        ("laid down by the operator", f"{figures.inserted:,}"),
        ("rejected", f"{figures.rejected:,}, {figures.good_rejected:,} of them good"),
        ("passed though not good", f"{figures.bad_passed:,}"),
        ("left in the ring", f"{figures.left}"),
        ("taken away by the operator", f"{figures.removed}"),
        ("lost, doubled", f"{figures.lost}, {figures.doubled}"),
        ("collisions", f"{figures.collisions}"),
        ("estimates before the sorter", f"{figures.estimates:,}, {figures.wrong_estimates} wrong"),
        ("loop overruns", f"{figures.overruns}"),
        ("frames lost between boards", f"{figures.link_losses}"),
        ("events refused", f"{figures.refused}"),
        ("the supervisor ends in", figures.ends_in),
        ("steps a second", f"{figures.step_rate:,.0f}"),
        ("bare questions a second", f"{figures.ping_rate:,.0f}"),
    )
    for row in rows:
        table.add_row(*row)
    return table


def _effects(came: tuple[Effect, ...], not_begun: list[str]) -> Table:
    """Return what faults met and did."""
    table = Table("fault", "at", "met", "effect", box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for effect in came:
        met = ", ".join(
            f"{name} {state}"
            for name, state in effect.met.items()
            if name == "supervisor" or effect.fault.endswith(f" {name}") or name == effect.machine
        )
        text = Text(str(effect), style="yellow" if effect.is_idle else "")
        table.add_row(effect.fault, f"{effect.at:.3f} s", met, text)
    for fault in not_begun:
        table.add_row(fault, "", "", "[yellow]its time did not come[/]")
    return table


def _pace(outcome: Outcome) -> Table:
    """Return how the run kept to the clock, and why loops of boards overran."""
    pace = outcome.pace
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    share = 100 * pace["late"] / pace["cycles"]
    late = f"{pace['late']:,} ({share:.2f} %), {pace['missed']:,} missed"
    table.add_row(f"cycles at {pace['hz']} Hz", f"{pace['cycles']:,}")
    table.add_row("late by more than a period", f"{late}, at most by {pace['worst_ms']:.1f} ms")
    for name, at in pace["exchange"].items():
        times = f"p50 {at['p50_ms']:.2f}, p99 {at['p99_ms']:.2f}, max {at['max_ms']:.2f} ms"
        table.add_row(f"exchange with board {name}", f"{times}, {at['unanswered']:,} not in time")
    for name, report in outcome.reports.items():
        reasons = [f"{n:,} {reason}" for reason, n in report.get("reasons", {}).items() if n]
        if reasons:
            table.add_row(f"overruns of board {name}", ", ".join(reasons))
    for name, seconds in outcome.back.items():
        after = ", ".join(f"{each:.2f}" for each in seconds)
        table.add_row(f"board {name}, killed, was back after", f"{after} s")
    return table


def _properties(judged: tuple[Judged, ...], has_faults: bool, ring: Path) -> Table:
    of_ring = f"of {ring.name}"
    table = Table(
        "property", of_ring, "in this run", box=None, pad_edge=False, padding=(0, 2, 0, 0)
    )
    for each in judged:
        if each.holds is None:
            verdict = f"not judged: {each.reason}"
        elif each.name == "produces":
            verdict = f"seen at {each.time:.3f} s" if each.holds else "not seen"
        elif each.holds:
            verdict = "holds"
        else:
            verdict = f"[red]broken[/] at {each.time:.3f} s"
            if has_faults and each.name in monitor.OF_FAULTS:
                verdict = f"broken at {each.time:.3f} s, as faults may"
        text = each.text if len(each.text) < 60 else each.text[:57] + "..."
        table.add_row(each.name, Text(text), verdict)
    return table


def _draw(out: Path, record: recording.Recording, figures: Tally) -> None:
    """Draw what is most interesting: the first fault, or the first minute of work."""
    first = next((at for at, what in figures.timeline if what.startswith("fault")), None)
    begin = max(0.0, first - 10) if first is not None else 0.0
    end = min(begin + SHOWN, len(record) / 1000)
    try:
        picture.draw(record, out / "run.svg", begin, end)
    except ImportError:
        console.print("Matplotlib is not installed: nothing is drawn")


if __name__ == "__main__":
    main()
