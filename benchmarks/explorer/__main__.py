"""Measure: ``python -m benchmarks.explorer [--count N]``.

Both tools explore the dining philosophers and a token ring exhaustively, with all reductions off,
on one core, compiled by the same compiler with the same flags. Processor seconds and the largest
resident size are those of the whole process, as the system accounts for them. SPIN runs in its
fastest exhaustive mode for each system: depth first for the philosophers, breadth first for the
ring. Where it is not installed, its rows are missing.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import tempfile
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from fsmkit.diagnostics import Findings
from fsmkit.verify.closed import close
from fsmkit.verify.engine import CEngine, compiler
from fsmkit.verify.reader import load_system

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
    with: {{ME: i, NEXT: (i + 1) % {count}, FIRST: "i % 3 == 0 ? 2 : 0"}}
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
    """What one tool took: seconds of processor time, and bytes of memory at most."""

    tool: str
    states: int
    transitions: int
    seconds: float
    bytes: int

    @property
    def rate(self) -> float:
        """States a second."""
        return self.states / self.seconds

    @property
    def bytes_a_state(self) -> float:
        """All memory of the process, for each state."""
        return self.bytes / self.states


def run(command: list[str], folder: Path) -> tuple[str, float, int]:
    """Return what a program printed, its processor seconds, and its largest resident size."""
    with (folder / "said").open("w+") as said:
        process = subprocess.Popen(command, stdout=said, cwd=folder)
        _, status, usage = os.wait4(process.pid, 0)
        if status:
            raise click.ClickException(f"{command[0]} ended with status {status}")
        said.seek(0)
        return said.read(), usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024


def measure_fsmkit(model: Model, count: int, memory: int, folder: Path) -> Measured:
    """Explore a system here."""
    file = folder / f"{model.name}.yaml"
    system = model.system.format(count=count, last=count - 1, chart=HERE / model.chart)
    file.write_text(system, encoding="utf-8")
    findings = Findings()
    with closing(CEngine(close(load_system(file, findings)), findings)) as engine:
        said, seconds, most = run([str(engine.program), "--memory", str(memory)], folder)
    told = json.loads(said.splitlines()[-1])["result"]
    if told["outcome"] != "complete":
        raise click.ClickException(f"the exploration ended early: {told['outcome']}")
    return Measured("fsmkit", told["states"], told["transitions"], seconds, most)


def measure_spin(model: Model, count: int, folder: Path) -> Measured | None:
    """Explore a system with SPIN; None where there is none."""
    spin, gcc = shutil.which("spin"), compiler()
    if spin is None or gcc is None:
        return None
    copy = shutil.copy(HERE / model.promela, folder)
    subprocess.run([spin, "-a", f"-DN={count}", copy], cwd=folder, check=True)
    flags = ["-std=gnu99", "-O2", "-w", "-DSAFETY", "-DNOREDUCE", "-DMEMLIM=16000", *model.defines]
    subprocess.run([gcc, *flags, "pan.c", "-o", "pan"], cwd=folder, check=True)
    said, seconds, most = run(["./pan", "-m20000000", f"-w{16 + count}"], folder)
    if "error: max search depth" in said or "aborted" in said:
        raise click.ClickException("SPIN ended early")
    states, transitions = (
        round(float(re.search(rf"(\S+) {what}", said)[1]))  # type: ignore[index]
        for what in ("states, stored", "transitions")
    )
    return Measured(f"SPIN, {model.mode}", states, transitions, seconds, most)


def table_of(found: list[Measured]) -> Table:
    """Return the figures side by side."""
    table = Table()
    for head in ("tool", "states", "transitions", "CPU s", "M states/s", "bytes a state"):
        table.add_column(head, justify="left" if head == "tool" else "right")
    for one in found:
        table.add_row(
            one.tool,
            f"{one.states:,}",
            f"{one.transitions:,}",
            f"{one.seconds:.2f}",
            f"{one.rate / 1e6:.2f}",
            f"{one.bytes_a_state:.1f}",
        )
    return table


@click.command(help="Explore two systems here and with SPIN, and compare.")
@click.option("--count", default=8, show_default=True, help="philosophers")
@click.option("--memory", default=16 << 30, help="bytes")
def main(count: int, memory: int) -> None:
    """Print the tables and the ratios."""
    console = Console()
    for model in MODELS:
        machines = count if model.name == "philosophers" else 8
        with tempfile.TemporaryDirectory() as name:
            ours = measure_fsmkit(model, machines, memory, Path(name))
            spin = measure_spin(model, machines, Path(name))
        console.print(f"{model.name}, {machines}")
        console.print(table_of([one for one in (ours, spin) if one is not None]))
        if spin is None:
            console.print("SPIN is not installed: `make tools` installs it")
            continue
        console.print(f"{ours.rate / spin.rate:.1f} times the rate of SPIN")
        console.print(
            f"{ours.bytes_a_state / spin.bytes_a_state:.3f} of the memory a state of SPIN"
        )


if __name__ == "__main__":
    main()
