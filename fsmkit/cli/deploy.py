"""``fsmkit deploy``: files that let a supervisor of processes run the nodes of a deployment."""

from __future__ import annotations

import re
from pathlib import Path

import click
from rich.markup import escape

import fsmkit
from fsmkit.cli.common.console import print_json, result
from fsmkit.cli.common.options import OneOf, Reading, read_span, reading_options
from fsmkit.cli.common.writing import write_files
from fsmkit.codegen.units import KINDS, services_of
from fsmkit.codegen.units.service import Keeping
from fsmkit.diagnostics import fail
from fsmkit.system.deployment.deployment import Deployment

EPILOG = """\b
Examples:
  fsmkit deploy deployment.yaml --to systemd --exec '/opt/cell/board_{node} --realtime {health}'
  fsmkit deploy deployment.yaml --to supervisor --exec '/opt/cell/board_{node}' --node a --out units
"""
USER = re.compile(r"[a-z_][a-z0-9_-]*", re.IGNORECASE)


def read_cpus(ctx: click.Context, param: click.Parameter, value: str | None) -> tuple[int, ...]:
    """Read ``2,3`` as numbers of processors."""
    words = [] if value is None else value.split(",")
    if not all(word.isascii() and word.isdigit() and len(word) < 5 for word in words):
        raise click.BadParameter(f"`{value}` is no list of processors such as 2,3", ctx, param)
    return tuple(map(int, words))


@click.command(epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--to", "kind", required=True, type=OneOf("supervisor", list(KINDS)), help="Whose files."
)
@click.option(
    "--exec",
    "template",
    required=True,
    help="The command of a node, with an absolute path; {node} stands for its name, {health} for "
    "where it answers.",
)
@click.option("--node", help="Only this node, which runs on this computer.")
@click.option(
    "-o",
    "--out",
    "folder",
    type=click.Path(path_type=Path, file_okay=False),
    default=".",
    show_default="the present one",
    help="The folder.",
)
@click.option(
    "--watchdog",
    callback=read_span,
    default="1s",
    show_default=True,
    help="systemd: without a cycle for so long a node is started again. 0: it sends no notices.",
)
@click.option(
    "--restart",
    callback=read_span,
    default="500ms",
    show_default=True,
    help="From the end of a node to its next start.",
)
@click.option(
    "--tries",
    type=click.IntRange(1, 1000),
    default=5,
    show_default=True,
    help="After so many failures in succession a node stays down.",
)
@click.option(
    "--priority",
    type=click.IntRange(0, 99),
    default=0,
    help="systemd: the highest SCHED_FIFO priority that nodes may take; they may lock memory then.",
)
@click.option("--cpus", callback=read_cpus, help="The processors of the nodes, such as 2,3.")
@click.option("--user", help="The user as whom the nodes run.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@reading_options
def command(
    file: Path,
    kind: str,
    template: str,
    node: str | None,
    folder: Path,
    watchdog: float,
    restart: float,
    tries: int,
    priority: int,
    cpus: tuple[int, ...],
    user: str | None,
    as_json: bool,
    reading: Reading,
) -> int:
    """Write files by which systemd or supervisord keeps the nodes of a deployment running.

    A node that ends with an error is started again. With systemd, a node says by fsm_notify.h that
    it has heard the others and that its loop runs; one whose loop hangs is started again, too.
    """
    deployment = fsmkit.read(file, strict=reading.strict, findings=reading.findings())
    if not isinstance(deployment, Deployment):
        raise fail(
            "broken-deployment",
            f"`{file}` is no deployment",
            help="name a file with `system` and `nodes`",
        )
    if user is not None and not USER.fullmatch(user):
        raise click.UsageError(f"`{user}` is no name of a user")
    keeping = Keeping(watchdog, restart, tries, priority, cpus, user)
    files = KINDS[kind](services_of(deployment, template, node), keeping)
    written = {folder / name: text for name, text in files.items()}
    write_files(written, folder)
    if as_json:
        print_json({"files": [str(path) for path in written]})
    else:
        for path in written:
            result.print(escape(str(path)))
    return 0
