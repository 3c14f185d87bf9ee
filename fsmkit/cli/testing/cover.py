"""``fsmkit cover``: tests that take every transition and enter every state."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click
from rich.markup import escape

from fsmkit.cli.common.console import out, print_json, report, result
from fsmkit.cli.common.exploring import MODEL, SEARCH, Exploring, exploring_options
from fsmkit.cli.common.interrupts import received
from fsmkit.cli.common.options import Reading, path_option, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.cli.proving.check import evaluate_file
from fsmkit.verify.report.document import document
from fsmkit.verify.report.verdict import Verdict
from fsmkit.verify.testgen.cover import cover, coverage_line
from fsmkit.verify.testgen.suites import compiled_charts, covering

EPILOG = """\b
Examples:
  fsmkit cover feeder.yaml --out tests/feeder
  fsmkit cover cell.yaml --out tests/cell --time untimed
"""


@verb(EPILOG, Model=MODEL, Search=SEARCH, Several_computers=("mpi", "hostfile"))
@click.argument("file", type=click.Path(path_type=Path))
@path_option(
    "-o",
    "--out",
    "folder",
    required=True,
    help="Write the tests into this folder (required).",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@exploring_options
@reading_options
def command(file: Path, folder: Path, as_json: bool, exploring: Exploring, reading: Reading) -> int:
    """Generate tests that reach every transition and state.

    Unreachable ones are omitted. Writes a pytest, a C program, and a page that lists what they
    cover; after an interrupt, nothing. Exit code 1: the exploration did not end.
    """
    system, found = evaluate_file(
        file,
        options=replace(exploring.options, covers=True),
        reading=reading,
        is_quiet=as_json,
        names=exploring.names,
        replacing=exploring.replacing,
        deadline=exploring.deadline,
    )
    if received():
        report(found.findings)
        return int(found.verdict is Verdict.UNDECIDED)
    charts = compiled_charts(system, found.closed.system) if system.machines else ()
    covered = cover(found)
    made = covering(folder, covered, file, charts)
    write_files(made)
    report(found.findings)
    if as_json:
        print_json(document(found))
    else:
        result.print(escape(coverage_line(covered)))
        for path in made:
            out.print(f"wrote {escape(str(path))}", style="dim")
    return int(found.verdict is Verdict.UNDECIDED)
