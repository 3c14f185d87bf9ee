"""``fsmkit evidence``: one report with all evidence of a system."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

import click

import fsmkit
from fsmkit.chart.chart import Chart
from fsmkit.cli.common.console import out, print_json, progress, report, result
from fsmkit.cli.common.exploring import MODEL, SEARCH, Exploring, exploring_options
from fsmkit.cli.common.options import Reading, path_option, read_span, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.cli.proving.check import evaluate_file
from fsmkit.cli.proving.trace_requirements import TestRun, run_tests
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.diagnostics.as_json import as_json as finding_as_json
from fsmkit.emit.lines import json_text
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.system.any_file import sources_of
from fsmkit.system.system import System
from fsmkit.system.views.drawing import draw
from fsmkit.testing.coverage.reports import total
from fsmkit.testing.evidence.eva import prove
from fsmkit.testing.evidence.misra import check_rules
from fsmkit.testing.evidence.report import Evidence, MachineEvidence, page
from fsmkit.testing.requirements.certificates import Certificate, certificate_of, read_document
from fsmkit.testing.requirements.items import items_of, properties_of
from fsmkit.testing.requirements.matrix import Matrix, matrix_of, report_gaps
from fsmkit.testing.requirements.reading import read_requirements
from fsmkit.testing.requirements.verdicts import with_verdicts
from fsmkit.testing.requirements.writing import document as matrix_document
from fsmkit.verify.certify.certify import certify
from fsmkit.verify.certify.comparison import Request
from fsmkit.verify.mutants.campaign import evaluate_mutants
from fsmkit.verify.mutants.show import document as mutants_document
from fsmkit.verify.mutants.subject import Subject
from fsmkit.verify.report.document import document as check_document
from fsmkit.verify.resources.deadline import Deadline

EPILOG = """\b
Examples:
  fsmkit evidence cell.yaml --out evidence --requirements cell.csv --tests tests
  fsmkit evidence gate.yaml --out evidence --cc 'arm-none-eabi-gcc -mcpu=cortex-m0 -Os'
"""
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
PREFIX = "analysed"
"""The prefix of the analysed C; its host has names of its own, such as `machine`."""
PRINTING = 120
"""Seconds that a browser may take for the PDF."""
Result = TypeVar("Result")


@verb(
    EPILOG,
    Evidence=("sources", "tests", "sample", "command_line", "certificates", "seconds"),
    Model=MODEL,
    Search=SEARCH,
    Several_computers=("mpi", "hostfile"),
)
@click.argument("file", type=click.Path(path_type=Path))
@path_option("-o", "--out", "folder", required=True, help="Write the report here (required).")
@path_option(
    "-r",
    "--requirements",
    "sources",
    multiple=True,
    help="Trace these requirements, as `trace-requirements` does; repeatable.",
)
@path_option(
    "--tests", multiple=True, help="Run these test files, or those below a folder; repeatable."
)
@click.option(
    "--mutants",
    "sample",
    type=click.IntRange(min=0),
    default=10,
    show_default=True,
    metavar="N",
    help="Seed N mistakes.",
)
@click.option(
    "--cc",
    "command_line",
    metavar="COMMAND",
    default="",
    help="Certify for this compiler and flags (default: this computer's).",
)
@path_option(
    "--certificate",
    "certificates",
    multiple=True,
    help="Take this certificate instead of certifying its chart; repeatable.",
)
@click.option(
    "--per-machine",
    "seconds",
    metavar="DURATION",
    callback=read_span,
    default="30s",
    show_default=True,
    help="Spend at most this on a certificate, and on an analysis.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@exploring_options
@reading_options
def command(
    file: Path,
    folder: Path,
    sources: tuple[Path, ...],
    tests: tuple[Path, ...],
    sample: int,
    command_line: str,
    certificates: tuple[Path, ...],
    seconds: float,
    as_json: bool,
    exploring: Exploring,
    reading: Reading,
) -> int:
    """Write one report with all evidence of a system.

    Runs the check, a sample of seeded mistakes, tests with MC/DC coverage, certificates of each
    machine and, where Frama-C and Cppcheck are installed, analyses of the generated C. Writes
    report.html, evidence.json and, with Chromium, report.pdf.

    Exit code 1: the report names something that failed or is undecided.
    """
    given = [(read_document(path), path) for path in certificates]
    with progress("collecting evidence", is_quiet=as_json) as show:
        show("checking")
        system, checked = evaluate_file(
            file,
            options=exploring.options,
            reading=reading,
            is_quiet=True,
            names=exploring.names,
            replacing=exploring.replacing,
            deadline=exploring.deadline,
        )
        findings = reading.of(file).findings()
        show("running tests")
        product = _charts(system)
        tested = [chart for _, chart in product]
        ran = run_tests(tests, reading, findings, tested) if tests else TestRun((), ())
        show("seeding mistakes")
        mutants = _mutants(file, sample, exploring, reading, show) if sample else None
        request = Request(tuple(shlex.split(command_line)), timeout=seconds)
        machines = tuple(_machine(name, chart, given, request, show) for name, chart in product)
        verdicts = {one.name: one.verdict.value for one in checked.results}
        certified = [
            certificate_of(one.certificate, Path(f"{one.name}.json"))
            for one in machines
            if one.certificate is not None
        ]
        matrix = _matrix(file, system, verdicts, sources, ran, certified, findings)
        findings.extend(checked.findings)
    evidence = Evidence(
        title=system.name,
        version=fsmkit.__version__,
        model=os.fspath(file),
        sources=tuple(
            (source.name, sha256(source.text.encode(errors="replace")).hexdigest())
            for source in sources_of(system)
        ),
        checked=check_document(checked),
        mutants=mutants,
        cases=ran.cases,
        coverage=ran.coverage,
        machines=machines,
        matrix=matrix,
    )
    summary = _summary(evidence, findings)
    write_files(
        {
            folder / "report.html": page(evidence),
            folder / "evidence.json": json_text({**summary, "check": evidence.checked}),
        },
        folder,
    )
    written = [folder / "report.html", folder / "evidence.json"]
    written += _printed(folder)
    report(findings)
    if as_json:
        print_json({**summary, "files": [os.fspath(path) for path in written]})
    else:
        for failure in evidence.failures():
            result.print(f"FAILED  {failure}", style="red", markup=False, highlight=False)
        for path in written:
            out.print(f"wrote {path}", style="dim", markup=False, highlight=False)
    return int(bool(evidence.failures()))


def _charts(system: System) -> list[tuple[str, Chart]]:
    """Return the different charts of the product, each with the name of its first machine."""
    found: dict[str, tuple[str, Chart]] = {}
    for machine in system.machines:
        if not machine.environment:
            found.setdefault(fingerprint(machine.chart), (machine.name, machine.chart))
    return [*found.values()]


def _mutants(
    file: Path,
    sample: int,
    exploring: Exploring,
    reading: Reading,
    show: Callable[[str], None],
) -> Mapping[str, Any]:
    subject = Subject.read(
        file,
        reading.of(file).findings(),
        exploring.replacing,
        strict=reading.strict,
        parameters=reading.parameters,
    )
    found = evaluate_mutants(
        subject,
        exploring.options,
        count=sample,
        properties=exploring.names,
        deadline=Deadline(exploring.options.timeout),
        progress=lambda done, wanted, _: show(f"seeding mistakes: {done} of {wanted}"),
    )
    return mutants_document(found)


def _machine(
    name: str,
    chart: Chart,
    given: Sequence[tuple[Mapping[str, Any], Path]],
    request: Request,
    show: Callable[[str], None],
) -> MachineEvidence:
    digest, reason = fingerprint(chart), ""
    certificate = next((found for found, _ in given if found["fingerprint"] == digest), None)
    if certificate is None:
        show(f"certifying {name}")
        try:
            certificate = certify(chart, request)
        except FsmkitError as error:
            reason = error.diagnostics[0].message
    show(f"analysing {name}")
    drawn = b""
    try:
        picture = draw(chart, Path("chart.svg"))
        drawn = picture if isinstance(picture, bytes) else picture.encode()
    except FsmkitError:
        pass  # without a program that lays out, the report has no drawing
    frama_c, cppcheck = shutil.which("frama-c"), shutil.which("cppcheck")
    proof = lint = None
    try:
        machine = generate_machine(chart, PREFIX)
    except FsmkitError:
        frama_c = cppcheck = None
    if frama_c is not None:
        with tempfile.TemporaryDirectory(prefix="fsmkit-eva-") as place:
            proof = prove(frama_c, machine, Path(place), request.timeout or None)
    if cppcheck is not None:
        with tempfile.TemporaryDirectory(prefix="fsmkit-misra-") as place:
            lint = check_rules(cppcheck, machine, Path(place), request.timeout or None)
    file = chart.sources[0].name if chart.sources else ""
    return MachineEvidence(name, file, certificate, reason, proof, lint, drawn)


def _matrix(
    file: Path,
    system: System,
    verdicts: Mapping[str, str],
    sources: Sequence[Path],
    ran: TestRun,
    certificates: Sequence[Certificate],
    findings: Findings,
) -> Matrix | None:
    if not sources:
        return None
    requirements = read_requirements(sources, findings)
    stated = with_verdicts(
        str(file), tuple(properties_of(str(file), system)), [(str(file), verdicts)]
    )
    coverage = ran.coverage if ran.cases else None
    items = [*items_of(system, coverage)]
    matrix = matrix_of(requirements, items, stated, ran.cases, certificates)
    report_gaps(matrix, findings, strict=False)
    return matrix


def _summary(evidence: Evidence, findings: Findings) -> dict[str, Any]:
    whole = total(evidence.coverage)
    ratios = {
        name: {"covered": one.covered, "all": one.all}
        for name, one in (
            ("states", whole.states),
            ("transitions", whole.transitions),
            ("decisions", whole.decisions),
            ("conditions", whole.conditions),
        )
    }
    return {
        "model": evidence.model,
        "failures": list(evidence.failures()),
        "verdict": evidence.checked["verdict"],
        "tests": {
            "passed": sum(one.passed for one in evidence.cases),
            "all": len(evidence.cases),
            "coverage": ratios,
        },
        "mutants": evidence.mutants,
        "machines": [
            {
                "name": one.name,
                "file": one.file,
                "certificate": one.certificate,
                "reason": one.reason,
                "alarms": None if one.proof is None or one.proof.failure else [*one.proof.alarms],
                "deviations": None
                if one.lint is None or one.lint.failure
                else dict(one.lint.deviations),
            }
            for one in evidence.machines
        ],
        "requirements": None if evidence.matrix is None else matrix_document(evidence.matrix),
        "findings": [finding_as_json(one) for one in findings],
    }


def _printed(folder: Path) -> list[Path]:
    """Return the PDF of the report, if a browser could print it."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        return []
    target = folder / "report.pdf"
    with tempfile.TemporaryDirectory(prefix="fsmkit-print-") as place:
        printed = Path(place) / "report.pdf"
        words = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer"]
        words += [f"--user-data-dir={place}/profile", f"--print-to-pdf={printed}"]
        try:
            subprocess.run(
                [*words, (folder / "report.html").resolve().as_uri()],
                capture_output=True,
                check=True,
                timeout=PRINTING,
            )
            write_files({target: printed.read_bytes()}, folder)
        except (OSError, subprocess.SubprocessError):
            return []
    return [target]
