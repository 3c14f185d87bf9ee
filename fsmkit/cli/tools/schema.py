"""``fsmkit schema``: JSON Schemas of all files, for editors."""

from __future__ import annotations

from pathlib import Path

import click

import fsmkit
from fsmkit.cli.common.console import out, print_json, result
from fsmkit.cli.common.options import OneOf, path_option
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.editor.schemas import KINDS, text_of

EPILOG = """\b
Examples:
  fsmkit schema
  fsmkit schema system --out system.schema.json
"""


@verb(EPILOG)
@click.argument("kind", type=OneOf("schema", sorted(KINDS)), required=False)
@path_option(
    "-o",
    "--out",
    "file",
    help="Write this file instead of printing.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def command(kind: str | None, file: Path | None, as_json: bool) -> int:
    """Print the JSON Schema of a kind of file, or list the kinds."""
    if kind is None:
        if file is not None:
            raise click.UsageError("--out needs a kind of file")
        titles = {name: KINDS[name]()["title"] for name in sorted(KINDS)}
        if as_json:
            print_json({"kinds": titles})
            return 0
        for name, title in titles.items():
            result.print(f"{name:12} {title}", markup=False)
        return 0
    text = text_of(kind, fsmkit.__version__)
    if file is None:
        click.echo(text, nl=False)
    else:
        write_files({file: text})
        if as_json:
            print_json({"file": str(file)})
        else:
            out.print(str(file), markup=False)
    return 0
