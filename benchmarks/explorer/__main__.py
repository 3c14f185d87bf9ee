"""Measure: ``python -m benchmarks.explorer [--count N] [--rounds N]``.

Both tools explore the dining philosophers and a token ring exhaustively, without reductions that
omit states, on one core, with the same compiler and flags. Processor seconds and maximum resident
size are those of the whole process, by the system's accounts. The median of several alternating
rounds is shown. SPIN runs in its fastest exhaustive mode for each system: depth first for the
philosophers, breadth first for the ring. Without SPIN its rows are missing.

fsmkit omits steps if it takes another order of them (``core/search/sleep_sets.h``). It still finds
the same states at the same distances, and counts the same transitions. A second row takes every
step, a third one uses two cores, and a fourth one stores states as a decision diagram
(``core/symbolic``), so that its seconds do not relate to single states. The last ones use one and
two MPI processes (``core/mpi``), if installed; their memory is the sum.

If other work shares the cores, the clock shows their load instead of the speedup. Therefore the
processor seconds of the busier of two threads are shown, too. The seconds of one core divided by
these are the speedup on two idle cores, without waiting.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median

import click
from rich.console import Console
from rich.table import Table

from fsmkit.diagnostics import Findings
from fsmkit.system.system_file import load_system
from fsmkit.verify.engines.c.engine import CEngine, compiler
from fsmkit.verify.engines.c.mpi import OVERSUBSCRIBED, launcher
from fsmkit.verify.statespace.closed_system import close
from fsmkit.verify.statespace.ranks import Ranks

HERE = Path(__file__).parent
PHILOSOPHERS = """\
system: Philosophers
machines:
  "phil[i in 0..{last}]":
    chart: {chart}
    with: {{N: {count}, FIRST: "min(i, (i + 1) % {count})", SECOND: "max(i, (i + 1) % {count})"}}
shared:
  taken: "bool[{count}] = false"
properties:
  apart:
    invariant: "all(i in phil: not (phil[i].In(eating) and phil[(i + 1) % {count}].In(eating)))"
  D: deadlock_free
"""
RING = """\
system: TokenRing
machines:
  "node[i in 0..{last}]":
    chart: {chart}
    with: {{N: {count}, ME: i, NEXT: (i + 1) % {count}, FIRST: "i % 3 == 0 ? 2 : 0"}}
shared:
  queue: "0..6[{count}] = 0"
properties:
  D: deadlock_free
"""


@dataclass(frozen=True, slots=True)
class Model:
    """A system in both languages, and how SPIN is fastest with it."""

    name: str
    system: str
    chart: str
    promela: str
    mode: str
    defines: tuple[str, ...] = ()


MODELS = (
    Model("philosophers", PHILOSOPHERS, "philosopher.yaml", "philosophers.pml", "depth first"),
    Model("ring", RING, "node.yaml", "ring.pml", "breadth first", ("-DBFS",)),
)


@dataclass(frozen=True, slots=True)
class Measured:
    """The cost of one tool: seconds of processor and clock, maximum memory in bytes.

    ``busiest``: processor seconds of the busiest thread; 0 if unknown.
    """

    tool: str
    states: int
    transitions: int
    seconds: float
    elapsed: float
    bytes: int
    busiest: float = 0.0

    @property
    def rate(self) -> float:
        """States a second."""
        return self.states / self.seconds

    @property
    def bytes_a_state(self) -> float:
        """All memory of the process, for each state."""
        return self.bytes / self.states


@dataclass(frozen=True, slots=True)
class Spent:
    """The cost of a process; see `Measured`."""

    seconds: float
    elapsed: float
    bytes: int
    busiest: float


SAMPLED = 0.02
"""Seconds from one look at the threads of a program to the next."""


def busiest_thread(process: int) -> float:
    """Wait until a program ends; return the processor seconds of the thread that had most."""
    most, tasks = 0.0, Path(f"/proc/{process}/task")
    while os.waitid(os.P_PID, process, os.WEXITED | os.WNOWAIT | os.WNOHANG) is None:
        try:
            for task in tasks.iterdir():
                nanoseconds = (task / "schedstat").read_text().split()[0]
                most = max(most, int(nanoseconds) / 1e9)
        except OSError:  # no such system, or a thread that has just ended
            pass
        time.sleep(SAMPLED)
    return most


def run(command: list[str], folder: Path) -> tuple[str, Spent]:
    """Return the output of a program, and its cost."""
    with (folder / "said").open("w+") as said:
        begin = time.monotonic()
        process = subprocess.Popen(command, stdout=said, cwd=folder)
        busiest = busiest_thread(process.pid)
        _, status, usage = os.wait4(process.pid, 0)
        if status:
            raise click.ClickException(f"{command[0]} ended with status {status}")
        said.seek(0)
        elapsed = time.monotonic() - begin
        seconds = usage.ru_utime + usage.ru_stime
        return said.read(), Spent(seconds, elapsed, usage.ru_maxrss * 1024, busiest)


def explore(
    program: Path, tool: str, more: tuple[str, ...], folder: Path, ahead: tuple[str, ...] = ()
) -> Measured:
    """Run an explorer once; ``ahead``: a command that starts it."""
    said, spent = run([*ahead, str(program), *more], folder)
    told = json.loads(said.splitlines()[-1])["result"]
    if told["outcome"] != "complete":
        raise click.ClickException(f"the exploration ended early: {told['outcome']}")
    most = spent.bytes
    if "ranks" in told:
        most = told["ranks"]["resident"]
        tool += f", {told['ranks']['sent'] / told['states']:.1f} B sent a state"
    states, steps = told["states"], told["transitions"]
    return Measured(tool, states, steps, spent.seconds, spent.elapsed, most, spent.busiest)


def build_fsmkit(model: Model, count: int, folder: Path, ranks: Ranks | None = None) -> Path:
    """Return the explorer of a system."""
    file = folder / f"{model.name}.yaml"
    system = model.system.format(count=count, last=count - 1, chart=HERE / model.chart)
    file.write_text(system, encoding="utf-8")
    findings = Findings()
    with closing(CEngine(close(load_system(file, findings)), findings, ranks=ranks)) as engine:
        return Path(shutil.copy(engine.program, folder / f"fsmkit-{ranks is not None}"))


def build_spin(model: Model, count: int, folder: Path) -> bool:
    """Make SPIN's explorer of a system; false where there is no SPIN."""
    spin, gcc = shutil.which("spin"), compiler()
    if spin is None or gcc is None:
        return False
    copy = shutil.copy(HERE / model.promela, folder)
    subprocess.run([spin, "-a", f"-DN={count}", copy], cwd=folder, check=True)
    flags = ["-std=gnu99", "-O2", "-w", "-DSAFETY", "-DNOREDUCE", "-DMEMLIM=16000", *model.defines]
    subprocess.run([gcc, *flags, "pan.c", "-o", "pan"], cwd=folder, check=True)
    return True


def explore_by_spin(model: Model, count: int, folder: Path) -> Measured:
    """Run SPIN's explorer once."""
    said, spent = run(["./pan", "-m20000000", f"-w{16 + count}"], folder)
    if "error: max search depth" in said or "aborted" in said:
        raise click.ClickException("SPIN ended early")
    states, transitions = (
        round(float(re.search(rf"(\S+) {what}", said)[1]))  # type: ignore[index]
        for what in ("states, stored", "transitions")
    )
    tool = f"SPIN, {model.mode}"
    return Measured(tool, states, transitions, spent.seconds, spent.elapsed, spent.bytes)


def middle(found: list[Measured]) -> Measured:
    """Return the medians of several rounds of one tool."""
    one = found[0]
    seconds, elapsed = median(m.seconds for m in found), median(m.elapsed for m in found)
    busiest, most = median(m.busiest for m in found), max(m.bytes for m in found)
    return Measured(one.tool, one.states, one.transitions, seconds, elapsed, most, busiest)


def mpi_starts() -> bool:
    """Return whether two MPI processes can be started here; Open MPI rejects root by default."""
    if shutil.which("mpicc") is None or shutil.which("mpirun") is None:
        return False
    begun = subprocess.run([*launcher(Ranks(2)), "true"], capture_output=True, check=False)
    return begun.returncode == 0


def measure(model: Model, count: int, memory: int, rounds: int, folder: Path) -> list[Measured]:
    """Explore a system by all tools, in turns."""
    program = build_fsmkit(model, count, folder)
    limit = ("--memory", str(memory))
    turns: list[Callable[[], Measured]] = [
        lambda: explore(program, "fsmkit", limit, folder),
        lambda: explore(program, "fsmkit, every step", (*limit, "--sleepless"), folder),
        lambda: explore(program, "fsmkit, two cores", (*limit, "--cores", "2"), folder),
        lambda: explore(program, "fsmkit, symbolic", (*limit, "--search", "symbolic"), folder),
    ]
    os.environ.update(OVERSUBSCRIBED)
    if mpi_starts():
        of_ranks = build_fsmkit(model, count, folder, Ranks(1))
        turns += [
            partial(
                explore, of_ranks, f"fsmkit, {n} by MPI", (*limit, "--ranks"), folder,
                tuple(launcher(Ranks(n))),
            )
            for n in (1, 2)
        ]  # fmt: skip
    if build_spin(model, count, folder):
        turns.append(lambda: explore_by_spin(model, count, folder))
    found = [[turn() for turn in turns] for _ in range(rounds)]
    return [middle(list(one)) for one in zip(*found, strict=True)]


def table_of(found: list[Measured]) -> Table:
    """Return the figures side by side."""
    table = Table()
    heads = "tool", "states", "transitions", "CPU s", "clock s", "M states/s", "MB", "bytes a state"
    for head in heads:
        table.add_column(head, justify="left" if head == "tool" else "right")
    for one in found:
        table.add_row(
            one.tool,
            f"{one.states:,}",
            f"{one.transitions:,}",
            f"{one.seconds:.2f}",
            f"{one.elapsed:.2f}",
            f"{one.rate / 1e6:.2f}",
            f"{one.bytes / 1e6:,.0f}",
            f"{one.bytes_a_state:.1f}",
        )
    return table


@click.command(help="Explore two systems here and with SPIN, and compare.")
@click.option("--count", default=8, show_default=True, help="philosophers")
@click.option("--memory", default=16 << 30, help="bytes")
@click.option("--rounds", default=1, show_default=True, help="of which the medians are shown")
def main(count: int, memory: int, rounds: int) -> None:
    """Print the tables and the ratios."""
    console = Console(width=120)
    for model in MODELS:
        machines = count if model.name == "philosophers" else 8
        with tempfile.TemporaryDirectory() as name:
            found = measure(model, machines, memory, rounds, Path(name))
        ours, every, two, *_ = found
        spin = [one for one in found if one.tool.startswith("SPIN")]
        if not any("by MPI" in one.tool for one in found):
            console.print("left out: MPI is not installed, or does not start processes here")
        console.print(f"{model.name}, {machines}")
        console.print(table_of(found))
        line = f"two cores are {ours.elapsed / two.elapsed:.2f} times as fast as one by the clock"
        if two.busiest:
            line += f", {ours.seconds / two.busiest:.2f} times by the busier thread"
        console.print(line)
        if not spin:
            console.print("SPIN is not installed: `make tools` installs it")
            continue
        rate, memory_used = spin[0].rate, spin[0].bytes_a_state
        console.print(
            f"{ours.rate / rate:.1f} times the rate of SPIN; {every.rate / rate:.1f} if every step "
            "is taken"
        )
        console.print(f"{ours.bytes_a_state / memory_used:.3f} of the memory a state of SPIN")


if __name__ == "__main__":
    main()
