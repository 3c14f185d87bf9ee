"""``fsmkit export``: write the explored model in the notations of other tools."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import click

from fsmkit.cli.common.console import out, print_json, progress, report
from fsmkit.cli.common.interrupts import start_time
from fsmkit.cli.common.options import (
    REPLACE,
    SILENT,
    TIMEOUT,
    OneOf,
    Reading,
    path_option,
    reading_options,
)
from fsmkit.cli.common.spin import show_trail
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.export.exporter import (
    ExportedModel,
    Exporter,
    ExportOptions,
    RefinementExporter,
    export_deadline,
)
from fsmkit.plugins import plugin, plugins
from fsmkit.system.any_file import load_any, read_chart
from fsmkit.verify.explore import with_properties
from fsmkit.verify.resources.deadline import Deadline, Stage

EPILOG = """\b
Examples:
  fsmkit export fischer.yaml --to aut --time discrete --out fischer.aut
  fsmkit export gate.yaml --to dot | dot -Tsvg > gate.svg
  fsmkit export rotator.yaml --to cspm --refines module.scxml --out rotator.csp
  fsmkit export ring.yaml --to promela --replay-trail ring.pml
"""


@verb(EPILOG, Model=("time", "silent", "replacing", "parameters", "base"))
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--to",
    "notation",
    required=True,
    type=OneOf("notation", [found.name for found in plugins(Exporter)]),
    help="Write this notation (required).",
)
@path_option(
    "-o",
    "--out",
    "path",
    help="Write this file instead of printing.",
)
@click.option(
    "--time",
    type=OneOf("kind of time", ("discrete", "untimed")),
    default="discrete",
    show_default=True,
    help="Choose ticks, or timers in any order.",
)
@SILENT
@click.option(
    "--property",
    "names",
    multiple=True,
    metavar="NAME",
    help="Export only this property; repeatable.",
)
@REPLACE
@click.option(
    "--max-states",
    type=click.IntRange(1),
    default=1_000_000,
    show_default=True,
    help="Write nothing beyond this many states (UPPAAL: locations).",
)
@TIMEOUT
@path_option(
    "--refines",
    "base",
    metavar="BASE",
    help="Write the question whether FILE refines this chart (cspm, untimed).",
)
@path_option(
    "--replay-trail",
    "model",
    metavar="MODEL",
    help="Replay SPIN's trail of an exported model (x.pml beside x.pml.trail).",
)
@path_option(
    "--save-trace",
    metavar="FOLDER",
    help="Save the trace of --replay-trail into this folder.",
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
    max_states: int,
    timeout: float,
    base: Path | None,
    model: Path | None,
    save_trace: Path | None,
    as_json: bool,
    reading: Reading,
) -> int:
    """Export a chart or a system for another checker.

    The model is the complete one that `check` explores; otherwise nothing is written.
    """
    if silent and time != "untimed":
        raise click.UsageError("--assume-watchdogs-silent needs --time untimed")
    deadline = Deadline(timeout, start_time())
    findings = reading.findings()
    exporter = plugin(Exporter, notation)
    write: Callable[[ExportOptions], ExportedModel]
    if save_trace is not None and model is None:
        raise click.UsageError("--save-trace goes with --replay-trail")
    if model is not None and (base is not None or path is not None or notation != "promela"):
        raise click.UsageError("--replay-trail goes with --to promela, without --refines and --out")
    if base is not None and (names or replacing):
        raise click.UsageError("--refines goes with neither --property nor --replace")
    if base is not None and not isinstance(exporter, RefinementExporter):
        known = ", ".join(found.name for found in plugins(RefinementExporter))
        raise click.UsageError(f"--refines needs --to {known}")
    with export_deadline(deadline), deadline.stage(Stage.READING):
        if base is not None and isinstance(exporter, RefinementExporter):
            derived, extended = (
                read_chart(path, findings, strict=reading.strict) for path in (file, base)
            )
            name, write = derived.name, partial(exporter.export_refinement, derived, extended)
        else:
            whole = load_any(
                file, findings, replacing, strict=reading.strict, parameters=reading.parameters
            )
            loaded = with_properties(whole, frozenset(names))
            if model is not None:
                trail = ExportOptions(time == "untimed", silent, deadline=deadline)
                return show_trail(loaded, trail, file, model, save_trace, as_json_=as_json)
            name, write = loaded.name, partial(exporter.export, loaded)
    with progress(f"exploring {name}", is_quiet=as_json) as show:

        def report_progress(states: int, transitions: int) -> None:
            show(f"exploring {name}: {states:,} states, {transitions:,} transitions")

        wanted = ExportOptions(
            time == "untimed", silent, max_states, deadline, report_progress, findings
        )
        with export_deadline(deadline), deadline.stage(Stage.EXPLORING):
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
