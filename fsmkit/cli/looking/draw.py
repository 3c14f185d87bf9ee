"""``fsmkit draw``: a diagram of a chart, or of the machines of a system."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from fsmkit.cli.common.console import print_json, report
from fsmkit.cli.common.options import Reading, option_value, path_option, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.watching import watched
from fsmkit.cli.common.writing import write_files
from fsmkit.system.any_file import read, system_within
from fsmkit.system.views.drawing import (
    draw,
    folds_named,
    require_copies,
    require_suffix,
    states_named,
)

EPILOG = """\b
Examples:
  fsmkit draw feeder.yaml --out feeder.svg
  fsmkit draw feeder.yaml --out feeder.png --out feeder.mmd --active pushing
  fsmkit draw feeder.yaml                     (prints the text for Graphviz)
  fsmkit draw feeder.yaml --fold homing,working --out feeder.svg
  fsmkit draw press.yaml --out press.svg --unfold left
  fsmkit draw cell.yaml --out cell.svg        (machines and connections)
"""


@verb(EPILOG, Model=("parameters",))
@click.argument("file", type=click.Path(path_type=Path))
@path_option(
    "-o",
    "--out",
    "outputs",
    multiple=True,
    help="Write a file: svg, png, pdf, dot, mmd or puml; repeatable.",
)
@click.option("--active", default="", metavar="A,B", help="Mark these states as active.")
@click.option(
    "--fold",
    default="",
    metavar="A,B",
    help="Draw these composite states as closed boxes; `*`: all.",
)
@click.option(
    "--unfold",
    multiple=True,
    metavar="COPY",
    help="Draw this copy of a used chart whole; `all`: every one; repeatable.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@watched
@reading_options
def command(
    file: Path,
    outputs: tuple[Path, ...],
    active: str,
    fold: str,
    unfold: tuple[str, ...],
    as_json: bool,
    reading: Reading,
) -> int:
    """Draw a chart or a system.

    In a chart, inherited items are grey, active states filled and watchdogs dashed. In a system,
    events are solid arrows, levels dashed ones, and machines of the environment grey. For a
    deployment, the nodes are drawn, too. Only png and pdf need an installed Graphviz.
    """
    with option_value():
        for path in outputs:
            require_suffix(path)
    findings = reading.findings()
    model = read(file, findings, strict=reading.strict, parameters=reading.parameters)
    with option_value():
        marked = states_named(model, _listed(active))
        folds = folds_named(model, _listed(fold))
        require_copies(model, unfold)
    report(findings)
    text = str(draw(model, Path("text.dot"), marked, unfold, folds))
    write_files({path: draw(model, path, marked, unfold, folds) for path in outputs})
    if as_json:
        shown = {"files": [str(path) for path in outputs]} if outputs else {"dot": text}
        print_json({"chart": system_within(model).name, **shown})
    elif not outputs:
        sys.stdout.write(text)
    return 0


def _listed(text: str) -> list[str]:
    return [name for name in map(str.strip, text.split(",")) if name]
