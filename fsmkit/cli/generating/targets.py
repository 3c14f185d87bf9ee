"""``fsmkit targets``: list the targets."""

from __future__ import annotations

import click
from rich.markup import escape

from fsmkit.chart.drawing.drawing import Drawing
from fsmkit.cli.common.console import print_json, result
from fsmkit.cli.common.verbs import verb
from fsmkit.codegen.target import Target
from fsmkit.document.front_ends import FrontEnd, Reader
from fsmkit.plugins import plugins

EPILOG = """\b
Example:
  fsmkit targets
"""


@verb(EPILOG)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def command(as_json: bool) -> int:
    """List the targets of `compile`, and all notations."""
    targets = plugins(Target)
    notations = plugins(FrontEnd)
    read_only = tuple(r for r in plugins(Reader) if not isinstance(r, FrontEnd))
    drawings = plugins(Drawing)
    if as_json:
        print_json(
            {
                "targets": [{"name": t.name, "summary": t.summary} for t in targets],
                "notations": [{"name": n.name, "suffixes": list(n.suffixes)} for n in notations],
                "read": [{"name": r.name, "suffixes": list(r.suffixes)} for r in read_only],
                "drawings": [{"name": d.name, "suffixes": list(d.suffixes)} for d in drawings],
            }
        )
        return 0
    lines = [
        *(("compile --target", t.name, t.summary) for t in targets),
        *(("convert --to", n.name, f"charts in {_list(n.suffixes)}") for n in notations),
        *(("reads", r.name, f"machines in {_list(r.suffixes)}") for r in read_only),
        *(("draw --out", d.name, f"diagrams in {_list(d.suffixes)}") for d in drawings),
    ]
    for each, name, summary in lines:
        result.print(f"{each:17} [bold]{name:12}[/] {escape(summary)}")
    return 0


def _list(suffixes: tuple[str, ...]) -> str:
    return " or ".join(suffixes)
