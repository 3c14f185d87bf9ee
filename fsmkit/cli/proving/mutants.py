"""``fsmkit mutants``: the seeded mistakes that no property finds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import click

from fsmkit.cli.common.console import err, print_json, progress, report, result
from fsmkit.cli.common.exploring import MODEL, SEARCH, Exploring, exploring_options
from fsmkit.cli.common.options import Reading, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.diagnostics import Findings
from fsmkit.system.machine import Machine
from fsmkit.verify.campaign.mutants import KeptMutants
from fsmkit.verify.mutants.campaign import evaluate_mutants
from fsmkit.verify.mutants.fates import Evaluated, Fate
from fsmkit.verify.mutants.show import decided, document, summary
from fsmkit.verify.mutants.subject import Subject
from fsmkit.verify.resources.deadline import Deadline, Stage

EPILOG = """\b
Examples:
  fsmkit mutants cell.yaml
  fsmkit mutants ring.yaml pairs/feeder_molder.yaml --sample 50 --resume kept
"""


@verb(EPILOG, Model=MODEL, Search=SEARCH, Several_computers=("mpi", "hostfile"))
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--sample",
    type=click.IntRange(min=1),
    metavar="N",
    help="Evaluate N mutants instead of all.",
)
@click.option(
    "--seed", type=int, default=0, show_default=True, help="Take mutants in another order."
)
@click.option(
    "--resume",
    "folder",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="FOLDER",
    help="Keep results in this folder, and evaluate only mutants without one.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@exploring_options
@reading_options
def command(
    files: tuple[Path, ...],
    sample: int | None,
    seed: int,
    folder: Path | None,
    as_json: bool,
    exploring: Exploring,
    reading: Reading,
) -> int:
    """List seeded mistakes that no property finds.

    One mistake at a time is seeded into the charts and connections of the first file. The other
    files are systems of the same charts: a mutant that the files before did not find is tried
    there, too. Exit code 1: a mutant survives or is undecided.
    """
    options, names = exploring.options, exploring.names
    deadline = exploring.deadline
    subjects = _subjects(files, exploring.replacing, deadline, reading)
    kept = KeptMutants.of(folder, subjects, options, names)
    first, *others = subjects
    with progress(f"checking {first.path.name}", is_quiet=as_json) as shown:

        def store(evaluated: Evaluated) -> None:
            if not as_json:
                err.print(decided(evaluated), soft_wrap=True)
            kept.keep(evaluated)

        found = evaluate_mutants(
            first,
            options,
            others=others,
            count=sample or 0,
            seed=seed,
            properties=names,
            deadline=deadline,
            progress=lambda done, wanted, what: shown(f"mutant {done + 1:,} of {wanted:,}: {what}"),
            recall=kept.recall,
            store=store,
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
    """Read all systems with their replacements, before the first one is checked."""

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
    """Return the names of a machine in options: its own, and that of its array."""
    return (machine.name,) if machine.place is None else (machine.name, machine.place[0])
