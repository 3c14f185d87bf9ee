"""``fsmkit latency``: report how late the cycles of real-time loops started."""

from __future__ import annotations

from pathlib import Path

import click
from rich.markup import escape
from rich.table import Table

from fsmkit.cli.common.console import print_json, result
from fsmkit.cli.common.options import path_option
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.runtime.latency import PERCENTILES, Latency, draw_latencies, read_latency

EPILOG = """\b
Examples:
  fsmkit latency report.json
  fsmkit latency report.json cyclictest.json --out late.svg
"""
PICTURES = (".svg", ".png", ".pdf")


@verb(EPILOG)
@click.argument(
    "files", nargs=-1, required=True, metavar="FILE...", type=click.Path(path_type=Path)
)
@path_option(
    "-o",
    "--out",
    help="Draw the distributions into this file: svg, png or pdf.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def command(files: tuple[Path, ...], out: Path | None, as_json: bool) -> int:
    """Compare the jitter of real-time loops.

    Prints percentiles, overruns and their reasons. A FILE is the JSON of `fsm_posix_print_json`
    or of `cyclictest --json`.
    """
    if out is not None and out.suffix not in PICTURES:
        raise click.UsageError(f"--out is one of {', '.join(PICTURES)}")
    reports = [read_latency(path) for path in files]
    if out is not None:
        write_files({out: draw_latencies(reports, out.suffix[1:])})
    if as_json:
        print_json({"reports": [_as_json(report) for report in reports]})
        return 0
    table = Table(box=None, pad_edge=False)
    table.add_column("late by, µs")
    for heading in ("cycles", *(f"p{p / 100:g}" for p in PERCENTILES), "max", "overruns"):
        table.add_column(heading, justify="right")
    for report in reports:
        late = (*map(report.percentile, PERCENTILES), report.worst)
        table.add_row(
            escape(report.name),
            f"{report.cycles:,}",
            *(f"{ns / 1000:,.1f}" for ns in late),
            "" if report.overruns is None else f"{report.overruns:,}",
        )
    result.print(table)
    for report in reports:
        if report.reasons:
            reasons = ", ".join(f"{reason} {count:,}" for reason, count in report.reasons)
            result.print(escape(f"overruns of {report.name}: {reasons}"))
    return 0


def _as_json(report: Latency) -> dict[str, object]:
    return {
        "name": report.name,
        "cycles": report.cycles,
        "late_ns": {f"p{p / 100:g}": report.percentile(p) for p in PERCENTILES},
        "worst_ns": report.worst,
        "overruns": report.overruns,
        "reasons": dict(report.reasons),
    }
