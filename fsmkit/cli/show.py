"""``fsmkit show``: the chart as understood."""

from __future__ import annotations

from pathlib import Path

import click
from rich.tree import Tree

from fsmkit.cli.common.console import print_json, report, result, unwrapped
from fsmkit.cli.common.options import Reading, reading_options
from fsmkit.loading import elaborated
from fsmkit.plan.lower import lower
from fsmkit.system.reading import read_written, system_within
from fsmkit.system.system import System
from fsmkit.views.chart_json import chart_document
from fsmkit.views.chart_tree import chart_tree
from fsmkit.views.origins import origins
from fsmkit.views.plan_tree import plan_document, plan_tree
from fsmkit.views.system_tree import system_document, system_tree

EPILOG = """\b
Examples:
  fsmkit show feeder.yaml
  fsmkit show feeder.yaml --origin
  fsmkit show feeder.scxml --plan
"""


@click.command(epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--origin", is_flag=True, help="Say where each item comes from.")
@click.option("--plan", is_flag=True, help="Show what a machine executes, too.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@reading_options
def command(file: Path, origin: bool, plan: bool, as_json: bool, reading: Reading) -> int:
    """Show a chart as it is understood: inheritance resolved, names bound, types known.

    Inherited items are dim, overridden ones yellow.
    """
    findings = reading.findings()
    found = read_written(file, findings, {}, strict=reading.strict, parameters=reading.parameters)
    if not isinstance(found, tuple):
        report(findings)
        return _show_system(system_within(found), as_json=as_json)
    chart = elaborated(found, findings, strict=reading.strict)
    report(findings)
    where = origins(found)
    if as_json:
        lowered = {"plan": plan_document(lower(chart))} if plan else {}
        print_json({**chart_document(chart, where), **lowered})
        return 0
    print_tree(chart_tree(chart, where, with_origin=origin))
    if plan:
        print_tree(plan_tree(lower(chart)))
    return 0


def _show_system(system: System, *, as_json: bool) -> int:
    if as_json:
        print_json(system_document(system))
    else:
        print_tree(system_tree(system))
    return 0


def print_tree(tree: Tree) -> None:
    """Print a tree: wrapped on a terminal, a line an item in a pipe."""
    if result.is_terminal:
        result.print(tree, soft_wrap=False)
    else:
        unwrapped.print(tree)
