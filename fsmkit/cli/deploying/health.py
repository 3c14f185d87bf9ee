"""``fsmkit health``: how the nodes of a deployment are."""

from __future__ import annotations

from pathlib import Path

import click
from rich.markup import escape
from rich.table import Table

import fsmkit
from fsmkit.cli.common.console import print_json, result
from fsmkit.cli.common.options import read_span
from fsmkit.cli.common.verbs import verb
from fsmkit.diagnostics import fail
from fsmkit.emit import plain
from fsmkit.emit.lines import one_line
from fsmkit.runtime.health import Health, health_of
from fsmkit.system.deployment.deployment import Deployment

EPILOG = """\b
Examples:
  fsmkit health deployment.yaml
  fsmkit health deployment.yaml --timeout 200ms --json
"""
COUNTERS = ("cycles", "overruns", "losses", "refused", "bus_errors", "bus_off")


@verb(EPILOG)
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--timeout",
    callback=read_span,
    default="1s",
    show_default=True,
    help="Wait this long for the answer of each node.",
)
@click.option(
    "--json", "as_json", is_flag=True, help="Print one JSON document with the whole answers."
)
def command(file: Path, timeout: float, as_json: bool) -> int:
    """Show the state of each node of a deployment.

    A node answers at the address that `health` of the deployment names. Exit code 1: a node is
    not ok or does not answer.
    """
    deployment = fsmkit.read(file)
    if not isinstance(deployment, Deployment) or not any(deployment.health):
        raise fail(
            "broken-deployment",
            f"`{file}` has no health endpoints of nodes",
            help="write in the deployment for instance `health: {a: tcp://127.0.0.1:5601}`",
        )
    nodes = zip(deployment.nodes, deployment.health, strict=True)
    healths = health_of([(plain(n), plain(e)) for n, e in nodes if e], timeout)
    if as_json:
        print_json({"nodes": [_as_json(health) for health in healths]})
    else:
        result.print(_table(healths))
    return 0 if all(health.is_ok for health in healths) else 1


def _table(healths: tuple[Health, ...]) -> Table:
    shown = [c for c in COUNTERS if any(isinstance(h.report.get(c), int) for h in healths)]
    table = Table(box=None, pad_edge=False)
    for heading in ("node", "ok", "status"):
        table.add_column(heading)
    for heading in shown:
        table.add_column(heading, justify="right")
    for health in healths:
        counters = (health.report.get(counter) for counter in shown)
        table.add_row(
            escape(health.node),
            "yes" if health.is_ok else "no",
            escape(one_line(health.status)),
            *(f"{count:,}" if isinstance(count, int) else "" for count in counters),
        )
    return table


def _as_json(health: Health) -> dict[str, object]:
    return {
        "node": health.node,
        "endpoint": health.endpoint,
        "ok": health.is_ok,
        "status": health.status,
        "report": dict(health.report),
    }
