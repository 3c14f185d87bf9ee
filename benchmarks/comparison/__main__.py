"""``python -m benchmarks.comparison``: measure all in one run, print the tables, keep them."""

from __future__ import annotations

import argparse
import datetime as dt
import platform
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from benchmarks.comparison import c_machines, measure_c, measure_python, peers, python_machines
from benchmarks.comparison.figures import FSMKIT, LIMIT, Results
from benchmarks.comparison.measure_c import Bench
from benchmarks.comparison.report import show
from benchmarks.comparison.saving import save, this_machine
from benchmarks.comparison.tools import revision, version
from benchmarks.yardstick.charts import LETTERS, chart_file
from benchmarks.yardstick.streams import Stream, make_stream

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
    for machine in c_machines.by_hand(stream.letter):
        step(f"{stream.letter}: C, {machine.variant.name}")
        bench.attempt(partial(measure_machine, bench, stream, machine, results, LIMIT))
    chart = chart_file(stream.letter)
    variants = c_machines.VARIANTS
    machines, notes = bench.attempt(lambda: c_machines.machines(chart, variants)) or ([], [])
    for text in notes:
        bench.note(text)
    for machine in machines:
        step(f"{stream.letter}: C, {machine.variant.name}")
        bench.attempt(partial(measure_machine, bench, stream, machine, results, FSMKIT))


def measure_machine(
    bench: Bench, stream: Stream, machine: c_machines.Machine, results: Results, kind: str
) -> None:
    """Add the figures of a machine in C, and of the parts of a generated one."""
    build = measure_c.prepare(bench, machine, stream)
    figures = measure_c.figures(bench, build, kind)
    results.machines.append(figures)
    if kind == FSMKIT:
        results.prices += measure_c.prices(bench, build, figures)


def measure_speeds(
    bench: Bench, stream: Stream, results: Results, step: Step, rounds: int, *, with_peers: bool
) -> None:
    """Add the events a second of all machines in Python of a chart."""
    entries: list[measure_python.Entry] = []

    def enter(start: Callable[[], python_machines.Contender], count: int) -> None:
        contender = bench.attempt(start)
        if contender is None:
            return
        step(f"{stream.letter}: Python, {contender.name} is verified")
        entry = bench.attempt(partial(measure_python.entered, stream, contender, count))
        if entry is not None:
            entries.append(entry)

    chart = chart_file(stream.letter)
    enter(lambda: python_machines.by_hand(stream, LIMIT), EVENTS)
    for target in TARGETS:
        enter(partial(python_machines.by_fsmkit, chart, stream, bench.work, FSMKIT, target), EVENTS)
    if with_peers:
        for peer in peers.PEERS:
            enter(partial(peers.contender, peer, stream), measure_python.FEW)
    measure_python.race(entries, rounds, lambda text: step(f"{stream.letter}: {text}"))
    results.speeds += measure_python.speeds(stream.letter, entries)


def arguments_of(words: list[str] | None) -> argparse.Namespace:
    """Return the options."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.comparison", description=(__doc__ or "").split(": ")[1]
    )
    add = parser.add_argument
    add("--chart", choices=LETTERS, action="append", help="only this one; may be repeated")
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
    """Return all figures."""
    work: Path = options.work.absolute()
    work.mkdir(parents=True, exist_ok=True)
    tools = {"fsmkit": revision(ROOT), "Python": platform.python_version()}
    tools |= {tool: version(tool, work) for tool in TOOLS}
    today = dt.datetime.now(dt.UTC).date().isoformat()
    results = Results(today, options.machine, tools)

    def note(text: str) -> None:
        if text not in results.notes:
            results.notes.append(text)

    bench = Bench(work, note)
    subjects = options.only or SUBJECTS
    with Progress(console=errors, transient=True, disable=not errors.is_terminal) as progress:
        task = progress.add_task("", total=None)

        def step(text: str) -> None:
            progress.update(task, description=text)

        for letter in options.chart or LETTERS:
            step(f"{letter}: events and digests of the model")
            stream = make_stream(letter, work)
            if "c" in subjects:
                measure_machines(bench, stream, results, step)
            if "python" in subjects or "peers" in subjects:
                with_peers = "peers" in subjects
                measure_speeds(bench, stream, results, step, options.rounds, with_peers=with_peers)
    return results


def main(words: list[str] | None = None) -> int:
    """Measure, print and store; return 1 if a machine did other work than the model."""
    options = arguments_of(words)
    results = measure(options, Console(stderr=True))
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
