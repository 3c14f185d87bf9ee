"""``fsmkit convert``: a chart in the other notation."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Protocol, runtime_checkable

import click

from fsmkit.chart.loading import load_with_findings, read_document
from fsmkit.cli.common.console import print_json, report
from fsmkit.cli.common.options import OneOf, Reading, path_option, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.diagnostics import Findings, FsmkitError, Severity, Source, Text, fail
from fsmkit.diagnostics.paths import is_file
from fsmkit.document.document import DocInvoke, DocState, Document
from fsmkit.document.front_ends import FrontEnd
from fsmkit.plugins import plugin, plugin_for, plugins

EPILOG = """\b
Examples:
  fsmkit convert feeder.yaml --to scxml
  fsmkit convert feeder.scxml --out feeder.yaml
  fsmkit convert heater.dbc --to yaml --node HEATER --may bus_off
"""


@runtime_checkable
class NodeFiles(Protocol):
    """Reads files that describe several nodes, as charts: a plug-in."""

    name: str
    node_suffixes: tuple[str, ...]
    """Suffixes of such files, in lower case."""

    def chart_of_node(
        self, path: Path, node: str | None, findings: Findings, *, may_fall_silent: bool
    ) -> str:
        """Return the chart of a node, in YAML; `FsmkitError` where there is no such node."""
        ...


@verb(EPILOG, Model=("parameters",))
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--to",
    "notation",
    type=OneOf("notation", [found.name for found in plugins(FrontEnd)]),
    help="Write this notation (default: by the suffix of --out).",
)
@path_option("-o", "--out", help="Write this file instead of printing.")
@click.option("--node", help="Write the chart of this node of a DBC file.")
@click.option(
    "--may",
    type=OneOf("event", ("bus_off",)),
    help="Let the node fall silent, as after bus-off (DBC files).",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@reading_options
def command(
    file: Path,
    notation: str | None,
    out: Path | None,
    node: str | None,
    may: str | None,
    as_json: bool,
    reading: Reading,
) -> int:
    """Convert a chart into another notation.

    The meaning stays. Only the named file is converted, and comments are not kept. For a node of a
    DBC file, the chart sends everything that the node may send.
    """
    front_end = _notation(notation, out)
    findings = reading.findings()
    suffix = file.suffix.lower()
    described = next((each for each in plugins(NodeFiles) if suffix in each.node_suffixes), None)
    if described is not None:
        document = _document_of_node(described, file, node, may is not None, findings)
    elif node is not None or may is not None:
        raise fail(
            "wrong-option",
            f"`{file}` is not a DBC file, and has no nodes of a bus",
            help="omit `--node` and `--may`",
        )
    else:
        if reading.strict:
            load_with_findings(file, findings, strict=True)
        document = read_document(file, findings)
    if out is not None:
        document = adapt_file_names(document, file.parent, out.parent, findings)
        findings.stop_on_errors()
    text = front_end.write(document)
    report(findings)
    if out is not None:
        write_files({out: text})
    if as_json:
        print_json({"files": [str(out)]} if out is not None else {"text": text})
    elif out is None:
        sys.stdout.write(text)
    return 0


def _notation(name: str | None, out: Path | None) -> FrontEnd:
    if name is not None:
        return plugin(FrontEnd, name)
    if out is None:
        raise click.UsageError("Missing option '--to', or '--out' with a suffix of a notation.")
    return plugin_for(FrontEnd, out)


def _document_of_node(
    described: NodeFiles, file: Path, node: str | None, may_fall_silent: bool, findings: Findings
) -> Document:
    """Return the chart of a node of a file that describes several."""
    text = described.chart_of_node(file, node, findings, may_fall_silent=may_fall_silent)
    document = plugin(FrontEnd, "yaml").read(Source(str(file), text), findings)
    findings.stop_on_errors()
    if document is None:
        raise FsmkitError(findings)
    return document


def adapt_file_names(document: Document, before: Path, after: Path, findings: Findings) -> Document:
    """Return a document whose relative file names are adapted from one folder to another.

    A computed name cannot be adapted and gets a warning. An invoked chart outside the new folder
    is an error.
    """
    if before.resolve() == after.resolve():
        return document

    def name(text: Text | None) -> Text | None:
        if text is None or Path(text.value).is_absolute():
            return text
        path = os.path.relpath((before / text.value).resolve(), after.resolve())
        return text.with_value(Path(path).as_posix())

    def state(one: DocState) -> DocState:
        return replace(
            one,
            children=tuple(state(child) for child in one.children),
            invokes=tuple(invoke(each) for each in one.invokes),
            use=None if one.use is None else replace(one.use, chart=name(one.use.chart)),
        )

    def invoke(one: DocInvoke) -> DocInvoke:
        if one.src_expr is not None:
            findings.add(
                "not-expressible",
                "the name of the invoked file is computed: it is not changed for the new folder",
                one.src_expr,
                help="write the new file into the folder of the old one",
                severity=Severity.WARNING,
            )
        src = document.source.beside(one.src.value) if one.src is not None else None
        names_file = src is not None and is_file(src)
        if names_file and src is not None and not src.resolve().is_relative_to(after.resolve()):
            findings.add(
                "not-expressible",
                "the invoked chart does not lie in the new folder, or below it",
                one.src,
                help="write the new file into the folder of the old one",
            )
        inner = (
            None if one.content is None else adapt_file_names(one.content, before, after, findings)
        )
        return replace(one, src=name(one.src) if names_file else one.src, content=inner)

    return replace(
        document,
        extends=name(document.extends),
        root=state(document.root),
        refine=tuple(state(each) for each in document.refine),
    )
