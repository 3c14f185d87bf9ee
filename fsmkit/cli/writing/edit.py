"""``fsmkit edit``: draw a chart in a browser; each gesture is an edit of the text."""

from __future__ import annotations

import asyncio
import secrets
import webbrowser
from pathlib import Path

import click

from fsmkit.cli.common.console import print_json, result
from fsmkit.cli.common.editor import editor
from fsmkit.cli.common.options import option_value
from fsmkit.cli.common.verbs import verb

EPILOG = """\b
Examples:
  fsmkit edit gate.yaml --open
  fsmkit edit new.yaml --open
  fsmkit edit gate.yaml --open --open-with 'code -g {file}:{line}'
"""


@verb(EPILOG)
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=0,
    help="Serve at this port (default: any free one).",
)
@click.option("--open", "is_opened", is_flag=True, help="Open the page in a browser.")
@click.option(
    "--open-with",
    metavar="COMMAND",
    help="Open sources by this command, such as `code -g {file}:{line}`.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the address as one JSON document.")
def command(file: Path, port: int, is_opened: bool, open_with: str | None, as_json: bool) -> int:
    """Edit a chart as a drawing in a local page, and run it.

    Each gesture changes the few lines of the YAML or SCXML file that it concerns; comments and
    layout stay. A file that does not exist starts as an empty chart. The address holds a token
    that grants control of the file.
    """
    from fsmkit.editor.editing.session import EditSession
    from fsmkit.editor.page import edit_page
    from fsmkit.editor.page.following import follow_file
    from fsmkit.editor.page.hub import EditHub, new_text
    from fsmkit.inspector.server import LiveServer, serve_hub

    if file.suffix.lower() not in (".yaml", ".yml", ".scxml", ".xml"):
        raise click.UsageError(
            f"`{file.name}` is neither YAML nor SCXML. Convert a machine of another tool first: "
            f"`fsmkit convert {file} --out {file.with_suffix('.yaml').name}`."
        )
    if not file.absolute().parent.is_dir():
        raise click.UsageError(f"there is no folder `{file.absolute().parent.name}`")
    with option_value():
        opening = None if open_with is None else editor(open_with)
    session = EditSession(file, new_text(file))
    hub = EditHub(session, session=secrets.token_hex(4), editor=opening)
    server = LiveServer(hub, port=port, page=edit_page)

    def ready(address: str) -> None:
        if as_json:
            print_json({"name": file.stem, "session": hub.session, "address": address})
        else:
            result.print(f"{file.name}: {address}", markup=False, soft_wrap=True)
        if is_opened:
            webbrowser.open(address)

    async def serve() -> None:
        following = asyncio.create_task(follow_file(hub))
        try:
            await serve_hub(server, ready)
        finally:
            following.cancel()

    asyncio.run(serve())
    return 0
