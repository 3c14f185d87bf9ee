"""``fsmkit check FILE --mutants``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from fsmkit.cli.common.console import print_json, progress, report, result
from fsmkit.cli.common.options import Reading
from fsmkit.verify.explore import ExplorationOptions
from fsmkit.verify.mutants.campaign import Fate, judge_mutants
from fsmkit.verify.mutants.show import document, summary
from fsmkit.verify.mutants.subject import Subject
from fsmkit.verify.resources.deadline import Deadline, Stage


def check_mutants(
    file: Path,
    count: int,
    seed: int,
    options: ExplorationOptions,
    names: frozenset[str],
    replacing: Mapping[str, Path],
    deadline: Deadline,
    reading: Reading,
    *,
    as_json: bool,
) -> int:
    """Judge mutants, print what became of them, and return the exit code: 1 if one survives."""
    findings = reading.findings()
    subject = deadline.cut_off(
        Stage.READING,
        lambda: Subject.read(
            file, findings, replacing, strict=reading.strict, parameters=reading.parameters
        ),
    )
    report(findings)
    with progress(f"checking {file.name}", is_quiet=as_json) as shown:
        found = judge_mutants(
            subject,
            options,
            count=count,
            seed=seed,
            properties=names,
            deadline=deadline,
            progress=lambda done, wanted, what: shown(f"mutant {done + 1:,} of {wanted:,}: {what}"),
        )
    if as_json:
        print_json(document(found))
    else:
        result.print(summary(found))
    undecided = any(each.fate is Fate.UNDECIDED for each in found.judged)
    return int(bool(found.survivors) or undecided or bool(found.ended))
