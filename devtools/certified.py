"""Certify many charts and print a table: ``python -m devtools.certified machines docs``.

Takes files and folders: charts in YAML and SCXML, and those that a page of the documentation lets
its reader write. Abstract charts and files that are no charts are omitted. Every other chart
ends with a certificate or with a finding.
"""

from __future__ import annotations

import re
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import click

from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.any_file import read_chart
from fsmkit.verify.certify.certify import certify
from fsmkit.verify.certify.comparison import LIMIT, Request

SUFFIXES = (".yaml", ".yml", ".scxml")
CHART = re.compile(rb"^chart:|<scxml\b", re.MULTILINE)
WRITTEN = re.compile(
    r"[Pp]ut\s+this\s+into\s+`([\w.]+)`[^\n]*:\s*\n```\w+\n(.*?)^```$", re.MULTILINE | re.DOTALL
)
HEAD = ("chart", "result", "states", "steps", "classes", "s", "worst instructions", "worst stack")


@click.command()
@click.argument("paths", nargs=-1, required=True, type=click.Path(path_type=Path, exists=True))
@click.option("--cc", default="", help="The compiler with its flags (default: this computer's).")
@click.option("--limit", default=LIMIT, show_default=True, help="Steps of each chart.")
@click.option("--timeout", default=60.0, show_default=True, help="Seconds for each chart.")
@click.option("--omit", multiple=True, help="Omit paths with this name in them; repeatable.")
def main(
    paths: tuple[Path, ...], cc: str, limit: int, timeout: float, omit: tuple[str, ...]
) -> None:
    """Certify charts and print a line for each."""
    request = Request(tuple(cc.split()), limit=limit, timeout=timeout)
    click.echo(f"| {' | '.join(HEAD)} |\n|{'---|' * len(HEAD)}")
    with tempfile.TemporaryDirectory(prefix="fsmkit-certified-") as name:
        for label, file in charts(paths, omit, Path(name)):
            row = certified(file, request)
            if row is not None:
                click.echo(f"| {label} | {' | '.join(row)} |")


def charts(paths: Sequence[Path], omit: Sequence[str], folder: Path) -> Iterator[tuple[str, Path]]:
    """Yield the charts in files and folders with their labels; those of pages in a folder."""
    for path in paths:
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            if any(name in file.parts for name in omit):
                continue
            if file.suffix in SUFFIXES:
                yield str(file), file
            elif file.suffix == ".md":
                own = folder / "_".join(file.with_suffix("").parts)
                own.mkdir()
                written = {own / name: text for name, text in WRITTEN.findall(file.read_text())}
                for target, text in written.items():
                    target.write_text(text, encoding="utf-8")
                for target in written:
                    if target.suffix in SUFFIXES:
                        yield f"{file}: {target.name}", target


def certified(file: Path, request: Request) -> list[str] | None:
    """Return the cells of a chart; None for an abstract one and for a file that is no chart."""
    if not CHART.search(file.read_bytes()):
        return None
    started = time.process_time()
    try:
        document = certify(read_chart(file, Findings()), request)
    except FsmkitError as error:
        found = error.diagnostics[0]
        if found.rule.name in ("abstract-chart", "not-a-chart"):
            return None
        return [f"{found.rule.name}: {found.message}", *[""] * (len(HEAD) - 2)]
    return [
        "; ".join([document["result"], *document["reasons"]]),
        f"{document['states']:,}",
        f"{document['steps']:,}",
        f"{document['classes']:,}",
        f"{time.process_time() - started:.1f}",
        worst(document, "instructions"),
        worst(document, "stack"),
    ]


def worst(document: dict[str, Any], what: str) -> str:
    """Return the greatest number of all events and timeouts, and the step that has it."""
    rows = [row for row in document["maxima"] if row["step"] != "post several events"]
    if not rows:
        return ""
    row = max(rows, key=lambda row: int(row[what]))
    return f"{row[what]:,} ({row['step']})"


if __name__ == "__main__":
    main()
