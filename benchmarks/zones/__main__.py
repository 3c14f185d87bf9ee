"""Measure: ``python -m benchmarks.zones [--seconds N] [--model NAME]``.

Models of the literature in dense time, with increasing numbers of processes: the charts under
``machines/`` by the explorer, and the networks of the literature (`networks`) by a simple zone
search in Python (`search`). Fischer's chart equals its network step by step, so the counts are
equal. In the other charts, queued messages and expiring timers are separate steps, so they have
more states than the networks. Processor seconds are those of the search alone. Each tool continues
with one process more until a run exceeds the limit.
"""

from __future__ import annotations

import json
import shutil
import tempfile
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from benchmarks.explorer.__main__ import run
from benchmarks.zones import networks
from benchmarks.zones.search import Network, search
from fsmkit.diagnostics import Findings
from fsmkit.system.system_file import load_system
from fsmkit.verify.engines.c.engine import CEngine
from fsmkit.verify.statespace.closed_system import close

MACHINES = Path(__file__).parents[2] / "machines"
MEMORY = 4 << 30


@dataclass(frozen=True, slots=True)
class Model:
    """A model in both forms; ``least`` and ``most`` processes are measured."""

    name: str
    file: str
    network: Callable[[int], Network]
    least: int
    most: int


MODELS = (
    Model("Fischer", "fischer/fischer.yaml", networks.fischer, 2, 12),
    Model("CSMA/CD", "csma_cd/csma_cd.yaml", networks.csma_cd, 2, 10),
    Model("FDDI", "fddi/fddi.yaml", networks.fddi, 2, 9),
    Model("train gate", "train_gate/train_gate.yaml", networks.train_gate, 2, 8),
)


@dataclass(frozen=True, slots=True)
class Measured:
    """States, zones, steps, processor seconds and bytes (0: not measured) of one search."""

    states: int
    zones: int
    steps: int
    seconds: float
    bytes: int = 0


def by_python(network: Network) -> Measured:
    """Search a network in this process."""
    begin = time.process_time()
    found = search(network)
    return Measured(found.discrete, found.zones, found.steps, time.process_time() - begin)


def by_explorer(file: str, count: int, folder: Path) -> Measured:
    """Explore the charts with so many processes, everything, without a look for livelocks."""
    findings = Findings()
    system = load_system(MACHINES / file, findings, parameters={"N": str(count)})
    with closing(CEngine(close(system, zones=True), findings)) as engine:
        program = Path(shutil.copy(engine.program, folder / "explorer"))
    said, spent = run([str(program), "--memory", str(MEMORY)], folder)
    told = json.loads(said.splitlines()[-1])["result"]
    if told["outcome"] != "complete":
        raise click.ClickException(f"the exploration ended early: {told['outcome']}")
    return Measured(told["states"], told["zones"], told["transitions"], spent.seconds, spent.bytes)


def measure(model: Model, limit: float) -> Table:
    """Return the figures of a model with more and more processes, until a run takes too long."""
    table = Table(title=model.name)
    for head in (
        "N",
        "states",
        "zones",
        "CPU s",
        "MB",
        "states by hand",
        "zones",
        "CPU s",
        "ratio",
    ):
        table.add_column(head, justify="right")
    ours = reference = Measured(0, 0, 0, 0.0)
    for count in range(model.least, model.most + 1):
        is_fast, is_fast_by_hand = ours.seconds < limit, reference.seconds < limit
        if not is_fast and not is_fast_by_hand:
            break
        cells = [str(count)]
        if is_fast:
            with tempfile.TemporaryDirectory() as name:
                ours = by_explorer(model.file, count, Path(name))
            cells += [f"{ours.states:,}", f"{ours.zones:,}", f"{ours.seconds:.2f}"]
            cells += [f"{ours.bytes / 1e6:,.0f}"]
        else:
            cells += [""] * 4
        if is_fast_by_hand:
            reference = by_python(model.network(count))
            cells += [f"{reference.states:,}", f"{reference.zones:,}", f"{reference.seconds:.2f}"]
            cells += [f"{reference.seconds / ours.seconds:.0f}"] if is_fast and ours.seconds else []
        table.add_row(*cells)
    return table


@click.command(help="Explore models of the literature in dense time, and compare.")
@click.option("--seconds", default=20.0, show_default=True, help="a run that is not exceeded")
@click.option("--model", "names", multiple=True, help="of the models only this one")
def main(seconds: float, names: tuple[str, ...]) -> None:
    """Print a table for each model."""
    console = Console(width=110)
    for model in MODELS:
        if not names or model.name in names:
            console.print(measure(model, seconds))


if __name__ == "__main__":
    main()
