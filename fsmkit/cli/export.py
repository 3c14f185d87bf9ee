"""``fsmkit export``: what is explored, in the notations of other tools."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import click
from rich.progress import Progress, SpinnerColumn, TextColumn

from fsmkit.cli._quantities import read_span
from fsmkit.cli.console import err, out, print_json, report
from fsmkit.cli.writing import write_files
from fsmkit.diagnostics import Findings
from fsmkit.verify.closed import close
from fsmkit.verify.export import aldebaran, dot
from fsmkit.verify.export.transition_system import TransitionSystem, explored
from fsmkit.verify.replay import load_any

NOTATIONS: Mapping[str, Callable[[TransitionSystem], Iterator[str]]] = {
    "aut": aldebaran.written,
    "dot": dot.written,
}
EPILOG = """\b
Examples:
  fsmkit export fischer.yaml --to aut --time discrete --out fischer.aut
  fsmkit export gate.yaml --to dot | dot -Tsvg > gate.svg
"""


@click.command(epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--to", "notation", required=True, type=click.Choice(list(NOTATIONS)))
@click.option("--out", "path", type=click.Path(path_type=Path), help="The file.  [default: print]")
@click.option(
    "--time",
    "time_mode",
    type=click.Choice(["discrete", "untimed"]),
    default="discrete",
    show_default=True,
    help="Discrete: time passes by the greatest common divisor of all delays. Untimed: an armed "
    "timer may fire at any time.",
)
@click.option(
    "--most", type=click.IntRange(1), default=1_000_000, show_default=True, help="States to write."
)
@click.option("--timeout", callback=read_span, default="0", help="Give up after that long.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def command(
    file: Path,
    notation: str,
    path: Path | None,
    time_mode: str,
    most: int,
    timeout: float,
    as_json: bool,
) -> int:
    """Write the transition system of a chart or a system.

    aut: Aldebaran, for mCRL2 and CADP. dot: Graphviz. It is explored by the interpreter, whole, or
    nothing is written.
    """
    findings = Findings()
    closed = close(load_any(file, findings), untimed=time_mode == "untimed")
    with Progress(
        SpinnerColumn(),
        TextColumn("{task.description}"),
        console=err,
        transient=True,
        disable=not err.is_terminal or as_json,
    ) as bar:
        task = bar.add_task(f"exploring {closed.system.name}")

        def progress(states: int, transitions: int) -> None:
            told = f"{states:,} states, {transitions:,} transitions"
            bar.update(task, description=f"exploring {closed.system.name}: {told}")

        system = explored(closed, most=most, seconds=timeout, progress=progress)
    text = "".join(NOTATIONS[notation](system))
    report(findings)
    figures = {"states": system.states, "transitions": len(system.arrows)}
    if path is not None:
        write_files({path: text})
    if as_json:
        print_json({**figures, **({"file": str(path)} if path else {notation: text})})
    elif path is None:
        sys.stdout.write(text)
    else:
        out.print(f"wrote {path}: {system.states:,} states, {len(system.arrows):,} transitions")
    return 0
