"""``fsmkit simulate``: a chart or a system as one HTML file that simulates it."""

from __future__ import annotations

from pathlib import Path

import click

from fsmkit.cli.common.console import print_json, report, result
from fsmkit.cli.common.options import Reading, option_value, path_option, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.diagnostics import Severity
from fsmkit.system.any_file import read, system_within

EPILOG = """\b
Examples:
  fsmkit simulate gate.yaml --out gate.html
  fsmkit simulate cell.yaml --out cell.html --script steps.txt --script traces/Cell_P2.json
  fsmkit simulate gate.yaml --out gate.html --break 'count == 3'
  fsmkit simulate traces/Cell_P2.json --out violation.html
"""


@verb(EPILOG, Model=("parameters",))
@click.argument("file", type=click.Path(path_type=Path))
@path_option("-o", "--out", required=True, help="Write this HTML file.")
@path_option(
    "--script",
    "scripts",
    multiple=True,
    help="Add a scenario: script lines or a saved trace; repeatable.",
)
@click.option(
    "--break",
    "breaks",
    multiple=True,
    metavar="CONDITION",
    help="Stop when this condition becomes true; repeatable.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@reading_options
def command(
    file: Path,
    out: Path,
    scripts: tuple[Path, ...],
    breaks: tuple[str, ...],
    as_json: bool,
    reading: Reading,
) -> int:
    """Write an HTML file that simulates a chart or a system.

    The file needs no server and no network. It draws the machines, posts events, steps back in
    time, stops at breakpoints, and saves the session as a script for `fsmkit run`.
    """
    findings = reading.findings()
    from fsmkit.inspector.bundle import simulating_page
    from fsmkit.inspector.scenarios import read_scenario
    from fsmkit.inspector.sources.counterexample import read_trace

    if file.suffix == ".json":
        recording, source = read_trace(file)
        system, scripts = recording.system, (file, *scripts)
    else:
        system, source = system_within(read(file, findings, strict=reading.strict)), file
    report(finding for finding in findings if finding.severity is not Severity.NOTE)
    scenarios = [read_scenario(system, path) for path in scripts]
    with option_value():
        page = simulating_page(system, file=source.name, conditions=breaks, scenarios=scenarios)
    write_files({out: page.text})
    if as_json:
        figures = {"machines": len(system.machines), "scenarios": len(scenarios)}
        print_json({"name": system.name, "file": str(out), **figures, "bytes": len(page.text)})
    else:
        result.print(str(out), markup=False, soft_wrap=True)
    return 0
