"""``fsmkit check FILE --mutants``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from fsmkit.cli.common.console import err, print_json, progress, report, result
from fsmkit.cli.common.options import Reading
from fsmkit.diagnostics import Findings
from fsmkit.system.machine import Machine
from fsmkit.verify.campaign.mutants import KeptMutants
from fsmkit.verify.explore import ExplorationOptions
from fsmkit.verify.mutants.campaign import evaluate_mutants
from fsmkit.verify.mutants.fates import Evaluated, Fate
from fsmkit.verify.mutants.show import decided, document, summary
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
    folder: Path | None,
    *,
    as_json: bool,
) -> int:
    """Evaluate mutants, print what became of them, and return the exit code: 1 if one survives.

    They are those of the first file. The others are systems with the same charts: a mutant that no
    property of the files before has found is evaluated there, too, if it can be. What is known is
    kept in the ``folder``, if there is one, and not evaluated again.
    """
    subjects = _subjects(files, replacing, deadline, reading)
    kept = KeptMutants.of(folder, subjects, options, names)
    first, *others = subjects
    with progress(f"checking {first.path.name}", is_quiet=as_json) as shown:

        def tell(evaluated: Evaluated) -> None:
            if not as_json:
                err.print(decided(evaluated), soft_wrap=True)
            kept.keep(evaluated)

        found = evaluate_mutants(
            first,
            options,
            others=others,
            count=count,
            seed=seed,
            properties=names,
            deadline=deadline,
            progress=lambda done, wanted, what: shown(f"mutant {done + 1:,} of {wanted:,}: {what}"),
            recall=kept.recall,
            tell=tell,
        )
    for error in found.failed:
        report(error.diagnostics)
    if as_json:
        print_json(document(found))
    else:
        result.print(summary(found))
    undecided = any(each.fate is Fate.UNDECIDED for each in found.evaluated)
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
