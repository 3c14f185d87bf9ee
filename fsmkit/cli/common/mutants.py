"""``fsmkit check FILE --mutants``."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from fsmkit.cli.common.console import print_json, progress, report, result
from fsmkit.cli.common.options import Reading
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.system import Machine
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
    for subject in _subjects(files, replacing, deadline, reading):
        left = (
            None
            if found is None
            else {each.mutant.identity for each in found.judged if each.fate is not Fate.FOUND}
        )
        try:
            one = _judged(
                subject,
                count if found is None else 0,
                seed,
                options,
                names,
                left,
                deadline,
                is_quiet=as_json,
            )
        except FsmkitError as error:
            if found is None:
                raise
            report(error.diagnostics)
            found = replace(found, ended=found.ended or f"`{subject.path}` was not judged")
        else:
            found = one if found is None else merged(found, one)
    assert found is not None  # noqa: S101  (there is a first file)
    if as_json:
        print_json(document(found))
    else:
        result.print(summary(found))
    undecided = any(each.fate is Fate.UNDECIDED for each in found.judged)
    return int(bool(found.survivors) or undecided or bool(found.ended))


def _subjects(
    files: Sequence[Path], replacing: Mapping[str, Path], deadline: Deadline, reading: Reading
) -> list[Subject]:
    """Read all systems, before hours go into the first one; each with what it has replaced."""

    def read(file: Path, findings: Findings, own: Mapping[str, Path]) -> Subject:
        return deadline.cut_off(
            Stage.READING,
            lambda: Subject.read(
                file, findings, own, strict=reading.strict, parameters=reading.parameters
            ),
        )

    machines = [
        {name for each in read(file, Findings(), {}).system.machines for name in _names_of(each)}
        for file in (files if replacing and len(files) > 1 else ())
    ]
    nobodys = replacing.keys() - set[str]().union(*machines)
    subjects = []
    for number, file in enumerate(files):
        has = replacing.keys() & machines[number] if machines else set(replacing)
        findings = reading.findings()
        own = {name: path for name, path in replacing.items() if name in has | nobodys}
        subjects.append(read(file, findings, own))
        report(findings)
    return subjects


def _names_of(machine: Machine) -> tuple[str, ...]:
    """Return what a machine is called in options: itself, and the array that it is in."""
    return (machine.name,) if machine.place is None else (machine.name, machine.place[0])


def _judged(
    subject: Subject,
    count: int,
    seed: int,
    options: ExplorationOptions,
    names: frozenset[str],
    among: Collection[tuple[object, ...]] | None,
    deadline: Deadline,
    *,
    is_quiet: bool,
) -> Campaign:
    with progress(f"checking {subject.path.name}", is_quiet=is_quiet) as shown:
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
