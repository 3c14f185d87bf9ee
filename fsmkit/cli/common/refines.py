"""``fsmkit check DERIVED --refines BASE``."""

from __future__ import annotations

from pathlib import Path

from fsmkit.cli.common.console import print_json, progress, report, result
from fsmkit.cli.common.options import Reading
from fsmkit.system.any_file import read_chart
from fsmkit.verify.properties.refinement import refines
from fsmkit.verify.properties.refinement_report import document, line, summary, tell, verdict_of
from fsmkit.verify.report.verdict import Verdict
from fsmkit.verify.resources.deadline import Deadline, Stage, TimeUp


def compare(file: Path, base: Path, deadline: Deadline, reading: Reading, *, as_json: bool) -> int:
    """Compare two charts, print what was found, and return the exit code."""
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
    tell(found, findings)
    report(findings)
    if as_json:
        print_json(document(found))
    else:
        result.print(summary(found))
    return int(verdict_of(found) is not Verdict.HOLDS or findings.has_errors)
