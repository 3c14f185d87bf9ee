"""``fsmkit dap``: charts and systems debugged in an editor."""

from __future__ import annotations

import asyncio
import os
import sys

import click

from fsmkit.cli.common.console import print_json, result
from fsmkit.cli.common.verbs import verb

EPILOG = """\b
Examples:
  fsmkit dap                    (an editor starts it)
  fsmkit dap --listen 4711      (editors connect to the port)
"""


@verb(EPILOG)
@click.option(
    "--listen",
    "port",
    type=click.IntRange(0, 65535),
    help="Wait for editors at this port; 0 takes any free one.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the port as JSON, with --listen.")
def command(port: int | None, as_json: bool) -> int:
    """Debug in an editor, by the Debug Adapter Protocol.

    The editor starts this command and names the file in a launch configuration. Machines are
    threads, active states are stack frames, breakpoints are on lines of YAML and SCXML, and steps
    also go back.
    """
    from fsmkit.inspector.dap.serving import PortServer, serve_stdio

    if port is None:
        if as_json:
            raise click.UsageError("--json needs --listen: otherwise the editor reads the output")
        source, target = sys.stdin.fileno(), os.dup(sys.stdout.fileno())
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # no other output may mix with frames
        asyncio.run(serve_stdio(source, target))
        return 0

    async def listen() -> None:
        async with PortServer(port) as server:
            if as_json:
                print_json({"port": server.port})
            else:
                result.print(f"127.0.0.1:{server.port}", markup=False)
            sys.stdout.flush()
            await asyncio.Event().wait()

    asyncio.run(listen())
    return 0
