"""``fsmkit check FILE --mutants``."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from fsmkit.cli.common.console import print_json, progress, report, result
from fsmkit.cli.common.options import Reading
from fsmkit.verify.explore import ExplorationOptions
from fsmkit.verify.mutants.campaign import Campaign, Fate, judge_mutants, merged
from fsmkit.verify.mutants.show import document, summary
from fsmkit.verify.mutants.subject import Subject
from fsmkit.verify.resources.deadline import Deadline, Stage


def check_mutants(
    files: Sequence[Path],
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
    """Judge mutants, print what became of them, and return the exit code: 1 if one survives.

    They are those of the first file. The others are systems with the same charts: a mutant that no
    property of the files before has found is judged there, too, if it can be.
    """
    found: Campaign | None = None
    for file in files:
        left = (
            None
            if found is None
            else {each.mutant.identity for each in found.judged if each.fate is not Fate.FOUND}
        )
        one = _judged(
            file,
            count if found is None else 0,
            seed,
            options,
            names,
            replacing,
            left,
            deadline,
            reading,
            is_quiet=as_json,
        )
        found = one if found is None else merged(found, one)
    assert found is not None  # noqa: S101  (there is a first file)
    if as_json:
        print_json(document(found))
    else:
        result.print(summary(found))
    undecided = any(each.fate is Fate.UNDECIDED for each in found.judged)
    return int(bool(found.survivors) or undecided or bool(found.ended))


def _judged(
    file: Path,
    count: int,
    seed: int,
    options: ExplorationOptions,
    names: frozenset[str],
    replacing: Mapping[str, Path],
    among: Collection[tuple[object, ...]] | None,
    deadline: Deadline,
    reading: Reading,
    *,
    is_quiet: bool,
) -> Campaign:
    findings = reading.findings()
    subject = deadline.cut_off(
        Stage.READING,
        lambda: Subject.read(
            file, findings, replacing, strict=reading.strict, parameters=reading.parameters
        ),
    )
    report(findings)
    with progress(f"checking {file.name}", is_quiet=is_quiet) as shown:
        return judge_mutants(
            subject,
            options,
            count=count,
            seed=seed,
            properties=names,
            among=among,
            deadline=deadline,
            progress=lambda done, wanted, what: shown(f"mutant {done + 1:,} of {wanted:,}: {what}"),
        )
