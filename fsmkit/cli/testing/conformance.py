"""``fsmkit conformance``: public test suites, a line each and a total."""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import asdict
from pathlib import Path

import click
from rich.progress import Progress
from rich.text import Text

from fsmkit.cli.common.console import err, out, print_json
from fsmkit.cli.common.options import OneOf, path_option
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.diagnostics import fail
from fsmkit.testing.conformance.charts import Reading, Stage, meaning, read_chart, totals
from fsmkit.testing.conformance.conformance import Case, Result, Verdict, evaluate
from fsmkit.testing.conformance.page import page, write_into
from fsmkit.testing.conformance.suites import find_cases, find_charts
from fsmkit.testing.foreign.sctunit import find_tests, sctunit_verdicts
from fsmkit.testing.harness.harness import Harness, harness, harnesses

STYLES = {Result.PASSED: "green", Result.FAILED: "bold red", Result.SKIPPED: "yellow"}
EPILOG = """\b
Examples:
  fsmkit conformance ../shared/conformance/w3c --target all
  fsmkit conformance ~/some/project
"""


@verb(EPILOG)
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@click.option(
    "-t",
    "--target",
    type=OneOf("target", ["all", *(found.name for found in harnesses())]),
    default="interpreter",
    show_default=True,
    help="Run this target, or `all`.",
)
@click.option(
    "--limit",
    type=float,
    default=60.0,
    show_default=True,
    help="Stop each test after this many seconds.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@path_option(
    "--markdown",
    metavar="FILE",
    help="Write the tables into this page, too.",
)
@click.option("-q", "--quiet", is_flag=True, help="Omit the lines of passed tests.")
def command(
    folder: Path, target: str, limit: float, as_json: bool, markdown: Path | None, quiet: bool
) -> int:
    """Run public test suites and count the results.

    The W3C's SCXML tests, in folders named `ecma`, must end in `pass`. A chart with a script
    beside it (`.json`) must follow it. SCTUnit tests (`.sctunit`) run on their statechart, with
    the interpreter, C and Python. For any other chart the table shows whether it is read,
    elaborated and accepted by a strict C compiler, and whether its meaning is kept: no condition
    and no content is replaced by an error at run time.
    """
    chosen = harnesses() if target == "all" else (harness(target),)
    cases, charts = find_cases(folder), find_charts(folder)
    has_sctunit = any(find_tests(folder))
    if not cases and not charts and not has_sctunit:
        raise fail(
            "no-conformance-tests",
            f"there are no tests and no charts in `{folder}`",
            help="give a folder with the W3C's `ecma/test*.scxml`, with charts and a `.json` for "
            "each, or with charts",
        )
    printed = set() if as_json else set(Result) - ({Result.PASSED} if quiet else set())
    verdicts, readings = run(folder, cases, charts, chosen, limit, printed)
    for verdict in sctunit_verdicts(folder, [one.name for one in chosen]) if has_sctunit else ():
        verdicts.append(verdict)
        if verdict.result in printed:
            out.print(line(verdict))
    if as_json:
        print_json(document(verdicts, readings))
    else:
        summary(verdicts, readings)
    if markdown is not None:
        before = markdown.read_text(encoding="utf-8") if markdown.is_file() else ""
        write_files({markdown: write_into(before, page(verdicts, readings))})
    results = [*(v.result for v in verdicts), *(reading.result for reading in readings)]
    return int(Result.FAILED in results)


def run(
    folder: Path,
    cases: Sequence[Case],
    charts: Sequence[Path],
    chosen: Sequence[Harness],
    limit: float,
    shown: Container[Result],
) -> tuple[list[Verdict], list[Reading]]:
    """Run each test and each chart; print a line for the results in ``shown``."""
    verdicts: list[Verdict] = []
    readings: list[Reading] = []
    with Progress(console=err.console, transient=True, disable=not err.is_terminal) as progress:
        for case in progress.track(cases, description="tests"):
            for verdict in evaluate(case, chosen, limit):
                verdicts.append(verdict)
                if verdict.result in shown:
                    out.print(line(verdict))
        for path in progress.track(charts, description="charts"):
            reading = read_chart(path, path.relative_to(folder).as_posix(), limit)
            readings.append(reading)
            if reading.result in shown:
                out.print(chart_line(reading))
    return verdicts, readings


def line(verdict: Verdict) -> Text:
    """Return the line of one test on one runtime."""
    text = Text(f"{verdict.result.value:8}", STYLES[verdict.result])
    text.append(f"{verdict.target:12}{verdict.name}", "")
    text.append(f"  {verdict.reason}" if verdict.reason else "", "dim")
    return text


def chart_line(reading: Reading) -> Text:
    """Return the line of a chart: its last stage, and its warnings or its error."""
    if not reading.is_chart:
        return Text.assemble((f"{'no chart':26}", "yellow"), reading.name)
    text = Text()
    for name, stage in (("read", Stage.READ), ("chart", Stage.CHART), ("C", Stage.COMPILED)):
        reached = reading.stage >= stage
        text.append(f"{name} {'yes' if reached else 'no':5}", "green" if reached else "bold red")
    warnings = f"{reading.warnings} warnings" if reading.warnings else ""
    remark = reading.reason or warnings
    text.append(reading.name, "")
    text.append(f"  {remark}" if remark else "", "dim")
    return text


def summary(verdicts: Sequence[Verdict], readings: Sequence[Reading]) -> None:
    """Print the number of tests by result for each runtime, and of charts by stage."""
    for target in dict.fromkeys(verdict.target for verdict in verdicts):
        counted = count([v.result for v in verdicts if v.target == target])
        out.print(f"{target}: {', '.join(f'{n} {name}' for name, n in counted.items())}")
    if readings:
        counts = (f"{n} {name.replace('_', ' ')}" for name, n in totals(readings).items())
        out.print(f"charts: {', '.join(counts)}")
        kept = meaning(readings)
        out.print(
            f"meaning kept: {kept.kept} of {kept.files} files; "
            f"{kept.places} places are an error at run time"
        )
        for cause in kept.causes:
            out.print(f"{cause.files:5} files {cause.places:5} places  {cause.name}")


def count(results: Sequence[Result]) -> dict[str, int]:
    """Return the number of tests by result."""
    return {result.value: results.count(result) for result in Result}


def document(verdicts: Sequence[Verdict], readings: Sequence[Reading]) -> dict[str, object]:
    """Return the verdicts and the stages of charts as data for JSON."""
    tests: list[dict[str, object]] = [
        {
            "name": verdict.name,
            "target": verdict.target,
            "result": verdict.result.value,
            **({"reason": verdict.reason} if verdict.reason else {}),
        }
        for verdict in verdicts
    ]
    tests += [
        {
            "name": reading.name,
            "result": reading.result.value,
            "read": reading.stage >= Stage.READ,
            "chart": reading.stage >= Stage.CHART,
            "compiled": reading.stage >= Stage.COMPILED,
            "warnings": reading.warnings,
            "replaced": list(reading.replacement_causes),
            **({"reason": reading.reason} if reading.reason else {}),
        }
        for reading in readings
    ]
    results = [*(v.result for v in verdicts), *(reading.result for reading in readings)]
    return {
        **count(results),
        **({"charts": totals(readings), "meaning": asdict(meaning(readings))} if readings else {}),
        "tests": tests,
    }
