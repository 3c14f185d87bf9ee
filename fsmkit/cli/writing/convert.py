"""``fsmkit convert``: a chart in the other notation."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Protocol, runtime_checkable

import click

from fsmkit.chart.loading import load_with_findings, read_document
from fsmkit.cli.common.console import err, print_json, report, result
from fsmkit.cli.common.importing import ReadImport, import_file, importer_of, prove
from fsmkit.cli.common.options import OneOf, Reading, path_option, reading_options
from fsmkit.cli.common.stubs import write_stubs
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.diagnostics import Findings, FsmkitError, Severity, Source, Text, fail
from fsmkit.diagnostics.paths import is_file
from fsmkit.document.document import DocInvoke, DocState, Document
from fsmkit.document.front_ends import SELECTED, FrontEnd, Reader
from fsmkit.plugins import plugin, plugin_for, plugins

EPILOG = """\b
Examples:
  fsmkit convert feeder.yaml --to scxml
  fsmkit convert feeder.scxml --out feeder.yaml
  fsmkit convert heater.dbc --to yaml --node HEATER --may bus_off
  fsmkit convert lamp.puml --to yaml --report lamp.json
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


@verb(
    EPILOG,
    Machines_of_other_tools=(
        "reader",
        "machine",
        "report_file",
        "is_partial",
        "stubs",
        "count",
        "command_line",
    ),
    Model=("parameters",),
)
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
@click.option(
    "--from",
    "reader",
    type=OneOf("notation", [found.name for found in plugins(Reader)]),
    help="Read the file in this notation (default: by its suffix and content).",
)
@path_option("--report", "report_file", help="Write the report of an import as JSON, too.")
@click.option(
    "--partial", "is_partial", is_flag=True, help="Write the rest where parts are rejected."
)
@click.option(
    "--stubs",
    type=OneOf("language", ("c", "python")),
    help="Write stubs of the operations in this language beside --out.",
)
@click.option(
    "--prove",
    "count",
    type=click.IntRange(1, 1_000_000),
    help="Compare the chart with its generated C on this many random events.",
)
@click.option(
    "--prove-with",
    "command_line",
    metavar="COMMAND",
    help="Compare it with this program of the tool, too.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@reading_options
def command(
    file: Path,
    notation: str | None,
    out: Path | None,
    node: str | None,
    may: str | None,
    reader: str | None,
    report_file: Path | None,
    is_partial: bool,
    stubs: str | None,
    count: int | None,
    command_line: str | None,
    as_json: bool,
    reading: Reading,
) -> int:
    """Convert a chart, or import one from another tool.

    The meaning stays. Only the named file is converted, and comments are not kept. For a node of a
    DBC file, the chart sends everything that the node may send. For a machine of another tool, the
    report lists what was kept, rewritten, opaque, rejected and lost.
    """
    SELECTED.set(replace(SELECTED.get(), reader=reader))
    front_end = _notation(notation, out)
    findings = reading.findings()
    suffix = file.suffix.lower()
    described = next((each for each in plugins(NodeFiles) if suffix in each.node_suffixes), None)
    importer = None if described is not None else importer_of(file)
    imported: ReadImport | None = None
    if importer is None and (report_file or is_partial or stubs or count):
        raise fail(
            "wrong-option",
            f"`{file}` is not a file of another tool",
            help="omit `--report`, `--partial`, `--stubs` and `--prove`",
        )
    if stubs is not None and out is None:
        raise click.UsageError("Missing option '--out': `--stubs` writes a file beside it.")
    if command_line is not None and count is None:
        raise click.UsageError("Missing option '--prove', the number of events.")
    if described is not None:
        document = _document_of_node(described, file, node, may is not None, findings)
    elif node is not None or may is not None:
        raise fail(
            "wrong-option",
            f"`{file}` is not a DBC file, and has no nodes of a bus",
            help="omit `--node` and `--may`",
        )
    elif importer is not None:
        imported = import_file(importer, file, findings, is_partial=is_partial)
        document = imported.found.document
    else:
        if reading.strict:
            load_with_findings(file, findings, strict=True)
        document = read_document(file, findings)
    if out is not None:
        document = adapt_file_names(document, file.parent, out.parent, findings)
        findings.stop_on_errors()
    text = front_end.write(document)
    report(findings)
    files: dict[Path, str | bytes] = {} if out is None else {out: text}
    if imported is not None and report_file is not None:
        files[report_file] = imported.json_text
    if (
        imported is not None
        and imported.chart is not None
        and stubs is not None
        and out is not None
    ):
        for name, stub in write_stubs(imported.chart, imported.found.opaque, stubs).items():
            files[out.parent / name] = stub
    proof = () if imported is None or count is None else prove(imported, count, command_line)
    write_files(files)
    if as_json:
        imports = {} if imported is None else {"report": imported.data}
        shown = {"text": text} if out is None else {"files": [str(path) for path in files]}
        print_json({**shown, **imports})
        return 0 if imported is None else imported.code
    if out is None:
        sys.stdout.write(text)
    if imported is not None:
        (err if out is None else result).print("\n".join((*imported.lines, *proof)), markup=False)
    return 0 if imported is None else imported.code


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
