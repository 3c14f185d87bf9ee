"""``fsmkit compile``: machines in C, Python, or for a library."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TypeGuard

import click
from rich.markup import escape

from fsmkit.chart.chart import Chart
from fsmkit.cli.common.bindings import binding_file_of
from fsmkit.cli.common.console import out, print_json, report
from fsmkit.cli.common.garbage import without_garbage_collection
from fsmkit.cli.common.options import (
    OneOf,
    Reading,
    path_option,
    project_for,
    reading_options,
    value_or_default,
)
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.watching import watched
from fsmkit.cli.common.writing import write_files
from fsmkit.codegen.packages.plugin import KINDS
from fsmkit.codegen.system.files import packages, timing_of
from fsmkit.codegen.system.program import program_of
from fsmkit.codegen.target import Generated, Target
from fsmkit.diagnostics import Findings
from fsmkit.diagnostics.allow_comments import record_used
from fsmkit.diagnostics.as_json import as_json
from fsmkit.diagnostics.unused_comments import READING, report_unused_comments
from fsmkit.plugins import plugins
from fsmkit.system.any_file import Model, load_any, read_with_boards, sources_of
from fsmkit.system.board import Board
from fsmkit.system.system import System
from fsmkit.verify.resources.time import TIMES, Time

EPILOG = """\b
Examples:
  fsmkit compile feeder.yaml
  fsmkit compile feeder.scxml --target python --out generated
  fsmkit compile feeder.yaml --package arduino --out Feeder
  fsmkit compile cell.yaml --out generated
  fsmkit compile deployment.yaml --out generated
  fsmkit compile board_a.io.yaml --out generated/a
  fsmkit compile feeder.yaml --bounds from-check --system cell.yaml
  fsmkit compile charger.yaml --binding boards/charger.c.yaml
"""


@verb(
    EPILOG,
    Parts=("extras", "without", "optimize", "trace", "package", "binding", "fmi", "no_build"),
    Bounds=("bounds", "system_file", "time"),
    Model=("parameters",),
)
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "-t",
    "--target",
    type=OneOf("target", [found.name for found in plugins(Target)]),
    default="c",
    show_default=True,
    help="Write for this target; `fsmkit targets` lists them.",
)
@path_option(
    "-o",
    "--out",
    "folder",
    default="generated",
    show_default=True,
    help="Write into this folder.",
)
@click.option("--prefix", help="Prefix generated names (default: the chart's name).")
@click.option("--trace", is_flag=True, help="Let the machine report each step (python, pyext).")
@click.option(
    "--no-build", is_flag=True, help="Write the sources without building them (pyext, fmu)."
)
@click.option(
    "--fmi",
    type=OneOf("version of FMI", ("3.0", "2.0")),
    help="Write for this version of FMI (default 3.0).",
)
@click.option(
    "--with",
    "extras",
    help="Add parts, separated by commas: save, records, coverage, trace, world.",
)
@click.option(
    "--optimize",
    type=OneOf("aim", ("size",)),
    help="Write smaller, slower code (C).",
)
@click.option("--without", help="Omit parts, separated by commas: queue, counters (C).")
@click.option(
    "--bounds",
    type=OneOf("kind of bounds", ("from-chart", "from-check")),
    default="from-chart",
    show_default=True,
    help="Take capacities from the chart, or prove smaller ones (C).",
)
@path_option(
    "--system",
    "system_file",
    help="Prove the bounds within this system instead of for the chart alone.",
)
@click.option(
    "--time",
    type=OneOf("kind of time", TIMES),
    default="zones",
    show_default=True,
    help="Choose how time passes when bounds are proved.",
)
@click.option(
    "--package",
    type=OneOf("package", sorted((*KINDS, *packages()))),
    help="Write a library for this build system, with manifest and example (C).",
)
@click.option(
    "--binding",
    metavar="FILE|none",
    help="Use this binding to existing C (default: CHART.c.yaml beside the chart).",
)
@click.option("--json", "as_json_document", is_flag=True, help="Print one JSON document.")
@watched
@reading_options
@without_garbage_collection()
def command(
    file: Path,
    target: str,
    folder: Path,
    prefix: str | None,
    trace: bool,
    no_build: bool,
    fmi: str | None,
    package: str | None,
    extras: str | None,
    optimize: str | None,
    without: str | None,
    bounds: str,
    system_file: Path | None,
    time: Time,
    binding: str | None,
    as_json_document: bool,
    reading: Reading,
) -> int:
    """Generate the code of a chart, a system or a deployment.

    For a system, generates the machines in C and the code that connects them; for a deployment, a
    folder for each node and `links.json`; for a board, the code of its wires. Prints the files,
    the size of a machine and its capacities. All files are written, or none.
    """
    project, context = project_for((file,)), click.get_current_context()
    if project is not None:
        target = value_or_default(context, "target", target, project.compile.get("target"))
        out_folder = project.compile.get("out")
        place = None if out_folder is None else str(project.path.parent / out_folder)
        folder = value_or_default(context, "folder", folder, place)
    if package is not None:
        if target != "c":
            raise click.UsageError("--package is for the target c")
        target = "package"
    built = [found.name for found in plugins(Target) if "build" in found.options]
    is_built = target in built
    if no_build and not is_built:
        raise click.UsageError(f"--no-build is for the targets {' and '.join(built)}")
    findings = reading.findings()
    with record_used() as used:
        model = read_with_boards(
            file, findings, strict=reading.strict, parameters=reading.parameters
        )
    report_unused_comments(sources_of(model), used, READING, findings)
    options = {
        name: value
        for name, value in (
            ("prefix", prefix),
            ("trace", "on" if trace else None),
            ("with", extras),
            ("build", "on" if is_built and not no_build else None),
            ("fmi", fmi),
            ("package", package),
            ("optimize", optimize),
            ("without", without),
            ("binding", binding_file_of(file, binding, model, target)),
        )
        if value is not None
    }
    if bounds == "from-check" and _is_model(model):
        from fsmkit.verify.bounds import proved_program  # all of the explorer

        within = load_any(system_file, findings, strict=reading.strict) if system_file else None
        made = proved_program(model, target, findings, options, within=within, time=time)
    elif system_file is not None:
        raise click.UsageError("--system is for --bounds from-check")
    else:
        made = program_of(model, target, findings, options)
    files = {folder / path: content for path, content in made.files.items()}
    write_files(files, folder)
    report(findings)
    lines, figures = _timing(model)
    if as_json_document:
        found = document(tuple(files), made.machines, findings)
        print_json({**found, **figures})
    else:
        for path in files:
            out.print(escape(str(path)))
        for chart, generated in made.machines:
            out.print(escape(size_line(chart, generated)))
        for line in lines:
            out.print(escape(line))
    return 0


def _timing(model: Model | Board) -> tuple[list[str], dict[str, object]]:
    """Return the latencies of messages, as lines and as data; empty for other models."""
    if isinstance(model, Chart | System | Board):
        return [], {}
    lines: list[str] = []
    figures: dict[str, object] = {}
    for carrier in timing_of(model):
        lines += carrier.timing_lines(model)
        figures |= carrier.timing_figures(model)
    return lines, figures


def _is_model(model: Model | Board) -> TypeGuard[Model]:
    return not isinstance(model, Board)


def size_line(chart: Chart, made: Generated) -> str:
    """Return a line on the size and the bounds of a machine."""
    figures = ", ".join(f"{name.replace('_', ' ')} {n}" for name, n in made.figures.items())
    return f"{chart.name}: {figures}"


def capacities(chart: Chart, made: Generated) -> dict[str, int]:
    """Return the bounds of a machine, from its chart and from the target."""
    bounds = {**asdict(chart.capacities), **made.figures}
    bounds.pop("struct_bytes", None)
    return bounds


def document(
    files: tuple[Path, ...], generated: tuple[tuple[Chart, Generated], ...], findings: Findings
) -> dict[str, object]:
    """Return the JSON document; for a system with each machine by name."""
    each = [
        {
            "name": chart.name,
            "struct_bytes": made.figures.get("struct_bytes"),
            "capacities": capacities(chart, made),
        }
        for chart, made in generated
    ]
    sizes = [made.figures.get("struct_bytes") for _, made in generated]
    known = [size for size in sizes if size is not None]
    return {
        "files": [str(path) for path in files],
        "struct_bytes": sum(known) if len(known) == len(sizes) else None,
        "capacities": capacities(*generated[0]) if len(generated) == 1 else {},
        "machines": each,
        "findings": [as_json(finding) for finding in findings],
    }
