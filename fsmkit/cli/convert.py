"""``fsmkit convert``: a chart in the other notation."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from pathlib import Path

import click

from fsmkit.cli.console import print_json, report
from fsmkit.cli.writing import write_files
from fsmkit.diagnostics import Findings, Text
from fsmkit.loading import read_document
from fsmkit.model.document import Document
from fsmkit.plugins import FrontEnd, plugin

EPILOG = """\b
Examples:
  fsmkit convert feeder.yaml --to scxml
  fsmkit convert feeder.scxml --to yaml --out feeder.yaml
"""


@click.command(epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--to", "notation", required=True, help="The notation: yaml or scxml.")
@click.option("--out", type=click.Path(path_type=Path), help="Write this file, do not print.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def command(file: Path, notation: str, out: Path | None, as_json: bool) -> int:
    """Write a chart in another notation, with the same meaning.

    One file is converted; a base that it extends keeps its notation. Comments are not carried over.
    """
    front_end = plugin(FrontEnd, notation)
    findings = Findings()
    document = read_document(file, findings)
    if out is not None:
        document = moved(document, file.parent, out.parent)
    text = front_end.write(document)
    report(findings)
    if out is not None:
        write_files({out: text})
    if as_json:
        print_json({"files": [str(out)]} if out is not None else {"text": text})
    elif out is None:
        sys.stdout.write(text)
    return 0


def moved(document: Document, before: Path, after: Path) -> Document:
    """Return a document whose `extends`, relative to one folder, is relative to another."""
    base = document.extends
    if base is None or Path(base.value).is_absolute() or before.resolve() == after.resolve():
        return document
    path = Path(os.path.relpath((before / base.value).resolve(), after.resolve()))
    return replace(document, extends=Text(path.as_posix(), base.span))
