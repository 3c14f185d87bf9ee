"""``fsmkit coverage``: figures and reports of what tests reached."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import click
from rich.markup import escape
from rich.table import Table

import fsmkit
from fsmkit.cli.console import out, print_json, result
from fsmkit.cli.writing import write_files
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.system.drawing import draw
from fsmkit.system.reading import load_any
from fsmkit.testing.coverage import reports
from fsmkit.testing.coverage.page import page
from fsmkit.testing.coverage.record import FOLDER, ChartCoverage, erase, load
from fsmkit.testing.coverage.reports import Figure, figures, missing, total

EPILOG = """\b
Examples:
  fsmkit test --cov && fsmkit coverage report
  fsmkit coverage html --out coverage.html
  fsmkit coverage lcov --out charts.info
  fsmkit coverage diff before.json .fsmkit-coverage
"""
FROM = click.argument("folder", type=click.Path(path_type=Path), default=FOLDER)


@click.group(epilog=EPILOG)
def command() -> None:
    """Report the states, transitions, decisions and conditions that tests reached.

    `fsmkit test --cov` and `pytest --fsmkit-cov` write the counts to `.fsmkit-coverage`.
    """


@command.command("report")
@FROM
@click.option("--missing", "is_listing", is_flag=True, help="List what is not covered.")
@click.option("--fail-under", type=click.FloatRange(0, 100), help="Exit code 1 if it is less.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def report_command(folder: Path, is_listing: bool, fail_under: float | None, as_json: bool) -> int:
    """Print a table of what is covered of each chart."""
    charts = load(folder)
    whole = total(charts).whole
    if as_json:
        print_json({"charts": [_document(chart) for chart in charts], "percent": whole.percent})
    else:
        print_table(charts)
        for chart in charts if is_listing else ():
            for place, what in missing(chart):
                result.print(f"{place}: {what}", markup=False, highlight=False, soft_wrap=True)
    return 1 if whole.percent < (fail_under or 0) else 0


@command.command("html")
@FROM
@click.option("--out", "-o", "file", type=click.Path(path_type=Path), default="coverage.html")
def html_command(folder: Path, file: Path) -> int:
    """Write a page with the figures, the drawings in colours and the sources with counts."""
    charts = load(folder)
    sources = {}
    for name in reports.lines(charts):
        try:
            sources[name] = Path(name).read_text(encoding="utf-8")
        except (OSError, ValueError):
            continue  # the page has no source of a file that is gone
    write_files({file: page(charts, sources, _drawing)})
    out.print(f"wrote {file}", markup=False)
    return 0


@command.command("lcov")
@FROM
@click.option("--out", "-o", "file", type=click.Path(path_type=Path), default="charts.info")
def lcov_command(folder: Path, file: Path) -> int:
    """Write a tracefile of LCOV, by the lines of charts."""
    write_files({file: reports.lcov(load(folder))})
    out.print(f"wrote {file}", markup=False)
    return 0


@command.command("cobertura")
@FROM
@click.option("--out", "-o", "file", type=click.Path(path_type=Path), default="coverage.xml")
def cobertura_command(folder: Path, file: Path) -> int:
    """Write a report of Cobertura, by the lines of charts."""
    written = reports.cobertura(load(folder), fsmkit.__version__, int(time.time() * 1000))
    write_files({file: written})
    out.print(f"wrote {file}", markup=False)
    return 0


@command.command("diff")
@click.argument("before", type=click.Path(path_type=Path))
@click.argument("after", type=click.Path(path_type=Path))
def diff_command(before: Path, after: Path) -> int:
    """List what one run covers and another does not; exit code 1 if something is lost."""
    first, second = (
        {(place, what) for chart in load(path) for place, what in missing(chart)}
        for path in (before, after)
    )
    for mark, items in (("+", first - second), ("-", second - first)):
        for place, what in sorted(items):
            result.print(f"{mark} {place}: {what}", markup=False, highlight=False, soft_wrap=True)
    return 1 if second - first else 0


@command.command("erase")
@FROM
def erase_command(folder: Path) -> int:
    """Remove the counts."""
    erase(folder)
    return 0


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
