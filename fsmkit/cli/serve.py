"""``fsmkit serve``: a chart or a system that runs, seen in a browser."""

from __future__ import annotations

import asyncio
import secrets
import webbrowser
from pathlib import Path

import click

from fsmkit.cli.common.console import print_json, report, result
from fsmkit.cli.common.options import Reading, reading_options
from fsmkit.diagnostics import Severity
from fsmkit.inspector.commands import Break
from fsmkit.system.deployment import Deployment
from fsmkit.system.reading import read

EPILOG = """\b
Examples:
  fsmkit serve gate.yaml --open
  fsmkit serve cell.yaml --port 8080 --read-only
  fsmkit serve gate.yaml --break 'count == 3'
  ssh -L 8080:127.0.0.1:8080 robot fsmkit serve gate.yaml --port 8080
"""


@click.command(epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="Any free one by default.")
@click.option("--open", "is_opened", is_flag=True, help="Open the page in a browser.")
@click.option("--read-only", "is_readonly", is_flag=True, help="Whoever connects only looks on.")
@click.option(
    "--break",
    "breaks",
    multiple=True,
    metavar="CONDITION",
    help="Stop where it becomes true. Repeatable.",
)
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=1, show_default=True)
@click.option("--host", help="An address of this machine, for others; needs --origin.")
@click.option(
    "--origin", "origins", multiple=True, help="From where pages may connect. Repeatable."
)
@click.option("--allow-commands", is_flag=True, help="With --host: whoever connects may command.")
@click.option("--json", "as_json", is_flag=True, help="Print the address as one JSON document.")
@reading_options
def command(
    file: Path,
    port: int,
    is_opened: bool,
    is_readonly: bool,
    breaks: tuple[str, ...],
    seed: int,
    host: str | None,
    origins: tuple[str, ...],
    allow_commands: bool,
    as_json: bool,
    reading: Reading,
) -> int:
    """Simulate a chart or a system in a page of this machine, until interrupted.

    The page draws the machine, lights what is active, takes events, goes back in time, stops at
    breakpoints and says why an event does nothing. It needs no net. The address holds a token:
    whoever knows it may command the session.
    """
    if host is not None and not origins:
        raise click.UsageError("--host needs --origin: the address by which browsers come")
    findings = reading.findings()
    model = read(file, findings, strict=reading.strict)
    report(finding for finding in findings if finding.severity is not Severity.NOTE)
    from fsmkit.inspector.hub import Hub
    from fsmkit.inspector.server import LiveServer, serve_hub

    if isinstance(model, Deployment):
        model = model.written
    hub = Hub(model, file=file, session=secrets.token_hex(4), seed=seed)
    for condition in breaks:
        hub.add_breakpoint(Break(id=0, on="condition", what=condition))
    is_readonly = is_readonly or (host is not None and not allow_commands)
    server = LiveServer(hub, host=host, port=port, origins=origins, is_readonly=is_readonly)

    def ready(address: str) -> None:
        if as_json:
            print_json({"name": model.name, "session": hub.session, "address": address})
        else:
            result.print(f"{model.name}: {address}", markup=False, soft_wrap=True)
        if is_opened:
            webbrowser.open(address)

    asyncio.run(serve_hub(server, ready))
    return 0
