"""``python -m devtools.bad_hosts --charts 100``: generated C under hosts that break their contract.

Each random chart is built as default code and as tables, with the address and undefined behaviour
sanitizers, with and without ``FSM_CHECKED``, around ``bad_host.c``. Both forms must give the host
the same answers and the same snapshots. ``--system FILE`` runs joined machines instead.

With ``--beyond``, inputs, results and payloads are outside of their types, too. Nothing is promised
for these, so the program only counts the kinds of errors that the sanitizers report.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import click

from devtools.bad_hosts.program import FAILED, FORMS, build, machine_program, run, system_program
from devtools.differential import random_case
from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.limits import report_limits
from fsmkit.diagnostics import Findings
from fsmkit.system.system_file import load_system
from fsmkit.testing.harness.harness import can_stand_still

CHECKS: tuple[tuple[str, ...], ...] = ((), ("-DFSM_CHECKED",))
BATCH = 5
"""Charts in one program."""
FIGURES = (
    *("posts", "rejected posts", "unknown events", "unaccepted events", "calls from within"),
    *("snapshots restored", "snapshots rejected", "dispatches to a stopped machine"),
)
KINDS = ("runtime error: ", "AddressSanitizer: ", "broken at ", "no end")


def random_charts(seed: int, numbers: Iterable[int]) -> Iterator[Chart]:
    """Yield the random charts that C can express.

    Charts in which no time may pass between timers are omitted: `run` need not return for them.
    """
    for number in numbers:
        chart = random_case(seed, number).chart
        findings = Findings()
        report_limits(chart, findings)
        if not findings.has_errors and not can_stand_still(chart):
            yield chart


def build_and_run(
    files: Mapping[str, str], calls: int, seed: int, *flags: str, beyond: bool = False
) -> list[str]:
    """Build and run a program; return its output."""
    with tempfile.TemporaryDirectory(prefix="fsmkit-") as name:
        build(files, Path(name), flags)
        return run(Path(name), calls, seed, beyond=beyond)


def failures_of(lines: Sequence[str], counted: Counter[str]) -> Iterator[str]:
    """Yield the failures in the output of a program of charts; add up its figures."""
    digests: dict[str, str] = {}
    for line in lines:
        if line.startswith(FAILED):
            yield line
            return
        number, form, digest, *figures = line.split()
        counted.update(dict(zip(FIGURES, map(int, figures), strict=True)))
        counted["machines"] += 1
        if digests.setdefault(number, digest) != digest:
            yield f"chart {number}: `{form}` gives other answers than `{next(iter(FORMS))}`"


def abuse(charts: Sequence[Chart], calls: int, seed: int, counted: Counter[str]) -> Iterator[str]:
    """Run the builds of some charts; yield the failures and add up the figures."""
    for flags in CHECKS:
        lines = build_and_run(machine_program(charts), calls, seed, *flags)
        for failure in failures_of(lines, counted):
            yield f"{' '.join(flags) or 'plain'}: {failure}"


def abuse_system(path: Path, calls: int, seed: int) -> Iterator[str]:
    """Run the joined machines of a system, in each form; yield the failures."""
    for form in FORMS:
        files = system_program(load_system(path, Findings()), is_small=form == "size")
        for flags in CHECKS:
            lines = build_and_run(files, calls, seed, *flags)
            yield from (f"{form}: {line}" for line in lines if line.startswith(FAILED))


def error_beyond(chart: Chart, calls: int, seed: int) -> str:
    """Return the kind of the first error of a chart with values outside of their types."""
    lines = "\n".join(
        build_and_run(machine_program([chart]), calls, seed, beyond=True)
    ).splitlines()
    for line in lines:
        for kind in KINDS:
            _, found, rest = line.partition(kind)
            if found:
                return f"{found}{rest}".rstrip()[:70]
    return "no error"


@click.command()
@click.option("--charts", default=50, show_default=True, help="How many random charts.")
@click.option("--seed", default=0, show_default=True, help="Which charts.")
@click.option("--first", default=0, show_default=True, help="The number of the first chart.")
@click.option("--calls", default=20_000, show_default=True, help="Calls of each machine.")
@click.option("--beyond", is_flag=True, help="Draw values outside of their types; count errors.")
@click.option(
    "--system", "systems", multiple=True, type=click.Path(exists=True, path_type=Path),
    help="Run the joined machines of this system, not random charts. Repeatable.",
)  # fmt: skip
def main(
    charts: int, seed: int, first: int, calls: int, systems: tuple[Path, ...], *, beyond: bool
) -> None:
    """Run random charts, or systems, under bad hosts; end with 1 after a failure."""
    total: Counter[str] = Counter()
    failed = 0
    for path in systems:
        for failure in abuse_system(path, calls, seed):
            failed = 1
            click.echo(f"{path}: {failure}")
    size = 1 if beyond else BATCH
    for start in () if systems else range(first, first + charts, size):
        found = list(random_charts(seed, range(start, min(start + size, first + charts))))
        if beyond:
            total.update(error_beyond(chart, calls, start) for chart in found)
            continue
        for failure in abuse(found, calls, start, total) if found else ():
            failed = 1
            click.echo(f"charts from {start} on: {failure}")
    click.echo(", ".join(f"{count:,} {name}" for name, count in total.items()))
    sys.exit(failed)


if __name__ == "__main__":
    main()
