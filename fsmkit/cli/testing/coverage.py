"""``fsmkit coverage``: print and write reports of test coverage."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import click
from rich.markup import escape
from rich.table import Table

import fsmkit
from fsmkit.cli.common.console import out, print_json, result
from fsmkit.cli.common.options import path_option
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.system.any_file import load_any
from fsmkit.system.views.drawing import draw
from fsmkit.testing.coverage import reports
from fsmkit.testing.coverage.counters import read_counters
from fsmkit.testing.coverage.page import page
from fsmkit.testing.coverage.record import FOLDER, ChartCoverage, erase, load, save
from fsmkit.testing.coverage.reports import Figure, figures, missing, total

EPILOG = """\b
Examples:
  fsmkit test --cov && fsmkit coverage --missing
  fsmkit coverage -o coverage.html
  fsmkit coverage -o charts.info          (LCOV)
  fsmkit coverage -o coverage.xml         (Cobertura)
  fsmkit coverage --against before.json
  fsmkit coverage --add gate.yaml uart.bin   (counters of generated code)
  fsmkit coverage --only-reachable plant.yaml
"""
SUFFIXES = (".html", ".info", ".xml")


@verb(EPILOG)
@click.argument("folder", type=click.Path(path_type=Path), default=FOLDER)
@click.option("--missing", "is_listing", is_flag=True, help="List what is not covered.")
@path_option(
    "-o",
    "--out",
    "files",
    multiple=True,
    help="Write a page (.html), LCOV (.info) or Cobertura (.xml); repeatable.",
)
@path_option(
    "--against",
    help="Compare with these counts; exit with 1 if something is lost.",
)
@path_option(
    "--add",
    "counted",
    multiple=True,
    nargs=2,
    metavar="CHART DATA",
    help="Add counters of generated code (`compile --with coverage`); repeatable.",
)
@path_option(
    "--only-reachable",
    "proofs",
    multiple=True,
    metavar="FILE",
    help="Omit the unreachable items of this chart or system; repeatable.",
)
@click.option(
    "--fail-under", type=click.FloatRange(0, 100), help="Exit with 1 below this percentage."
)
@click.option("--erase", "is_erasing", is_flag=True, help="Remove the counts, and do nothing else.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def command(
    folder: Path,
    is_listing: bool,
    files: tuple[Path, ...],
    against: Path | None,
    counted: tuple[tuple[Path, Path], ...],
    proofs: tuple[Path, ...],
    fail_under: float | None,
    is_erasing: bool,
    as_json: bool,
) -> int:
    """Report the coverage of tests.

    Counts states, transitions, decisions and conditions. `fsmkit test --cov` and `pytest
    --fsmkit-cov` write the counts into `.fsmkit-coverage`.
    """
    for file in files:
        if file.suffix not in SUFFIXES:
            known = ", ".join(SUFFIXES)
            raise click.UsageError(f"`{file.suffix}` is not a suffix of a report: {known}")
    if is_erasing:
        erase(folder)
        return 0
    for source, data in counted:
        machines = load_any(source, Findings()).machines
        save(read_counters(data, [machine.chart for machine in machines]), folder)
    charts, told = _reachable(load(folder), proofs)
    write_files({file: _written(charts, file.suffix) for file in files})
    for file in files:
        out.print(f"wrote {file}", markup=False)
    whole = total(charts).whole
    lost, won = _changes(charts, against)
    if as_json:
        found: dict[str, object] = {
            "charts": [_document(chart) for chart in charts],
            "percent": whole.percent,
        }
        if proofs:
            found["out_of_reach"] = told
        print_json({**found, **({"lost": lost, "won": won} if against else {})})
    else:
        if not files:
            print_table(charts)
        listed = [f"{place}: {what}" for chart in charts for place, what in missing(chart)]
        changes = (*(f"+ {item}" for item in won), *(f"- {item}" for item in lost))
        for line in (*told, *(listed if is_listing else ()), *changes):
            result.print(line, markup=False, highlight=False, soft_wrap=True)
    return 1 if lost or whole.percent < (fail_under or 0) else 0


def _reachable(
    charts: tuple[ChartCoverage, ...], proofs: Sequence[Path]
) -> tuple[tuple[ChartCoverage, ...], tuple[str, ...]]:
    """Return coverage without items proved unreachable, and lines that name those."""
    if not proofs:
        return charts, ()
    from fsmkit.testing.coverage.reachable import (  # all of the explorer
        only_reachable,
        reachable_items,
    )

    findings = Findings()
    return only_reachable(
        charts, [found for proof in proofs for found in reachable_items(proof, findings)]
    )


def _written(charts: Sequence[ChartCoverage], suffix: str) -> str:
    match suffix:
        case ".info":
            return reports.lcov(charts)
        case ".xml":
            return reports.cobertura(charts, fsmkit.__version__, int(time.time() * 1000))
        case _:
            sources = {}
            for name in reports.lines(charts):
                with suppress(OSError, ValueError):  # the page has no source of a file that is gone
                    sources[name] = Path(name).read_text(encoding="utf-8")
            return page(charts, sources, _drawing)


def _changes(charts: Sequence[ChartCoverage], against: Path | None) -> tuple[list[str], list[str]]:
    """Return the items whose coverage was lost, and those newly covered."""
    if against is None:
        return [], []
    before, after = (
        {item for chart in each for item in reports.covered(chart)}
        for each in (load(against), charts)
    )
    return sorted(before - after), sorted(after - before)


def print_table(charts: Sequence[ChartCoverage]) -> None:
    """Print a line for each chart, and one for all."""
    table = Table(box=None, pad_edge=False)
    table.add_column("chart")
    for heading in ("states", "transitions", "decisions", "conditions", "all"):
        table.add_column(heading, justify="right")
    rows = [(chart.name, figures(chart)) for chart in charts]
    for name, row in (*rows, *([("all", total(charts))] if len(rows) > 1 else [])):
        kinds = row.states, row.transitions, row.decisions, row.conditions
        table.add_row(escape(name), *map(_cell, kinds), f"{row.whole.percent:.1f} %")
    result.print(table)


def _cell(figure: Figure) -> str:
    return f"{figure.covered} of {figure.all}"


def _document(chart: ChartCoverage) -> dict[str, object]:
    own = figures(chart)
    return {
        "chart": chart.name,
        "file": chart.file,
        "percent": own.whole.percent,
        **{
            name: {"covered": figure.covered, "all": figure.all}
            for name, figure in (
                ("states", own.states), ("transitions", own.transitions),
                ("decisions", own.decisions), ("conditions", own.conditions),
            )
        },
        "missing": [f"{place}: {what}" for place, what in missing(chart)],
    }  # fmt: skip


def _drawing(chart: ChartCoverage) -> str:
    """Return the drawing of a chart that is as it was run; nothing without Graphviz."""
    try:
        machines = load_any(Path(chart.file), Findings()).machines
        if len(machines) != 1 or fingerprint(machines[0].chart) != chart.fingerprint:
            return ""
        drawn = draw(machines[0].chart, Path("drawing.svg"))
    except FsmkitError:
        return ""
    return drawn.decode() if isinstance(drawn, bytes) else drawn
