"""The differential test: every target behaves like the interpreter, on random charts.

``python -m devtools.differential --charts 1000 --seed 0`` is the long run. A chart is a function
of the seed and its number, so that a divergence can be repeated: ``--first 537 --charts 1``. The
variable CC names the C compiler: with ``CC=tcc`` charts in C take a third of the time. With
``CC="clang -fsanitize=undefined -fno-sanitize-recover=all"`` undefined behaviour is a divergence.
Targets such as ``c-powerpc`` are C on another processor (`devtools.processors`).
"""

from __future__ import annotations

import os
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import zip_longest

import click
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from devtools.random_charts.charts import random_document, random_family
from devtools.random_charts.choices import Choices, SeededChoices
from devtools.random_charts.ecmascript import random_ecmascript
from devtools.random_charts.invoking import random_invoking
from devtools.random_charts.scripts import random_script
from devtools.reduction import Documents, Script, reduce_example
from devtools.runtimes import harness, harnesses
from devtools.runtimes import runtimes as named
from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, FsmkitError, Severity
from fsmkit.document.document import Document
from fsmkit.document.front_ends import FrontEnd
from fsmkit.plugins import plugin
from fsmkit.testing.harness.harness import INTERPRETER, Harness, Runtime

BATCH = 25
"""Charts that one process generates, builds and compares at a time."""
CONTEXT = 8
"""Lines of the trace shown before the first that differs."""
LIMITS = frozenset(
    {
        "abstract-chart",
        "c-limit",
        "javascript-sometimes",
        "python-sometimes",
        "target-limit",
        "transitions-limit",
    }
)
"""The rules by which a target rejects a chart; any other error is a fault of the target."""

Trace = Sequence[str]


@dataclass(frozen=True, slots=True)
class Case:
    """A chart, its documents and its script."""

    documents: Documents
    """The chart as written, and after it those it extends, nearest first."""
    chart: Chart
    script: Script
    name: str = "example"


@dataclass(frozen=True, slots=True)
class Divergence:
    """The first line in which a target differs from the interpreter."""

    target: str
    line: int
    expected: str
    got: str
    before: tuple[str, ...] = ()

    def __str__(self) -> str:
        context = "".join(f"    {line}\n" for line in self.before)
        return (
            f"line {self.line + 1} of the trace differs\n{context}"
            f"  interpreter: {self.expected}\n  {self.target}: {self.got}"
        )


@dataclass
class Totals:
    """The figures of a run."""

    charts: int = 0
    macrosteps: int = 0
    rejected: int = 0
    """Charts that a target cannot express."""
    divergences: list[tuple[str, Divergence]] = field(default_factory=list)

    def add(self, other: Totals) -> None:
        """Add the figures of another process."""
        self.charts += other.charts
        self.macrosteps += other.macrosteps
        self.rejected += other.rejected
        self.divergences += other.divergences


def random_case(
    seed: int, number: int, *, is_saved: bool = False, has_functions: bool = False
) -> Case:
    """Return one example; the same for the same seed and number."""
    choices = SeededChoices(f"{seed}:{number}")
    documents = (
        (random_document(choices, has_functions=True),)
        if has_functions
        else random_documents(choices)
    )
    chart = elaborated(documents)
    script = random_script(choices, chart, is_saved=is_saved)
    return Case(documents, chart, script, f"chart {number} of seed {seed}")


def random_documents(choices: Choices) -> Documents:
    """Return a chart of any kind, with those it extends."""
    kind = choices.integer(0, 9)
    if kind == 4:
        return (random_invoking(choices),)
    if kind in (5, 6):
        return random_family(choices)
    if kind >= 7:
        return (random_ecmascript(choices),)
    return (random_document(choices),)


def elaborated(documents: Documents) -> Chart:
    """Return the chart of random documents, which has no errors by construction."""
    findings = Findings()
    chart = elaborate(documents, findings)
    findings.stop_on_errors()
    if chart is None:
        raise FsmkitError(findings)
    return chart


def first_difference(target: str, expected: Trace, got: Trace) -> Divergence | None:
    """Return where two traces part, if they do."""
    for place, (a, b) in enumerate(zip_longest(expected, got, fillvalue="(the end)")):
        if a != b:
            before = tuple(expected[max(0, place - CONTEXT) : place])
            return Divergence(target, place, a, b, before)
    return None


def compare(case: Case, target: Harness) -> Divergence | None:
    """Run a case on the interpreter and on a target; where they part, if they do."""
    expected = INTERPRETER.run(case.chart, case.script)
    return first_difference(target.name, expected, _attempt(target, case))


def compare_all(cases: Sequence[Case], targets: Sequence[Harness]) -> Totals:
    """Compare several cases on several targets, in batches where a target likes that."""
    totals = Totals(charts=len(cases))
    expected = [_attempt(INTERPRETER, case) for case in cases]
    for trace in expected:
        totals.macrosteps += sum(line.startswith("@") for line in trace)
    for target in targets:
        for case, wanted, got in zip(cases, expected, traces_of(target, cases), strict=True):
            if got is None:
                totals.rejected += 1
                continue
            divergence = first_difference(target.name, wanted, got)
            if divergence is not None:
                totals.divergences.append((case.name, divergence))
    return totals


def traces_of(target: Harness, cases: Sequence[Case]) -> list[list[str] | None]:
    """Return the trace of each case on a target; None if the target rejects the chart."""
    if isinstance(target, Runtime):
        jobs = [(case.chart, case.script) for case in cases]
        try:
            return list(target.run_many(jobs))
        except FsmkitError:  # one of them: find out which
            pass
    return [_attempt_or_reject(target, case) for case in cases]


def _attempt_or_reject(target: Harness, case: Case) -> list[str] | None:
    try:
        return target.run(case.chart, case.script)
    except FsmkitError as error:
        rules = {d.rule.name for d in error.diagnostics if d.severity is Severity.ERROR}
        return None if rules <= LIMITS else [f"(rejected: {error})"]
    except Exception:  # noqa: BLE001  (any exception is a divergence)
        return [f"(crashed: {traceback.format_exc(limit=-3)})"]


def _attempt(target: Harness, case: Case) -> list[str]:
    return _attempt_or_reject(target, case) or []


def written(document: Document) -> str:
    """Return a document as YAML, the shorter notation to read."""
    return plugin(FrontEnd, "yaml").write(document)


def explain(case: Case, divergence: Divergence) -> str:
    """Return everything needed to look into a divergence."""
    script = "\n".join(case.script)
    text = "\n--- extends\n".join(written(document) for document in case.documents)
    return f"{case.name}\n\n{text}\n--- script\n{script}\n---\n{divergence}"


def reduce_case(case: Case, target: Harness, budget: int = 3000) -> tuple[Case, Divergence | None]:
    """Return a smaller case on which the target still diverges; a rejection is no divergence."""

    def attempt(documents: Documents, script: Script) -> Divergence | None:
        try:
            smaller = Case(documents, elaborated(documents), script)
            expected = INTERPRETER.run(smaller.chart, script)
        except FsmkitError:  # no valid chart, or a script that is not one for it
            return None
        got = _attempt_or_reject(target, smaller)
        return None if got is None else first_difference(target.name, expected, got)

    documents, script = reduce_example(
        case.documents, case.script, lambda d, s: attempt(d, s) is not None, budget
    )
    small = Case(documents, elaborated(documents), script, f"{case.name}, reduced")
    return small, compare(small, target)


# --- the long run -----------------------------------------------------------------------------


def run_batch(
    seed: int,
    numbers: Sequence[int],
    targets: Sequence[str],
    *,
    is_saved: bool = False,
    has_functions: bool = False,
) -> Totals:
    """Compare some charts of a seed, as one task of a process."""
    cases = [
        random_case(seed, number, is_saved=is_saved, has_functions=has_functions)
        for number in numbers
    ]
    return compare_all(cases, [harness(name) for name in targets])


def run_many(
    seed: int,
    first: int,
    charts: int,
    targets: Sequence[str],
    processes: int,
    *,
    is_saved: bool = False,
    has_functions: bool = False,
) -> Iterator[Totals]:
    """Yield the figures of each batch as it ends."""
    numbers = range(first, first + charts)
    batches = [numbers[start : start + BATCH] for start in range(0, charts, BATCH)]
    run = partial(run_batch, is_saved=is_saved, has_functions=has_functions)
    if processes == 1:
        yield from (run(seed, batch, targets) for batch in batches)
        return
    with ProcessPoolExecutor(processes) as pool:
        yield from pool.map(run, [seed] * len(batches), batches, [targets] * len(batches))


def target_names() -> tuple[str, ...]:
    """Return the names of all targets that have a harness."""
    return tuple(h.name for h in harnesses() if h.name != "interpreter")


@click.command()
@click.option("--charts", default=1000, show_default=True, help="How many random charts.")
@click.option("--seed", default=0, show_default=True, help="Which thousand.")
@click.option("--first", default=0, show_default=True, help="The number of the first chart.")
@click.option(
    "--targets", callback=named, help="Names separated by commas (default: all with a harness)."
)
@click.option("--processes", default=min(2, os.cpu_count() or 1), show_default=True)
@click.option("--functions", is_flag=True, help="Charts with functions and local variables.")
@click.option("--saved", is_flag=True, help="Scripts that save and restore the machine.")
@click.option("--no-reduce", is_flag=True, help="Show a divergence as it was found.")
def main(
    charts: int,
    seed: int,
    first: int,
    targets: tuple[str, ...],
    processes: int,
    *,
    functions: bool,
    saved: bool,
    no_reduce: bool,
) -> None:
    """Compare every target with the interpreter on random charts."""
    names = targets or target_names()
    totals = Totals()
    began = time.monotonic()
    with _progress() as progress:
        task = progress.add_task(f"{', '.join(names)} against the interpreter", total=charts)
        with suppress(KeyboardInterrupt):  # report the comparisons so far
            for part in run_many(
                seed, first, charts, names, processes, is_saved=saved, has_functions=functions
            ):
                totals.add(part)
                progress.update(task, completed=totals.charts)
    seconds = time.monotonic() - began
    click.echo(
        f"{totals.charts} charts on {', '.join(names)}: {totals.macrosteps} macrosteps compared, "
        f"{len(totals.divergences)} divergences, {totals.rejected} rejected, {seconds:.1f} s"
    )
    draw = partial(random_case, seed, is_saved=saved, has_functions=functions)
    _show(totals.divergences, draw, no_reduce=no_reduce)
    sys.exit(130 if totals.charts < charts else 1 if totals.divergences else 0)


def _show(
    divergences: Iterable[tuple[str, Divergence]],
    draw: Callable[[int], Case],
    *,
    no_reduce: bool,
) -> None:
    found = list(divergences)
    for name, divergence in found[1:10]:
        click.echo(f"{name}: {divergence.target} {divergence.expected!r} {divergence.got!r}")
    for name, divergence in found[:1]:
        case = draw(int(name.split()[1]))
        small, shown = case, divergence
        if not no_reduce:
            small, less = reduce_case(case, harness(divergence.target))
            shown = less or divergence
        click.echo(explain(small, shown))


def _progress() -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        transient=True,
    )


if __name__ == "__main__":
    main()
