"""``fsmkit lsp``: charts and systems in any editor."""

from __future__ import annotations

import sys
from importlib.util import find_spec

import click

from fsmkit.cli.common.console import print_json
from fsmkit.cli.common.verbs import verb
from fsmkit.diagnostics import fail

EPILOG = """\b
Examples:
  fsmkit lsp                    (an editor starts it)
  fsmkit lsp --tcp 4712         (an editor connects to the port)
"""


@verb(EPILOG)
@click.option(
    "--tcp",
    "port",
    type=click.IntRange(0, 65535),
    help="Wait for an editor at this port instead; 0: any free one.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the port as JSON, with --tcp.")
def command(port: int | None, as_json: bool) -> int:
    """Serve editors by the Language Server Protocol.

    The editor starts this command. It serves SCXML, and YAML with a chart, a system, a deployment,
    a board or tests. Nothing that a file names is imported or executed.
    """
    if as_json and port is None:
        raise click.UsageError("--json needs --tcp: otherwise the editor reads the output")
    if find_spec("pygls") is None or find_spec("lsprotocol") is None:
        raise fail(
            "missing-package",
            "`fsmkit lsp` needs the packages pygls and lsprotocol, which are not installed",
            help="install them: `pip install 'fsmkit[lsp]'`",
        )
    from fsmkit.editor.serving import serve_stdio, serve_tcp

    if port is None:
        serve_stdio()
    else:
        serve_tcp(port, _print_port if as_json else None)
    return 0


def _print_port(port: int) -> None:
    print_json({"port": port})
    sys.stdout.flush()
