"""``fsmkit show``: the chart as understood."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click
from rich.tree import Tree

from fsmkit.chart.loading import elaborated
from fsmkit.chart.views.chart_json import chart_document
from fsmkit.chart.views.chart_tree import chart_tree
from fsmkit.chart.views.origins import origins
from fsmkit.cli.common.console import print_json, progress, report, result, unwrapped
from fsmkit.cli.common.options import Reading, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.plan.lower import lower
from fsmkit.plan.tree import plan_document, plan_tree
from fsmkit.system.any_file import read_sources, system_within
from fsmkit.system.system import System
from fsmkit.system.views.system_tree import system_document, system_tree

EPILOG = """\b
Examples:
  fsmkit show feeder.yaml
  fsmkit show feeder.yaml --origin
  fsmkit show feeder.scxml --plan
"""


@verb(EPILOG, Model=("parameters",))
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--origin", is_flag=True, help="Print where each item is defined.")
@click.option("--plan", is_flag=True, help="Print what the generated machine executes, too.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@reading_options
def command(file: Path, origin: bool, plan: bool, as_json: bool, reading: Reading) -> int:
    """Show a chart as it is understood.

    Inheritance is resolved, names are bound and types known. Inherited items are dim, overridden
    ones yellow.
    """
    findings, strict = reading.findings(), reading.strict
    with progress(f"reading {file.name}", is_quiet=as_json):
        written = read_sources(file, findings, {}, strict=strict, parameters=reading.parameters)
        if isinstance(written, tuple):
            chart, where = elaborated(written, findings, strict=strict), origins(written)
    report(findings)
    if not isinstance(written, tuple):
        return _show_system(system_within(written), as_json=as_json)
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
    elif unwrapped.console.color_system is not None:
        unwrapped.print(tree)
    else:
        for line in tree_lines(tree, is_ascii=unwrapped.console.options.ascii_only):
            result.print(line, markup=False)


def tree_lines(tree: Tree, *, is_ascii: bool = False) -> Iterator[str]:
    """Yield the lines of a tree as rich prints it without colours and without a limit of width.

    Rich takes a millisecond for each line: a minute for the largest charts.
    """
    guides = Tree.ASCII_GUIDES if is_ascii else Tree.TREE_GUIDES[0]
    space, straight, fork, end = (str(guide) for guide in guides)
    waiting = [(tree, "", "")]
    while waiting:
        node, first, margin = waiting.pop()
        for number, line in enumerate(str(node.label).expandtabs(8).split("\n")):
            yield f"{margin if number else first}{line}"
        last = len(node.children) - 1
        waiting += (
            (
                child,
                margin + (end if place == last else fork),
                margin + (space if place == last else straight),
            )
            for place, child in reversed(tuple(enumerate(node.children)))
        )
