"""Compare the coverage counters of generated code with the interpreter's, on random charts.

``python -m devtools.coverage --charts 500`` is the long run, on Python and C (as an extension
module). A chart equals that of `devtools.differential` with the same seed and number.
``--optimize`` selects the form of the C.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import click

from devtools.differential import LIMITS, Case, random_case
from fsmkit.chart.chart import Chart
from fsmkit.codegen.python.loading import load_machine
from fsmkit.diagnostics import FsmkitError, Text
from fsmkit.plan.counting import FULL
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.runtime.interpreter.snapshot import Macrostep
from fsmkit.runtime.script import Player, script_texts
from fsmkit.testing.coverage.counters import counters, coverage_of_area, everyone
from fsmkit.testing.coverage.record import ChartCoverage, Recorder, add_coverage
from fsmkit.testing.harness.pyext import HarnessExtension, load_classes
from fsmkit.testing.harness.python import HarnessMachine

BATCH = 10
Counts = dict[str, tuple[object, ...]]
"""By fingerprint: states, transitions, guards, the first two with counts up to 255; outcomes."""


@dataclass
class Totals:
    """The figures of a run."""

    charts: int = 0
    rejected: int = 0
    items: int = 0
    """Number of reached items."""


def compared(cases: Sequence[Case], totals: Totals, optimize: str = "") -> Iterator[str]:
    """Yield where generated code counts otherwise than the interpreter."""
    wanted = [interpreter_counts(case) for case in cases]
    runs: list[tuple[str, Callable[[], list[type]], type[HarnessMachine]]] = [
        (
            "python",
            lambda: [load_machine(case.chart, covered=True) for case in cases],
            HarnessMachine,
        ),
        (
            "c",
            lambda: load_classes([case.chart for case in cases], covered=True, optimize=optimize),
            HarnessExtension,
        ),
    ]
    for target, make, driver in runs:
        for case, expected, class_ in zip(cases, wanted, make(), strict=True):
            found = generated_counts(case, driver(case.chart, class_, traced=False))
            if found != expected:
                yield f"{case.name} on {target}: {difference(expected, found)}"
    totals.charts += len(cases)
    totals.items += sum(_reached(counts) for counts in wanted)


def interpreter_counts(case: Case) -> Counts:
    """Return the counts of the interpreter."""
    recorder = Recorder()
    recorder.add(case.chart)
    player = Player(case.chart)
    player.host.guard = recorder.guard  # type: ignore[attr-defined]
    for line in script_texts(case.script):
        for done in player.play(line):
            if isinstance(done, Macrostep):
                recorder.done(case.chart, done)
    return _counts(recorder.coverage())


def generated_counts(case: Case, machine: HarnessMachine) -> Counts:
    """Return the counts of a generated machine."""
    for line in script_texts(case.script):
        machine.obey(Text(line.value, line.span))
    known = {fingerprint(chart)[:16]: chart for chart in everyone([case.chart])}
    read = counters(machine.coverage(), case.name)
    # in one run, as random charts of one name may be different ones
    return _counts(
        add_coverage([[coverage_of_area(known[each.fingerprint], each.area) for each in read]])
    )


def _counts(coverage: Iterable[ChartCoverage]) -> Counts:
    return {
        chart.fingerprint: (
            tuple(min(item.count, FULL) for item in chart.states),
            tuple(min(item.count, FULL) for item in chart.transitions),
            tuple((d.false > 0, d.true > 0) for d in chart.decisions),
            tuple(tuple(outcomes for outcomes, _ in d.seen) for d in chart.decisions),
        )
        for chart in coverage
    }


def _reached(counts: Counts) -> int:
    return sum(str(part).count(", ") for parts in counts.values() for part in parts)


def difference(wanted: Counts, found: Counts) -> str:
    """Return the first part that differs."""
    for key, parts in wanted.items():
        names = ("states", "transitions", "decisions", "outcomes")
        for name, one, other in zip(names, parts, found.get(key, ((),) * 4), strict=True):
            if one != other:
                return f"{name} {one} became {other}"
    return f"{list(wanted)} became {list(found)}"


def is_expressible(chart: Chart) -> bool:
    """Whether Python and C can express a chart."""
    try:
        load_machine(chart, covered=True)
        load_classes([chart], covered=True, is_built=False)
    except FsmkitError as error:
        if not {d.rule.name for d in error.diagnostics} <= LIMITS:
            raise
        return False
    return True


@click.command()
@click.option("--charts", default=500, show_default=True)
@click.option("--seed", default=0, show_default=True)
@click.option("--first", default=0, show_default=True)
@click.option("--optimize", type=click.Choice(["size"]), help="Between them by default.")
def main(charts: int, seed: int, first: int, optimize: str | None) -> None:
    """Compare the counts of Python and C with those of the interpreter."""
    totals, wrong = Totals(), 0
    numbers = range(first, first + charts)
    for start in range(0, charts, BATCH):
        cases = [random_case(seed, number) for number in numbers[start : start + BATCH]]
        fitting = [case for case in cases if is_expressible(case.chart)]
        totals.rejected += len(cases) - len(fitting)
        for line in compared(fitting, totals, optimize or ""):
            wrong += 1
            click.echo(line)
    click.echo(
        f"{totals.charts} charts on python and c: {totals.items} items compared, "
        f"{wrong} differ, {totals.rejected} rejected"
    )
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
