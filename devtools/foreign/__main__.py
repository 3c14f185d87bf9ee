"""Campaigns on machines of other tools.

``python -m devtools.foreign rewritings`` compares rewritten random machines with references of
the rules. ``corpus FOLDER`` reads every file and counts what is carried, by reason.
``damage FOLDER`` cuts files and flips bits in them. ``java FOLDER`` compares machines of Rhapsody
with the Java that Rhapsody generated; it needs ``javac``.
"""

from __future__ import annotations

import random
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import click

from devtools.foreign import choice_nets, itemis, qm_models
from devtools.foreign.generated_java import comparison, generated_classes
from devtools.foreign.machines import RULES, difference
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, FsmkitError, Severity
from fsmkit.foreign.notation import ForeignNotation
from fsmkit.plugins import plugins

COMBINATIONS = (("R1",), ("R2",), ("R7",), ("R9",), ("R11",), ("R7", "R11"), RULES)
"""Rewritings that StateSmith needs, alone and together."""
REFERENCES: dict[str, Callable[[int], str | None]] = {
    **{"+".join(rules): partial(difference, rules=rules) for rules in COMBINATIONS},
    "R1+R2+R3": qm_models.difference,
    "R10": choice_nets.difference,
    "R4+R5+R6+R11 of itemis": itemis.difference,
}
"""By rules: the first difference between a random machine by its reference and as a chart."""
LONGEST = 10.0
"""Seconds of one file."""


@click.group()
def main() -> None:
    """Run a campaign on machines of other tools."""


@main.command()
@click.option("--machines", default=2_000, help="Try this many machines for each set of rules.")
def rewritings(machines: int) -> None:
    """Compare rewritten machines with a reference of the rules."""
    failed = False
    for rules, compare in REFERENCES.items():
        start = time.monotonic()
        found = [each for seed in range(machines) if (each := compare(seed)) is not None]
        failed = failed or bool(found)
        seconds = time.monotonic() - start
        click.echo(f"{rules}: {machines} machines, {len(found)} differences, {seconds:.0f} s")
        click.echo("".join(f"{each}\n" for each in found[:3]), nl=False)
    sys.exit(failed)


@main.command()
@click.argument("folder", type=click.Path(path_type=Path, exists=True))
def corpus(folder: Path) -> None:
    """Read all files; print the numbers of those that are carried, and reasons of rejections."""
    carried: Counter[str] = Counter()
    reasons: Counter[str] = Counter()
    for reader, path in _files(folder):
        carried[f"{reader.name}: files"] += 1
        try:
            why = read_file(reader, path.read_bytes(), str(path))
        except Exception:  # noqa: BLE001  (it is what the campaign looks for)
            why = ["traceback"]
            traceback.print_exc()
        carried[f"{reader.name}: {'rejected' if why else 'carried whole'}"] += 1
        for each in why:
            reasons[f"{reader.name}: {each}"] += 1
            click.echo(f"{path.relative_to(folder)}: {each}")
    click.echo("\n".join(f"{number:5} {what}" for what, number in sorted(carried.items())))
    click.echo("\n".join(f"{number:5} {what}" for what, number in reasons.most_common()))


@main.command()
@click.argument("folder", type=click.Path(path_type=Path, exists=True))
@click.option("--files", "count", default=1_000, help="Damage this many files.")
@click.option("--seed", default=0, help="Choose other files and places.")
def damage(folder: Path, count: int, seed: int) -> None:
    """Cut files and flip bits: no traceback, no file that takes longer than ten seconds."""
    chosen = random.Random(seed)  # noqa: S311  (to repeat a campaign)
    files = [each for each in _files(folder) if each[1].stat().st_size < 200_000]
    tracebacks = slow = carried = 0
    for number in range(count):
        reader, path = chosen.choice(files)
        content = damaged(path.read_bytes(), chosen)
        start = time.monotonic()
        try:
            carried += not read_file(reader, content, str(path))
        except Exception:  # noqa: BLE001  (it is what the campaign looks for)
            tracebacks += 1
            click.echo(f"{number}: {path}")
            traceback.print_exc()
        if time.monotonic() - start > LONGEST:
            slow += 1
            click.echo(f"{number}: {path}: {time.monotonic() - start:.1f} s")
    click.echo(f"{count} damaged files: {carried} read, {tracebacks} tracebacks, {slow} slow")
    sys.exit(bool(tracebacks or slow))


@main.command()
@click.argument("folder", type=click.Path(path_type=Path, exists=True))
@click.option("--events", default=10_000, help="Send this many random events to each machine.")
def java(folder: Path, events: int) -> None:
    """Compare machines of Rhapsody, and their generated C, with Java that Rhapsody generated."""
    failed = False
    for one in generated_classes(folder):
        with tempfile.TemporaryDirectory() as place:
            verdict = comparison(one, events, Path(place))
        failed = failed or verdict != "no difference"
        click.echo(f"{one.unit.relative_to(folder)}: {one.machine}: {events} events: {verdict}")
    sys.exit(failed)


def damaged(content: bytes, chosen: random.Random) -> bytes:
    """Return content that is cut, or in which some bits are flipped."""
    if not content or chosen.random() < 0.4:
        return content[: chosen.randrange(len(content) or 1)]
    changed = bytearray(content)
    for _ in range(chosen.randrange(1, 9)):
        changed[chosen.randrange(len(changed))] ^= 1 << chosen.randrange(8)
    return bytes(changed)


def read_file(reader: ForeignNotation, content: bytes, name: str) -> list[str]:
    """Return the reasons why a file is not carried whole; nothing if all its machines are."""
    findings = Findings()
    source = reader.decode(content, name, findings)
    names = () if source is None else reader.machines(source, findings)
    for machine in names:
        assert source is not None  # noqa: S101  (there are names)
        found = reader.import_machine(source, machine, findings)
        if found is not None and not findings.has_errors:
            try:
                elaborate((found.document,), findings)
            except FsmkitError as error:
                findings.extend(error.diagnostics)
    errors = [each for each in findings if each.severity is Severity.ERROR]
    if not names and not errors:
        return ["the file holds no machine"]
    return [f"{each.rule.name}: {each.message}" for each in errors]


def _files(folder: Path) -> Iterator[tuple[ForeignNotation, Path]]:
    readers = plugins(ForeignNotation)
    for path in sorted(each for each in folder.rglob("*") if each.is_file()):
        fitting = [each for each in readers if path.name.lower().endswith(each.suffixes)]
        if len(fitting) == 1:
            yield fitting[0], path


if __name__ == "__main__":
    main()
