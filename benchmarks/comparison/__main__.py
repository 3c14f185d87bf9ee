"""``python -m benchmarks.comparison``: measure all in one run, print the tables, keep them."""

from __future__ import annotations

import argparse
import datetime as dt
import os
import platform
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType

from rich.console import Console
from rich.progress import Progress

from benchmarks.comparison import generated_c, measure_c, measure_python, peers, python_machines
from benchmarks.comparison.figures import FSMKIT, LIMIT, Results
from benchmarks.comparison.folder import CHARTS, UnavailableError, find_folder
from benchmarks.comparison.measure_c import Bench
from benchmarks.comparison.report import show
from benchmarks.comparison.saving import save, this_machine
from benchmarks.comparison.streams import Stream, load_model, make_stream
from benchmarks.comparison.tools import revision, version

ROOT = Path(__file__).resolve().parents[2]
WIDTH = 110
"""Of what is printed to a file or a pipe, in characters."""
TOOLS = ("gcc", "arm-none-eabi-gcc", "valgrind")
SUBJECTS = ("c", "python", "peers")
TARGETS = ("python", "pyext")
"""That write machines for Python."""
EVENTS = 100_000
"""In a run of a machine in Python."""

Step = Callable[[str], None]


def measure_machines(bench: Bench, stream: Stream, results: Results, step: Step) -> None:
    """Add the figures of all machines in C of a chart."""
    for name in bench.folder.limits(stream.letter):
        step(f"{stream.letter}: C, {name}")
        figures = bench.attempt(partial(measure_c.by_hand, bench, stream, name))
        if figures is not None:
            results.machines.append(figures)
    chart = bench.folder.chart(stream.letter)
    variants = generated_c.VARIANTS
    machines, notes = bench.attempt(lambda: generated_c.machines(chart, variants)) or ([], [])
    for text in notes:
        bench.note(text)
    for machine in machines:
        step(f"{stream.letter}: C, {machine.variant.name}")
        bench.attempt(partial(measure_generated, bench, stream, machine, results))


def measure_generated(
    bench: Bench, stream: Stream, machine: generated_c.Machine, results: Results
) -> None:
    """Add the figures of a generated machine and of its parts."""
    made = measure_c.written(bench, machine, stream)
    figures = measure_c.by_fsmkit(bench, made)
    results.machines.append(figures)
    results.prices += measure_c.prices(bench, made, figures)


def measure_speeds(
    bench: Bench, model: ModuleType, stream: Stream, results: Results, step: Step, rounds: int,
    *, with_peers: bool,
) -> None:  # fmt: skip
    """Add the events a second of all machines in Python of a chart."""
    entries: list[measure_python.Entry] = []

    def enter(start: Callable[[], python_machines.Contender], count: int) -> None:
        contender = bench.attempt(start)
        if contender is None:
            return
        step(f"{stream.letter}: Python, {contender.name} is verified")
        attempt = partial(measure_python.entered, model, stream, contender, count)
        entry = bench.attempt(attempt)
        if entry is not None:
            entries.append(entry)

    folder, work = bench.folder, bench.work
    enter(lambda: python_machines.by_hand(folder, stream, LIMIT), EVENTS)
    for target in TARGETS:
        enter(partial(python_machines.by_fsmkit, folder, stream, work, FSMKIT, target), EVENTS)
    if with_peers:
        chart = model.CH[stream.letter]()
        for peer in peers.PEERS:
            enter(partial(peers.contender, peer, chart, stream), measure_python.FEW)
    measure_python.race(entries, rounds, lambda text: step(f"{stream.letter}: {text}"))
    results.speeds += measure_python.speeds(stream.letter, entries)


def arguments_of(words: list[str] | None) -> argparse.Namespace:
    """Return what is asked for."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.comparison", description=(__doc__ or "").split(": ")[1]
    )
    add = parser.add_argument
    add("--yardstick", metavar="FOLDER", help="where the charts and the machines by hand are")
    add("--chart", choices=CHARTS, action="append", help="only this one; may be repeated")
    add("--only", choices=SUBJECTS, action="append", help="only this; may be repeated")
    add("--rounds", type=int, default=7, help="of the machines in Python (7)")
    add("--save", action="store_true", help="keep the figures in benchmarks/results")
    add("--machine", default=this_machine(), help="its name in what is kept")
    add("--work", type=Path, default=ROOT / "build" / "bench", metavar="FOLDER")
    options = parser.parse_args(words)
    if options.rounds < 1:
        parser.error("--rounds is at least 1")
    return options


def measure(options: argparse.Namespace, errors: Console) -> Results:
    """Return all figures; `UnavailableError` if there is no yardstick."""
    folder = find_folder(options.yardstick, os.environ, ROOT)
    work: Path = options.work.absolute()
    work.mkdir(parents=True, exist_ok=True)
    tools = {"fsmkit": revision(ROOT), "Python": platform.python_version()}
    tools |= {tool: version(tool, work) for tool in TOOLS}
    today = dt.datetime.now(dt.UTC).date().isoformat()
    results = Results(today, options.machine, tools)

    def note(text: str) -> None:
        if text not in results.notes:
            results.notes.append(text)

    bench = Bench(folder, work, note)
    subjects = options.only or SUBJECTS
    model = load_model(folder)
    with Progress(console=errors, transient=True, disable=not errors.is_terminal) as progress:
        task = progress.add_task("", total=None)

        def step(text: str) -> None:
            progress.update(task, description=text)

        for letter in options.chart or CHARTS:
            step(f"{letter}: events and digests of the model")
            stream = make_stream(model, folder, letter, work)
            if "c" in subjects:
                measure_machines(bench, stream, results, step)
            if "python" in subjects or "peers" in subjects:
                with_peers = "peers" in subjects
                measure_speeds(
                    bench, model, stream, results, step, options.rounds, with_peers=with_peers
                )
    return results


def main(words: list[str] | None = None) -> int:
    """Measure, print, keep; 1 if a machine did other work than the model, 2 without yardstick."""
    options = arguments_of(words)
    errors = Console(stderr=True)
    try:
        results = measure(options, errors)
    except UnavailableError as error:
        errors.print(str(error), markup=False)
        return 2
    console = Console()
    if not console.is_terminal:
        console = Console(width=WIDTH)
    show(results, console)
    if options.save:
        for path in save(results, ROOT / "benchmarks" / "results"):
            console.print(f"kept: {path.relative_to(ROOT)}", markup=False)
    return 0 if results.is_correct else 1


if __name__ == "__main__":
    sys.exit(main())
