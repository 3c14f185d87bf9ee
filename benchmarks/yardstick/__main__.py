"""``python -m benchmarks.yardstick``: measure all in one run, print the tables, save them."""

from __future__ import annotations

import argparse
import datetime as dt
import os
import platform
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from benchmarks.yardstick import generated_c, measure_c
from benchmarks.yardstick.figures import Results
from benchmarks.yardstick.folder import CHARTS, UnavailableError, find_folder
from benchmarks.yardstick.measure_c import Bench
from benchmarks.yardstick.report import show
from benchmarks.yardstick.streams import Stream, load_model, make_stream
from benchmarks.yardstick.tools import version

ROOT = Path(__file__).resolve().parents[2]
WIDTH = 110
"""Of what is printed to a file or a pipe, in characters."""
TOOLS = ("gcc", "arm-none-eabi-gcc", "valgrind")


def measure_machines(
    bench: Bench, stream: Stream, results: Results, step: Callable[[str], None]
) -> None:
    """Add the figures of all machines in C of a chart."""
    for name in bench.folder.limits(stream.letter):
        step(f"{stream.letter}: {name}")
        figures = bench.attempt(partial(measure_c.by_hand, bench, stream, name))
        if figures is not None:
            results.machines.append(figures)
    chart = bench.folder.chart(stream.letter)
    machines, notes = generated_c.machines(chart, generated_c.VARIANTS)
    for text in notes:
        bench.note(text)
    for machine in machines:
        step(f"{stream.letter}: {machine.variant.name}")
        bench.attempt(partial(measure_generated, bench, stream, machine, results))


def measure_generated(
    bench: Bench, stream: Stream, machine: generated_c.Machine, results: Results
) -> None:
    """Add the figures of a generated machine and of its parts."""
    made = measure_c.written(bench, machine, stream)
    results.machines.append(measure_c.by_fsmkit(bench, made))
    results.prices += measure_c.prices(bench, made)


def main(arguments: list[str] | None = None) -> int:
    """Measure what is asked for; 1 if a machine did other work than the model."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.yardstick", description=(__doc__ or "").split(": ")[1]
    )
    parser.add_argument("--yardstick", metavar="FOLDER", help="charts and machines by hand")
    parser.add_argument("--chart", choices=CHARTS, action="append", help="only this one")
    parser.add_argument("--work", type=Path, default=ROOT / "build" / "bench", metavar="FOLDER")
    options = parser.parse_args(arguments)
    errors = Console(stderr=True)
    try:
        folder = find_folder(options.yardstick, os.environ, ROOT)
    except UnavailableError as error:
        errors.print(str(error), markup=False)
        return 2
    work: Path = options.work.absolute()
    work.mkdir(parents=True, exist_ok=True)
    results = Results(
        dt.datetime.now(dt.UTC).date().isoformat(),
        f"{platform.node()} {platform.machine()}",
        {tool: version(tool, work) for tool in TOOLS},
    )

    def note(text: str) -> None:
        if text not in results.notes:
            results.notes.append(text)

    bench = Bench(folder, work, note)
    charts = options.chart or list(CHARTS)
    with Progress(console=errors, transient=True) as progress:
        task = progress.add_task("", total=len(charts) * 10)

        def step(text: str) -> None:
            progress.update(task, advance=1, description=text)

        model = load_model(folder)
        for letter in charts:
            step(f"{letter}: events")
            stream = make_stream(model, folder, letter, work)
            measure_machines(bench, stream, results, step)
    console = Console()
    if not console.is_terminal:
        console = Console(width=WIDTH)
    show(results, console)
    return 0 if all(machine.is_correct for machine in results.machines) else 1


if __name__ == "__main__":
    sys.exit(main())
