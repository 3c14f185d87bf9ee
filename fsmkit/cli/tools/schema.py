"""``fsmkit schema``: JSON Schemas of all files, for editors, and of documents of verbs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

import fsmkit
from fsmkit.cli.common.console import out, print_json, result
from fsmkit.cli.common.options import OneOf, path_option
from fsmkit.cli.common.result_schemas import RESULTS, result_schema
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.editor.schemas import KINDS, identified
from fsmkit.emit.lines import json_text

EPILOG = """\b
Examples:
  fsmkit schema
  fsmkit schema system --out system.schema.json
  fsmkit schema check-result
"""


SUFFIX = "-result"
"""Ends the name of the schema of a verb's JSON document."""
NAMES = (*sorted(KINDS), *(f"{name}{SUFFIX}" for name in sorted(RESULTS)))


@verb(EPILOG)
@click.argument("kind", type=OneOf("schema", NAMES), required=False)
@path_option(
    "-o",
    "--out",
    "file",
    help="Write this file instead of printing.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def command(kind: str | None, file: Path | None, as_json: bool) -> int:
    """Print the JSON Schema of a kind of file, or list the kinds.

    VERB-result is the schema of the document that `fsmkit VERB --json` prints.
    """
    if kind is None:
        if file is not None:
            raise click.UsageError("--out needs a kind of file")
        titles = {name: str(_schema(name)["title"]) for name in NAMES}
        if as_json:
            print_json({"kinds": titles})
            return 0
        for name, title in titles.items():
            result.print(f"{name:19} {title}", markup=False)
        return 0
    text = json_text(identified(_schema(kind), kind, fsmkit.__version__))
    if file is None:
        click.echo(text, nl=False)
    else:
        write_files({file: text})
        if as_json:
            print_json({"file": str(file)})
        else:
            out.print(str(file), markup=False)
    return 0


def _schema(kind: str) -> dict[str, Any]:
    name = kind.removesuffix(SUFFIX)
    return KINDS[kind]() if kind in KINDS else result_schema(name)
