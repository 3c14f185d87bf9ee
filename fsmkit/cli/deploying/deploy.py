"""``fsmkit deploy``: files that let a supervisor of processes run the nodes of a deployment."""

from __future__ import annotations

import re
from pathlib import Path

import click
from rich.markup import escape

import fsmkit
from fsmkit.cli.common.console import print_json, result
from fsmkit.cli.common.options import OneOf, Reading, read_span, reading_options
from fsmkit.cli.common.verbs import verb
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
        raise click.BadParameter(f"`{value}` is not a list of processors such as 2,3", ctx, param)
    return tuple(map(int, words))


@verb(EPILOG, Restarting=("watchdog", "restart", "tries"), Rights=("priority", "cpus", "user"))
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--to",
    "kind",
    required=True,
    type=OneOf("supervisor", list(KINDS)),
    help="Write the files of this supervisor.",
)
@click.option(
    "--exec",
    "template",
    required=True,
    help="Start each node by this command; {node} and {health} are replaced.",
)
@click.option("--node", help="Write only the files of this node.")
@click.option(
    "-o",
    "--out",
    "folder",
    type=click.Path(path_type=Path, file_okay=False),
    default=".",
    show_default="the present one",
    help="Write into this folder.",
)
@click.option(
    "--watchdog",
    callback=read_span,
    default="1s",
    show_default=True,
    help="Restart a node without a cycle for this long; 0: never (systemd).",
)
@click.option(
    "--restart",
    callback=read_span,
    default="500ms",
    show_default=True,
    help="Wait this long before a node starts again.",
)
@click.option(
    "--tries",
    type=click.IntRange(1, 1000),
    default=5,
    show_default=True,
    help="Leave a node stopped after this many failures in succession.",
)
@click.option(
    "--priority",
    type=click.IntRange(0, 99),
    default=0,
    help="Allow nodes SCHED_FIFO priorities up to this one, and locked memory (systemd).",
)
@click.option("--cpus", callback=read_cpus, help="Run the nodes on these processors, such as 2,3.")
@click.option("--user", help="Run the nodes as this user.")
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
    """Write systemd or supervisord files for the nodes.

    A node that ends with an error is started again. With systemd, a node reports that it is
    connected and that its loop runs (fsm_notify.h); one whose loop hangs is started again, too.
    """
    deployment = fsmkit.read(file, strict=reading.strict, findings=reading.findings())
    if not isinstance(deployment, Deployment):
        raise fail(
            "broken-deployment",
            f"`{file}` is not a deployment",
            help="name a file with `system` and `nodes`",
        )
    if user is not None and not USER.fullmatch(user):
        raise click.UsageError(f"`{user}` is not a user name")
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
