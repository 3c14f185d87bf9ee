"""Certificates under test: random charts must agree, and seeded faults must be found.

``python -m devtools.certificates charts --charts 1000`` certifies random charts: each difference is
a false alarm, or a mistake of a generator. ``... faults FILE --elf 300 --c 200`` changes one
instruction of the binary, or one statement of the generated C, at a time. ``... patches FILE
--count 50`` changes the generator in one place at a time. Both list the faults that no step shows,
those in code that no step executes apart.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from random import Random

import click

from devtools.differential import LIMITS, random_case
from devtools.seeded_faults.binary import binary_faults
from devtools.seeded_faults.patches import all_patches, patched
from devtools.seeded_faults.statements import statement_faults
from devtools.seeded_faults.subject import Subject, listed
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.any_file import read_chart
from fsmkit.verify.certify.certify import certify
from fsmkit.verify.certify.comparison import Request

CORTEX_M0 = "arm-none-eabi-gcc -mcpu=cortex-m0 -Os"
REJECTED = LIMITS | {"livelock", "not-certified", "not-explored-yet", "c-name-taken"}
"""The rules by which a random chart is not certified."""


# --- commands ----------------------------------------------------------------------------------


@click.group()
def main() -> None:
    """Test certificates by random charts and by seeded faults."""


@main.command()
@click.option("--charts", default=1000, show_default=True, help="How many random charts.")
@click.option("--seed", default=0, show_default=True, help="Which thousand.")
@click.option("--first", default=0, show_default=True, help="The number of the first chart.")
@click.option("--limit", default=300, show_default=True, help="Steps of each chart.")
@click.option("--seconds", default=0.0, help="Stop after this time.")
@click.option("--cc", default="", help="The compiler with its flags (default: this computer's).")
def charts(charts: int, seed: int, first: int, limit: int, seconds: float, cc: str) -> None:
    """Certify random charts and list those whose executions differ."""
    totals = random_charts(range(first, first + charts), seed, limit, seconds, cc)
    raise SystemExit(1 if totals else 0)


def random_charts(
    numbers: Sequence[int], seed: int, limit: int, seconds: float, command: str
) -> list[str]:
    """Certify random charts; return a line for each difference."""
    wrong: list[str] = []
    done = rejected = steps = 0
    started = time.monotonic()
    for number in numbers:
        if seconds and time.monotonic() - started > seconds:
            break
        try:
            chart = random_case(seed, number).chart
            document = certify(chart, Request(tuple(command.split()), limit=limit, timeout=20))
        except FsmkitError as error:
            rules = {d.rule.name for d in error.diagnostics}
            if rules <= REJECTED:
                rejected += 1
                continue
            wrong.append(f"chart {number}: {error}")
            click.echo(wrong[-1])
            continue
        done += 1
        steps += document["steps"]
        for each in document["differences"][:1]:
            wrong.append(f"chart {number}: {[*each['path'], each['step']]}: {each['what']}")
            click.echo(wrong[-1])
    click.echo(
        f"{done} charts, {steps:,} steps, {rejected} not certified, {len(wrong)} differences, "
        f"{time.monotonic() - started:.0f} s"
    )
    return wrong


FILES = click.argument(
    "files", nargs=-1, required=True, type=click.Path(path_type=Path, exists=True)
)
LIMIT = click.option("--limit", default=3_000, show_default=True, help="Steps of each chart.")
SEED = click.option("--seed", default=0, show_default=True, help="Which faults.")
ALL = click.option("--all", "has_all", is_flag=True, help="List all faults that were not found.")


@main.command()
@FILES
@click.option("--elf", default=300, show_default=True, help="Faults in the binary of each chart.")
@click.option("--c", "in_c", default=200, show_default=True, help="Faults in its generated C.")
@LIMIT
@SEED
@click.option("--cc", default=CORTEX_M0, show_default=True, help="The compiler with its flags.")
@ALL
def faults(
    files: tuple[Path, ...], elf: int, in_c: int, limit: int, seed: int, cc: str, *, has_all: bool
) -> None:
    """Seed faults into the code of charts and list those that no step shows."""
    for file in files:
        with tempfile.TemporaryDirectory(prefix="fsmkit-certify-") as name:
            started = time.process_time()
            subject = _subject(file, Path(name), cc if elf else "", limit)
            random = Random(seed)  # noqa: S311
            if elf:
                totals = binary_faults(subject, elf, random)
                click.echo("\n".join(listed("the binary", totals, has_all=has_all)))
            if in_c:
                totals = statement_faults(subject, in_c, random)
                click.echo("\n".join(listed("the generated C", totals, has_all=has_all)))
            click.echo(f"  {time.process_time() - started:.0f} s, without compilers")


@main.command()
@FILES
@click.option("--count", default=50, show_default=True, help="Patches that change generated code.")
@LIMIT
@SEED
@ALL
def patches(files: tuple[Path, ...], count: int, limit: int, seed: int, *, has_all: bool) -> None:
    """Patch the generator of C and list the patches that no chart shows."""
    with tempfile.TemporaryDirectory(prefix="fsmkit-certify-") as name:
        folder = Path(name)
        subjects = [
            _subject(file, folder / str(number), "", limit) for number, file in enumerate(files)
        ]
        every = all_patches([each.chart for each in subjects], Random(seed))  # noqa: S311
        totals = patched(subjects, count, every, folder)
        click.echo("\n".join(listed("the generator", totals, has_all=has_all)))


def _subject(file: Path, folder: Path, command: str, limit: int) -> Subject:
    subject = Subject(read_chart(file, Findings()), folder, command, limit)
    end = "complete" if subject.is_complete else "partial"
    click.echo(f"{file.name}: {subject.steps:,} steps, {end}")
    return subject


if __name__ == "__main__":
    main()
