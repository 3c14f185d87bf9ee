"""``fsmkit compile``: machines in C, Python, or for a library."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, replace
from pathlib import Path

import click
from rich.markup import escape

from fsmkit.chart.chart import Chart
from fsmkit.cli._options import OneOf, Reading, reading_options
from fsmkit.cli.console import out, print_json, report
from fsmkit.cli.writing import write_files
from fsmkit.codegen.system.glue import compose
from fsmkit.codegen.system.node import Node
from fsmkit.codegen.system.nodes import compose_node, nodes_of
from fsmkit.codegen.system.parts import named_charts
from fsmkit.diagnostics import Findings, FsmkitError, fail
from fsmkit.diagnostics.as_json import as_json
from fsmkit.loading import load_with_findings
from fsmkit.plugins import Generated, Target, plugin, plugins
from fsmkit.system.deployment import is_deployment_file, load_deployment
from fsmkit.system.links import without_channels
from fsmkit.system.reader import is_system_file, load_system
from fsmkit.system.system import System
from fsmkit.verify.bounds import Proved, noted, proved
from fsmkit.verify.explore import ExplorationOptions
from fsmkit.verify.replay import load_any

EPILOG = """\b
Examples:
  fsmkit compile feeder.yaml
  fsmkit compile feeder.scxml --target python --out generated
  fsmkit compile cell.yaml --out generated
  fsmkit compile deployment.yaml --out generated
  fsmkit compile feeder.yaml --bounds from-check --system cell.yaml
"""


@click.command(epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "-t",
    "--target",
    "name",
    type=OneOf("target", [found.name for found in plugins(Target)]),
    default="c",
    show_default=True,
    help="What to write; see `fsmkit targets`.",
)
@click.option(
    "-o",
    "--out",
    "folder",
    type=click.Path(path_type=Path),
    default="generated",
    show_default=True,
    help="The folder to write to.",
)
@click.option("--prefix", help="Begin the names with this, not with the name of the chart.")
@click.option("--trace", is_flag=True, help="Python: the machine can tell each step it takes.")
@click.option("--no-build", is_flag=True, help="pyext: write the sources, build nothing.")
@click.option("--with", "extras", help="Add parts, with commas: save; for C also trace.")
@click.option(
    "--optimize", type=OneOf("aim", ("speed", "size")), help="C: make the code fast, or small."
)
@click.option("--without", help="C: leave out parts, with commas: queue, counters.")
@click.option(
    "--bounds",
    type=OneOf("kind of bounds", ("from-chart", "from-check")),
    default="from-chart",
    show_default=True,
    help="C: the capacities of the chart, or as little as a check proves to be enough.",
)
@click.option(
    "--system",
    "system_file",
    type=click.Path(path_type=Path),
    help="With --bounds from-check: the system in which a chart runs; else it is checked alone.",
)
@click.option(
    "--time",
    "time_mode",
    type=OneOf("kind of time", ("zones", "discrete", "untimed")),
    default="zones",
    show_default=True,
    help="With --bounds from-check: how time passes in that check.",
)
@click.option("--json", "as_json_document", is_flag=True, help="Print one JSON document.")
@reading_options
def command(
    file: Path,
    name: str,
    folder: Path,
    prefix: str | None,
    trace: bool,
    no_build: bool,
    extras: str | None,
    optimize: str | None,
    without: str | None,
    bounds: str,
    system_file: Path | None,
    time_mode: str,
    as_json_document: bool,
    reading: Reading,
) -> int:
    """Write the machine of a chart; or all machines of a system, in C with what connects them.

    Of a deployment: a folder for each node, in C with its links to the others, and `links.json`.

    Prints the files, what the machine takes, and its capacities. Either all files are written or
    none.
    """
    target = plugin(Target, name)
    findings = reading.findings()
    strict, deployment = reading.strict, None
    if is_deployment_file(file):
        deployment = load_deployment(file, findings, strict=strict)
    if deployment is not None:
        whole: System | None = deployment.system
    else:
        whole = load_system(file, findings, strict=strict) if is_system_file(file) else None
    proof = None
    if bounds == "from-check":
        if name != "c":
            raise click.UsageError("--bounds is for the target c")
        checked = whole or load_any(system_file or file, findings, strict=strict)
        proof = proved(checked, Findings(), manner_of(time_mode))
        if whole is not None:
            whole = with_bounds(whole, proof)
    elif system_file is not None:
        raise click.UsageError("--system is for --bounds from-check")
    system = None if whole is None else without_channels(whole)
    is_joined = system is not None and name == "c"
    if system is None:
        chart = load_with_findings(file, findings, strict=strict)
        charts: tuple[Chart, ...] = (chart if proof is None else bounded(chart, proof),)
    else:
        charts = named_charts(system, is_joined=is_joined)
    if prefix is not None and system is not None:
        raise click.UsageError("--prefix names one machine; a system has several")
    if is_joined and "queue" in (without or "").split(","):
        raise click.UsageError("the machines of a system need their queues")
    if prefix is not None and not re.fullmatch(r"[A-Za-z]\w*", prefix, re.ASCII):
        raise click.UsageError(f"--prefix `{prefix}` is no identifier")
    for option, is_given, wanted in (
        ("--trace", trace, ("python", "pyext")),
        ("--no-build", no_build, ("pyext",)),
        ("--with", extras is not None, ("c", "python", "pyext")),
        ("--optimize", optimize is not None, ("c",)),
        ("--without", without is not None, ("c",)),
    ):
        if is_given and name not in wanted:
            raise click.UsageError(f"{option} is for the target {' and '.join(wanted)}")
    options = {} if prefix is None else {"prefix": prefix}
    if trace:
        options["trace"] = "on"
    if extras is not None:
        options["with"] = extras
    if not no_build:
        options["build"] = "on"
    if optimize is not None:
        options["optimize"] = optimize
    if without is not None:
        options["without"] = without
    if system is None or deployment is None:
        generated, united_files = _program(
            charts, system if is_joined else None, target, options, proof, findings
        )
    else:
        generated, united_files = [], {"links.json": deployment.map.as_json()}
        for node in nodes_of(replace(deployment, system=system)):
            machines, texts = _program(
                node.charts, node if is_joined else None, target, options, proof, findings
            )
            generated += machines
            united_files |= {f"{node.name}/{path}": text for path, text in texts.items()}
    files = {folder / path: content for path, content in united_files.items()}
    write_files(files)
    report(findings)
    if as_json_document:
        print_json(document(tuple(files), generated, findings))
    else:
        for path in files:
            out.print(escape(str(path)))
        for chart, made in generated:
            out.print(escape(told(chart, made)))
    return 0


def _program(
    charts: tuple[Chart, ...],
    joined: System | Node | None,
    target: Target,
    options: Mapping[str, str],
    proof: Proved | None,
    findings: Findings,
) -> tuple[list[tuple[Chart, Generated]], dict[str, str | bytes]]:
    """Return the machines of a program, and its files; ``joined``: what joins them in C."""
    generated = []
    for chart in different(charts):
        made = target.generate(chart, findings, options)
        if made is not None:
            generated.append((chart, made if proof is None else with_note(made, proof)))
    if len(generated) < len(different(charts)) or findings.has_errors:
        raise FsmkitError(findings)
    parts = [made for _, made in generated]
    texts = {path: text for made in parts for path, text in made.files.items()}
    if isinstance(joined, System):
        parts.append(Generated(compose(joined, charts, texts, findings), {}))
    elif joined is not None:
        parts.append(Generated(compose_node(joined, texts), {}))
    return generated, united(parts)


def manner_of(time_mode: str) -> ExplorationOptions:
    """Return how a system is explored."""
    return ExplorationOptions(untimed=time_mode == "untimed", zones=time_mode == "zones")


def bounded(chart: Chart, proof: Proved) -> Chart:
    """Return a chart with the capacities that were proved for it."""
    found = proof.of(chart)
    if found is None:
        raise fail(
            "bounds-not-proved",
            f"no machine of that system runs `{chart.name}` as it is in this file",
            help="name a system that does, or compile the system itself",
        )
    return found


def with_bounds(system: System, proof: Proved) -> System:
    """Return a system whose charts have the capacities that were proved."""
    machines = tuple(
        replace(machine, chart=proof.of(machine.chart) or machine.chart)
        for machine in system.machines
    )
    return replace(system, machines=machines)


def with_note(made: Generated, proof: Proved) -> Generated:
    """Return what was made with a word on the proof in its headers."""
    return replace(made, files={n: noted(t, proof.assumed) for n, t in made.files.items()})


def different(charts: tuple[Chart, ...]) -> list[Chart]:
    """Return each chart once."""
    return [chart for place, chart in enumerate(charts) if chart not in charts[:place]]


def united(generated: Iterable[Generated]) -> dict[str, str | bytes]:
    """Return the files of several machines; what they share is there once."""
    files: dict[str, str | bytes] = {}
    for made in generated:
        contents: dict[str, str | bytes] = {**made.files, **made.built}
        for path, content in contents.items():
            if files.setdefault(path, content) != content:
                raise fail(
                    "duplicate-output",
                    f"two machines would be written to `{path}`",
                    help="give the charts different names",
                )
    return files


def told(chart: Chart, made: Generated) -> str:
    """Return a line on the size and the bounds of a machine."""
    figures = ", ".join(f"{name.replace('_', ' ')} {n}" for name, n in made.figures.items())
    return f"{chart.name}: {figures}"


def capacities(chart: Chart, made: Generated) -> dict[str, int]:
    """Return the bounds of a machine: those of its chart, and what the target says of them."""
    bounds = {**asdict(chart.capacities), **made.figures}
    bounds.pop("struct_bytes", None)
    return bounds


def document(
    files: tuple[Path, ...], generated: list[tuple[Chart, Generated]], findings: Findings
) -> dict[str, object]:
    """Return what ``--json`` prints; of a system also each machine by name."""
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
