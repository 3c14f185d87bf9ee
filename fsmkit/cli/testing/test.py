"""``fsmkit test``: the cases of ``*.test.yaml``, on the interpreter and on generated code."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from fsmkit.chart.loading import read_bytes
from fsmkit.cli.common.console import print_json, report, result
from fsmkit.cli.common.options import OneOf, Reading, path_option, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.watching import watched
from fsmkit.diagnostics import FsmkitError, Severity, fail
from fsmkit.testing.coverage.record import (
    FOLDER,
    ChartCoverage,
    Recorder,
    add_coverage,
    erase,
    save,
)
from fsmkit.testing.coverage.reports import Figures, total
from fsmkit.testing.outcome_text import failure_findings, story
from fsmkit.testing.reading import SUFFIXES, is_suite, read_suite
from fsmkit.testing.running import Outcome, run_case
from fsmkit.testing.runtimes import TARGETS, Counted, coverage_of_machines, runtime
from fsmkit.testing.suite import Suite

EPILOG = """\b
Examples:
  fsmkit test                          (all *.test.yaml below this folder)
  fsmkit test gate.test.yaml --target c
  fsmkit test --cov --fail-under 90
  fsmkit test gate.test.yaml --case 'gives up' --verbose
"""
NAMES_OF_TESTS = f"the names of files of tests end in `{SUFFIXES[0]}`"
EVERY = ("interpreter", *TARGETS, "all")


@dataclass(frozen=True, slots=True)
class _CaseRun:
    suite: Suite
    target: str
    outcome: Outcome


@verb(EPILOG, Coverage=("is_covering", "folder", "fail_under"))
@click.argument("paths", nargs=-1, type=click.Path(path_type=Path))
@click.option(
    "-t",
    "--target",
    type=OneOf("target", EVERY),
    default="interpreter",
    show_default=True,
    help="Run the cases on this target, beside the interpreter.",
)
@click.option(
    "--case", "chosen", multiple=True, help="Run only the cases of this name; repeatable."
)
@click.option("--cov", "is_covering", is_flag=True, help="Count the coverage of the cases.")
@path_option(
    "--cov-folder",
    "folder",
    default=FOLDER,
    show_default=True,
    help="Keep the counts in this folder.",
)
@click.option(
    "--fail-under",
    type=click.FloatRange(0, 100),
    help="Exit with 1 if less is covered, in percent; with --cov.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@watched
@reading_options
def command(
    paths: tuple[Path, ...],
    target: str,
    chosen: tuple[str, ...],
    is_covering: bool,
    folder: Path,
    fail_under: float | None,
    as_json: bool,
    reading: Reading,
) -> int:
    """Run test files, or all test files below folders.

    A case uses the script lines of `fsmkit run` and expects states, calls, events and conditions.
    Exit code 1: a case failed, or coverage is below --fail-under.
    """
    if fail_under is not None and not is_covering:
        raise click.UsageError("--fail-under needs --cov")
    recorder = Recorder() if is_covering else None
    targets = TARGETS if target == "all" else (target,) if target != "interpreter" else ()
    ran: list[_CaseRun] = []
    counted: list[ChartCoverage] = []
    findings = reading.findings()
    for path in suite_files(paths):
        suite = read_suite(path, findings, strict=reading.strict)
        ran += _run(suite, chosen, targets, recorder, counted)
    report(finding for finding in findings if finding.severity is not Severity.NOTE)
    if not ran:
        raise fail(
            "wrong-option",
            f"no case is called {', '.join(f'`{each}`' for each in chosen)}",
            help="`fsmkit test` without --case runs all",
        )
    covered = None
    coverage: tuple[ChartCoverage, ...] = ()
    if recorder is not None:
        coverage = add_coverage((recorder.coverage(), counted))
        erase(folder)
        save(coverage, folder)
        covered = total(coverage)
    failed = [each for each in ran if each.outcome.failures]
    if as_json:
        print_json(_document(ran, covered))
    else:
        _print(ran)
        if recorder is not None:
            from fsmkit.cli.testing.coverage import print_table

            print_table(coverage)
    too_little = covered is not None and covered.whole.percent < (fail_under or 0)
    if too_little and covered is not None and not as_json:
        result.print(
            f"{covered.whole.percent:.1f} % are covered, less than {fail_under:g} %", style="red"
        )
    return 1 if failed or too_little else 0


def suite_files(paths: Sequence[Path]) -> Iterator[Path]:
    """Yield the given test files, and all test files below the given folders."""
    for path in paths or (Path(),):
        if not path.is_dir():
            if not is_suite(path):
                raise _no_suite(path)
            yield path
            continue
        found = sorted({each for suffix in SUFFIXES for each in path.rglob(f"*{suffix}")})
        if not found:
            raise fail(
                "nothing-to-check", f"there is no test file in `{path}`", help=NAMES_OF_TESTS
            )
        yield from found


def _no_suite(path: Path) -> FsmkitError:
    """Return the error for a file that is not a test file, is missing, or is empty."""
    if not read_bytes(path).strip():
        return fail("empty-file", f"`{path}` is empty", help=NAMES_OF_TESTS)
    return fail("broken-tests", f"`{path}` is not a test file", help=NAMES_OF_TESTS)


def _run(
    suite: Suite,
    chosen: Sequence[str],
    targets: Sequence[str],
    recorder: Recorder | None,
    counted: list[ChartCoverage],
) -> Iterator[_CaseRun]:
    """Run the cases; with several targets, coverage counts the first one."""
    if targets and not suite.system.is_open:
        raise fail(
            "wrong-option",
            f"`{suite.file}` tests a system, which the interpreter alone runs",
            help="leave --target out",
        )
    if recorder is not None:
        for machine in suite.system.machines:
            recorder.add(machine.chart)
    machines: list[Counted] = []
    made = [
        (name, runtime(name, machines if number == 0 and recorder is not None else None))
        for number, name in enumerate(targets)
    ]
    for case in suite.cases:
        if chosen and case.name.value not in chosen:
            continue
        if not made:
            yield _CaseRun(suite, "interpreter", run_case(suite, case, recorder=recorder))
        for name, make in made:
            yield _CaseRun(suite, name, run_case(suite, case, runtime=make))
    counted += coverage_of_machines(machines)


def _print(ran: Sequence[_CaseRun]) -> None:
    for suite in dict.fromkeys(each.suite.file for each in ran):
        own = [each for each in ran if each.suite.file == suite]
        result.print(f"{suite}", style="bold", markup=False, highlight=False)
        for each in own:
            is_good = not each.outcome.failures
            target = "" if each.target == "interpreter" else f" ({each.target})"
            mark = "passed" if is_good else "FAILED"
            result.print(
                f"  {mark}  {each.outcome.case.name}{target}",
                style="green" if is_good else "bold red",
                markup=False,
                highlight=False,
            )
            if not is_good:
                for line in story(each.suite, each.outcome):
                    result.print(line)
                report(failure_findings(each.outcome))
    failed = sum(bool(each.outcome.failures) for each in ran)
    result.print(f"{len(ran) - failed} passed, {failed} failed", highlight=False)


def _document(ran: Sequence[_CaseRun], covered: Figures | None) -> dict[str, Any]:
    found: dict[str, Any] = {
        "cases": [
            {
                "file": str(each.suite.file),
                "case": each.outcome.case.name.value,
                "target": each.target,
                "passed": not each.outcome.failures,
                "failures": [
                    {"at": str(failure.at), "message": failure.message}
                    for failure in each.outcome.failures
                ],
            }
            for each in ran
        ]
    }
    if covered is not None:
        found["coverage"] = {
            name: {"covered": figure.covered, "all": figure.all}
            for name, figure in (
                ("states", covered.states),
                ("transitions", covered.transitions),
                ("decisions", covered.decisions),
                ("conditions", covered.conditions),
            )
        }
    return found
