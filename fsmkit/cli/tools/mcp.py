"""``fsmkit mcp``: charts for AI assistants."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import click

from fsmkit.cli.common.console import print_json
from fsmkit.cli.common.options import read_span
from fsmkit.cli.common.verbs import verb
from fsmkit.diagnostics import fail

EPILOG = """\b
Examples:
  fsmkit mcp --root charts              (an assistant starts it)
  fsmkit mcp --root charts --readonly
"""


@verb(EPILOG)
@click.option(
    "--root",
    type=click.Path(path_type=Path, exists=True, file_okay=False),
    default=Path(),
    help="Read and write files below this folder only (default: the current one).",
)
@click.option("--readonly", is_flag=True, help="Write no file.")
@click.option(
    "--timeout",
    default="60s",
    callback=read_span,
    metavar="DURATION",
    help="Stop each tool after this much time, such as 30s or 5min.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the tools as JSON, and serve nobody.")
def command(root: Path, readonly: bool, timeout: float, as_json: bool) -> int:
    """Serve AI assistants by the Model Context Protocol.

    The assistant starts this command. Its tools read, check, run, compare, draw and edit charts and
    systems below the root folder. Results are structured, with locations.
    """
    if find_spec("mcp") is None:
        raise fail(
            "missing-package",
            "`fsmkit mcp` needs the package mcp, which is not installed",
            help="install it: `pip install 'fsmkit[mcp]'`",
        )
    from fsmkit.editor.assistants.server import described_tools, serve_stdio

    if as_json:
        print_json({"tools": described_tools()})
        return 0
    serve_stdio(root, timeout, is_readonly=readonly)
    return 0
