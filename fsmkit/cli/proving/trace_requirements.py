"""``fsmkit trace-requirements``: the matrix from requirements to properties, tests and evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click
from rich.table import Table
from rich.text import Text

from fsmkit.chart.chart import Chart
from fsmkit.cli.common.console import out, print_json, report, result
from fsmkit.cli.common.exploring import MODEL, SEARCH, Exploring, exploring_options
from fsmkit.cli.common.options import Reading, path_option, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.cli.proving.check import evaluate_file
from fsmkit.cli.testing.test import suite_files
from fsmkit.diagnostics import Findings
from fsmkit.diagnostics.as_json import as_json as finding_as_json
from fsmkit.system.any_file import load_any
from fsmkit.system.system import System
from fsmkit.testing.coverage.record import ChartCoverage, Recorder
from fsmkit.testing.reading import read_suite
from fsmkit.testing.requirements.certificates import read_certificate
from fsmkit.testing.requirements.items import Item, StatedProperty, items_of, properties_of
from fsmkit.testing.requirements.junit import SUFFIX, read_results
from fsmkit.testing.requirements.matrix import (
    CaseResult,
    Matrix,
    Status,
    matrix_of,
    report_gaps,
)
from fsmkit.testing.requirements.reading import chosen_requirements, read_requirements
from fsmkit.testing.requirements.verdicts import read_reports, with_verdicts
from fsmkit.testing.requirements.writing import csv_text, document, needs_text, page
from fsmkit.testing.running import run_case

EPILOG = """\b
Examples:
  fsmkit trace-requirements cell.yaml --requirements cell.csv --tests tests
  fsmkit trace-requirements gate.yaml --requirements gate.reqif --strict --html matrix.html
  fsmkit trace-requirements cell.yaml --requirements reqs --checked report.json --json
"""
STYLES = {Status.VERIFIED: "green", Status.FAILED: "bold red"}


@verb(
    EPILOG,
    Evidence=("tests", "checked", "certificates"),
    Output=("csv", "html", "needs", "as_json"),
    Model=MODEL,
    Search=SEARCH,
    Several_computers=("mpi", "hostfile"),
)
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@path_option(
    "-r",
    "--requirements",
    "sources",
    multiple=True,
    required=True,
    help="Read CSV, ReqIF, needs.json or a folder of Doorstop; repeatable.",
)
@click.option(
    "--where",
    multiple=True,
    metavar="COLUMN=VALUE",
    help="Trace only requirements with this value in a column; repeatable.",
)
@path_option(
    "--tests",
    multiple=True,
    help="Run these test files, or those below a folder, or read this JUnit XML; repeatable.",
)
@path_option(
    "--checked",
    multiple=True,
    help="Take verdicts from this `check --json` document; repeatable.",
)
@path_option(
    "--certificate",
    "certificates",
    multiple=True,
    help="Show this certificate of `fsmkit certify`; repeatable.",
)
@path_option("--csv", help="Write the matrix as a table.")
@path_option("--html", help="Write the matrix as a page.")
@path_option("--needs", help="Write the matrix as a needs.json for sphinx-needs.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@exploring_options
@reading_options
def command(
    files: tuple[Path, ...],
    sources: tuple[Path, ...],
    where: tuple[str, ...],
    tests: tuple[Path, ...],
    checked: tuple[Path, ...],
    certificates: tuple[Path, ...],
    csv: Path | None,
    html: Path | None,
    needs: Path | None,
    as_json: bool,
    exploring: Exploring,
    reading: Reading,
) -> int:
    """Trace requirements to items, properties, tests.

    Items name requirements under the key `req`. The properties are checked, unless --checked has
    their verdicts. With --strict, a property without a requirement is a finding, too.

    Exit code 1: a requirement has neither a property nor a test, failed or is undecided; or an
    item names an unknown requirement.
    """
    findings = reading.findings()
    columns = [_column(text) for text in where]
    every = read_requirements(sources, findings)
    requirements = chosen_requirements(every, columns)
    ran = run_tests(tests, reading, findings) if tests else None
    coverage = None if ran is None else ran.coverage
    models = trace_models(files, checked, exploring, reading, findings, is_quiet=as_json)
    matrix = matrix_of(
        requirements,
        [item for model in models for item in items_of(model.system, coverage)],
        [stated for model in models for stated in model.properties],
        () if ran is None else ran.cases,
        [read_certificate(path) for path in certificates],
        every.keys(),
    )
    report_gaps(matrix, findings, strict=reading.strict)
    title = ", ".join(model.system.name for model in models)
    written: dict[Path, str] = {}
    if csv is not None:
        written[csv] = csv_text(matrix)
    if html is not None:
        written[html] = page(matrix, title)
    if needs is not None:
        written[needs] = needs_text(matrix, title)
    write_files(written)
    report(findings)
    if as_json:
        print_json({**document(matrix), "findings": [finding_as_json(one) for one in findings]})
    else:
        _print(matrix)
        for path in written:
            out.print(f"wrote {path}", style="dim", markup=False, highlight=False)
    rules = {"unknown-requirement", "untested-requirement", "unrequired-property"}
    has_gaps = any(one.rule.name in rules for one in findings)
    statuses = {row.status for row in matrix.rows}
    return int(has_gaps or bool(statuses & {Status.FAILED, Status.UNDECIDED}))


def _column(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not name.strip() or not equals:
        raise click.UsageError(f"`{text}` is not `COLUMN=VALUE`")
    return name.strip(), value.strip()


@dataclass(frozen=True, slots=True)
class TracedModel:
    """A model with its properties and their verdicts."""

    file: Path
    system: System
    properties: tuple[StatedProperty, ...]


def trace_models(
    files: Sequence[Path],
    checked: Sequence[Path],
    exploring: Exploring,
    reading: Reading,
    findings: Findings,
    *,
    is_quiet: bool,
) -> list[TracedModel]:
    """Return the models with the verdicts of documents, or of a check that runs now."""
    reports = read_reports(checked)
    found = []
    for file in files:
        if checked:
            own = reading.of(file).findings()
            system = load_any(file, own, exploring.replacing, parameters=reading.parameters)
            stated = with_verdicts(str(file), tuple(properties_of(str(file), system)), reports)
        else:
            system, checking = evaluate_file(
                file,
                options=exploring.options,
                reading=reading,
                is_quiet=is_quiet,
                names=exploring.names,
                replacing=exploring.replacing,
                deadline=exploring.deadline,
            )
            own = checking.findings
            verdicts = {one.name: one.verdict.value for one in checking.results}
            stated = with_verdicts(
                str(file), tuple(properties_of(str(file), system)), [(str(file), verdicts)]
            )
        findings.extend(own)
        found.append(TracedModel(file, system, stated))
    return found


@dataclass(frozen=True, slots=True)
class TestRun:
    """The results of the cases of test files, and their coverage."""

    cases: tuple[CaseResult, ...]
    coverage: tuple[ChartCoverage, ...]


def run_tests(
    paths: Sequence[Path], reading: Reading, findings: Findings, charts: Sequence[Chart] = ()
) -> TestRun:
    """Run all cases of test files on the interpreter, and count what they cover.

    Files of results (``.xml``) are read: their tests ran before.

    ``charts`` are counted, too, if no case runs them.
    """
    recorder = Recorder()
    for chart in charts:
        recorder.add(chart)
    cases = [case for path in paths if path.suffix == SUFFIX for case in read_results(path)]
    suites = [path for path in paths if path.suffix != SUFFIX]
    for path in suite_files(suites) if suites else ():
        suite = read_suite(path, findings, strict=reading.strict)
        for machine in suite.system.machines:
            recorder.add(machine.chart)
        for case in suite.cases:
            outcome = run_case(suite, case, recorder=recorder)
            name, passed = case.name, not outcome.failures
            cases.append(CaseResult(str(path), name.value, name.span, case.req, passed))
    return TestRun(tuple(cases), recorder.coverage())


def _print(matrix: Matrix) -> None:
    table = Table(box=None, pad_edge=False)
    for head in ("requirement", "status", "items", "properties", "tests", "coverage"):
        table.add_column(head, overflow="fold")
    for row in matrix.rows:
        covered = row.coverage
        table.add_row(
            Text(row.requirement.id),
            Text(row.status.value, STYLES.get(row.status, "yellow")),
            Text(_kinds(row.items)),
            Text(", ".join(f"{one.name} {one.verdict or '?'}" for one in row.properties)),
            Text(_passed(row.tests)),
            Text("" if covered is None else f"{covered[0]} of {covered[1]}"),
        )
    result.print(table)
    counts = ", ".join(
        f"{sum(row.status is status for row in matrix.rows)} {status.value}" for status in Status
    )
    result.print(f"{len(matrix.rows)} requirements: {counts}", highlight=False)


def _kinds(items: Sequence[Item]) -> str:
    kinds = [item.kind for item in items]
    return ", ".join(
        f"{kinds.count(kind)} {kind}{'s' if kinds.count(kind) > 1 else ''}"
        for kind in dict.fromkeys(kinds)
    )


def _passed(tests: Sequence[CaseResult]) -> str:
    return f"{sum(one.passed for one in tests)} of {len(tests)} passed" if tests else ""
