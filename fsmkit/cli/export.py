"""``fsmkit export``: what is explored, in the notations of other tools."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import click

from fsmkit.cli.common.console import out, print_json, progress, report
from fsmkit.cli.common.interrupts import began
from fsmkit.cli.common.options import (
    REPLACE,
    SILENT,
    TIMEOUT,
    OneOf,
    Reading,
    path_option,
    reading_options,
)
from fsmkit.cli.common.writing import write_files
from fsmkit.export.exporter import (
    Exported,
    Exporter,
    ExportOptions,
    RefinementExporter,
    given_up_at,
)
from fsmkit.plugins import plugin, plugins
from fsmkit.system.any_file import load_any, read_chart
from fsmkit.verify.explore import asking_only
from fsmkit.verify.resources.deadline import Deadline, Stage

EPILOG = """\b
Examples:
  fsmkit export fischer.yaml --to aut --time discrete --out fischer.aut
  fsmkit export gate.yaml --to dot | dot -Tsvg > gate.svg
  fsmkit export rotator.yaml --to cspm --refines module.scxml --out rotator.csp
"""


@click.command(epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--to",
    "notation",
    required=True,
    type=OneOf("notation", [found.name for found in plugins(Exporter)]),
)
@path_option("-o", "--out", "path", help="The file.  [default: print]")
@click.option(
    "--time",
    type=OneOf("kind of time", ("discrete", "untimed")),
    default="discrete",
    show_default=True,
    help="Discrete: time passes by the greatest common divisor of all delays. Untimed: an armed "
    "timer may fire at any time.",
)
@SILENT
@click.option(
    "--property", "names", multiple=True, help="Carry over this property only; can be repeated."
)
@REPLACE
@click.option(
    "--most",
    type=click.IntRange(1),
    default=1_000_000,
    show_default=True,
    help="Write nothing if there are more states (UPPAAL: locations) than this.",
)
@TIMEOUT
@path_option(
    "--refines", "base", help="Write, instead, whether the chart FILE refines this one (untimed)."
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@reading_options
def command(
    file: Path,
    notation: str,
    path: Path | None,
    time: str,
    silent: bool,
    names: tuple[str, ...],
    replacing: Mapping[str, Path],
    most: int,
    timeout: float,
    base: Path | None,
    as_json: bool,
    reading: Reading,
) -> int:
    """Write a chart or a system, closed as it is explored, for another tool.

    What is explored is explored whole, or nothing is written.
    """
    if silent and time != "untimed":
        raise click.UsageError("--assume-watchdogs-silent needs --time untimed")
    deadline = Deadline(timeout, began())
    findings = reading.findings()
    exporter = plugin(Exporter, notation)
    write: Callable[[ExportOptions], Exported]
    if base is not None and (names or replacing):
        raise click.UsageError("--refines goes with neither --property nor --replace")
    if base is not None and not isinstance(exporter, RefinementExporter):
        known = ", ".join(found.name for found in plugins(RefinementExporter))
        raise click.UsageError(f"--refines needs --to {known}")
    with given_up_at(deadline), deadline.stage(Stage.READING):
        if base is not None and isinstance(exporter, RefinementExporter):
            derived, extended = (
                read_chart(path, findings, strict=reading.strict) for path in (file, base)
            )
            name, write = derived.name, partial(exporter.export_refinement, derived, extended)
        else:
            whole = load_any(
                file, findings, replacing, strict=reading.strict, parameters=reading.parameters
            )
            loaded = asking_only(whole, frozenset(names))
            name, write = loaded.name, partial(exporter.export, loaded)
    with progress(f"exploring {name}", is_quiet=as_json) as show:

        def tell(states: int, transitions: int) -> None:
            show(f"exploring {name}: {states:,} states, {transitions:,} transitions")

        wanted = ExportOptions(time == "untimed", silent, most, deadline, tell, findings)
        with given_up_at(deadline), deadline.stage(Stage.EXPLORING):
            found = write(wanted)
    report(findings)
    if path is not None:
        write_files({path: found.text})
    if as_json:
        print_json({**found.figures, **({"file": str(path)} if path else {notation: found.text})})
    elif path is None:
        sys.stdout.write(found.text)
    else:
        figures = ", ".join(f"{number:,} {what}" for what, number in found.figures.items())
        out.print(f"wrote {path}: {figures}")
    return 0
