"""``fsmkit draw``: a diagram of a chart."""

from __future__ import annotations

import subprocess
import sys
from difflib import get_close_matches
from pathlib import Path

import click

from fsmkit.chart.chart import Chart
from fsmkit.cli._options import Reading, option_value, reading_options
from fsmkit.cli.console import print_json, report
from fsmkit.cli.writing import write_files
from fsmkit.diagnostics import fail
from fsmkit.loading import load_with_findings
from fsmkit.plugins import Drawing, plugin, plugin_for, plugins

IMAGES = (".svg", ".png", ".pdf")
EPILOG = """\b
Examples:
  fsmkit draw feeder.yaml --out feeder.svg
  fsmkit draw feeder.yaml --out feeder.png --out feeder.mmd --active pushing
  fsmkit draw feeder.yaml                     (prints the text for Graphviz)
"""


@click.command(epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--out",
    "outputs",
    multiple=True,
    type=click.Path(path_type=Path),
    help="A file: svg, png, pdf, dot, mmd or puml. May be given several times.",
)
@click.option("--active", default="", metavar="A,B", help="States to mark as active.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@reading_options
def command(
    file: Path, outputs: tuple[Path, ...], active: str, as_json: bool, reading: Reading
) -> int:
    """Draw a chart: inherited items grey, active states filled, watchdogs dashed.

    Graphviz makes the pictures; the texts for Graphviz, Mermaid and PlantUML need nothing else.
    """
    with option_value():
        for path in outputs:
            check_suffix(path)
    findings = reading.findings()
    chart = load_with_findings(file, findings, strict=reading.strict)
    with option_value():
        marked = states_named(chart, active)
    report(findings)
    text = plugin(Drawing, "dot").draw(chart, marked)
    write_files({path: drawing(chart, marked, path) for path in outputs})
    if as_json:
        shown = {"files": [str(path) for path in outputs]} if outputs else {"dot": text}
        print_json({"chart": chart.name, **shown})
    elif not outputs:
        sys.stdout.write(text)
    return 0


def check_suffix(path: Path) -> None:
    """Raise a diagnostic where the suffix of a file tells no way to draw."""
    known = (*IMAGES, *(suffix for one in plugins(Drawing) for suffix in one.suffixes))
    if path.suffix.lower() not in known:
        raise fail(
            "unknown-suffix",
            f"the suffix `{path.suffix}` of `{path.name}` tells no kind of drawing",
            help=f"use one of {', '.join(known)}",
        )


def states_named(chart: Chart, names: str) -> frozenset[int]:
    """Return the states of a list of names and all around them."""
    found: set[int] = set()
    for name in filter(None, (part.strip() for part in names.split(","))):
        if name not in chart.state_index:
            close = get_close_matches(name, chart.state_index, 1)
            raise fail(
                "unknown-name",
                f"`{chart.name}` has no state `{name}`",
                help=f"did you mean `{close[0]}`?" if close else "see `fsmkit show` for the names",
            )
        state = chart.state_index[name]
        found |= {state, *chart.ancestors(state)}
    return frozenset(found)


def drawing(chart: Chart, active: frozenset[int], path: Path) -> str | bytes:
    """Return the content of a file of a drawing, by its suffix."""
    if path.suffix.lower() not in IMAGES:
        return plugin_for(Drawing, path).draw(chart, active)
    return picture(plugin(Drawing, "dot").draw(chart, active), path.suffix.lower()[1:])


def picture(text: str, kind: str) -> bytes:
    """Return the picture that Graphviz makes of a text: ``svg``, ``png`` or ``pdf``."""
    import graphviz

    try:
        return bytes(graphviz.Source(text).pipe(format=kind, quiet=True))
    except graphviz.ExecutableNotFound as error:
        raise fail(
            "missing-graphviz",
            f"Graphviz's `dot` is not installed, so there is no {kind.upper()}",
            help="install graphviz (`make tools`), or draw `.mmd`, `.puml` or `.dot`",
        ) from error
    except (subprocess.SubprocessError, OSError) as error:
        told = (getattr(error, "stderr", None) or b"").decode(errors="replace").strip()
        raise fail(
            "drawing-failed",
            f"`dot` did not draw it: {told.splitlines()[0] if told else error}",
            help="draw `.dot` and look at it, and report this",
        ) from error
