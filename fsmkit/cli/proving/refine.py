"""``fsmkit refine``: check whether one chart refines another."""

from __future__ import annotations

from pathlib import Path

import click

from fsmkit.cli.common.console import print_json, progress, report, result
from fsmkit.cli.common.interrupts import start_time
from fsmkit.cli.common.options import TIMEOUT, Reading, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.system.any_file import read_chart
from fsmkit.verify.properties.refinement import refines
from fsmkit.verify.properties.refinement_report import (
    add_findings,
    document,
    line,
    summary,
    verdict_of,
)
from fsmkit.verify.report.verdict import Verdict
from fsmkit.verify.resources.deadline import Deadline, Stage, TimeUp

EPILOG = """\b
Examples:
  fsmkit refine feeder.yaml module.scxml
  fsmkit refine feeder.yaml module.scxml --timeout 1m --json
"""


@verb(EPILOG, Model=("parameters",))
@click.argument("file", metavar="CHART", type=click.Path(path_type=Path))
@click.argument("base", type=click.Path(path_type=Path))
@TIMEOUT
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@reading_options
def command(file: Path, base: Path, timeout: float, as_json: bool, reading: Reading) -> int:
    """Check that one chart refines another one.

    Time is ignored: CHART refines BASE if BASE has every sequence of events that CHART has.

    Exit code 1: it does not, or the time limit was reached.
    """
    deadline = Deadline(timeout, start_time())
    findings = reading.findings()
    try:
        derived, extended = deadline.cut_off(
            Stage.READING,
            lambda: [read_chart(path, findings, strict=reading.strict) for path in (file, base)],
        )
    except TimeUp:
        claim, why = f"`{file.name}` refines `{base.name}`", deadline.why()
        findings.add("undecided", f"whether {claim} is undecided: {why}", None)
        report(findings)
        if as_json:
            print_json({"verdict": Verdict.UNDECIDED.value, "reason": why})
        else:
            result.print(line(Verdict.UNDECIDED, claim, why))
        return 1
    doing = f"comparing {derived.name}"
    with progress(doing, is_quiet=as_json) as shown:

        def show(pairs: int, steps: int, _: int) -> None:
            shown(f"{doing}: {pairs:,} pairs, {steps:,} steps")

        found = refines(derived, extended, deadline=deadline, progress=show)
    add_findings(found, findings)
    report(findings)
    if as_json:
        print_json(document(found))
    else:
        result.print(summary(found))
    return int(verdict_of(found) is not Verdict.HOLDS or findings.has_errors)
