"""The import of a machine of another tool, for `convert`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import elaborated, read_bytes
from fsmkit.cli.common.console import err, report
from fsmkit.diagnostics import Findings, FsmkitError, Span, fail
from fsmkit.document.front_ends import reader_for
from fsmkit.document.python_objects import is_reference
from fsmkit.emit.lines import json_text
from fsmkit.foreign.imports import Import, Importer, report_data, report_lines


@dataclass(frozen=True, slots=True)
class ReadImport:
    """An import with the exit code, and the report as data and as lines."""

    found: Import
    chart: Chart | None
    """None if a part is rejected."""
    code: int
    data: Mapping[str, object]
    lines: tuple[str, ...]

    @property
    def json_text(self) -> str:
        """Return the report as a JSON document."""
        return json_text(self.data)


def importer_of(file: Path) -> Importer | None:
    """Return the reader of a file if it imports machines of another tool."""
    if is_reference(str(file)):
        return None
    reader = reader_for(file, read_bytes(file))
    return reader if isinstance(reader, Importer) else None


def import_file(
    reader: Importer, file: Path, findings: Findings, *, is_partial: bool
) -> ReadImport:
    """Return the machine of a file.

    Raises `FsmkitError` with what is rejected, unless ``is_partial`` and something is left. A whole
    import is elaborated, so that an error of the chart is reported now.
    """
    own = Findings()
    source = reader.decode(read_bytes(file), str(file), own)
    found = None if source is None else reader.import_selected(source, own)
    if found is None:
        raise FsmkitError(own)
    lines, data = report_lines(found, own), report_data(found, own)
    if not own.has_errors:
        findings.extend(own)
        chart = elaborated((found.document,), Findings())
        return ReadImport(found, chart, 0, data, lines)
    if not is_partial:
        raise FsmkitError(own)
    report(own)
    return ReadImport(found, None, 1, data, lines)


def prove(imported: ReadImport, count: int, command: str | None) -> tuple[str, ...]:
    """Compare the chart with its generated C, and with a program, on random events.

    Returns the lines to print. Raises `FsmkitError` with the shortest difference that was found.
    """
    from fsmkit.testing.foreign.proof import compare_with_c, compare_with_program

    chart = imported.chart
    if chart is None:
        raise fail(
            "wrong-option",
            "a machine of which parts are rejected cannot be compared",
            help="omit `--prove`, or change what is rejected",
        )
    difference = compare_with_c(chart, count)
    others = ["generated C"]
    if difference is None and command is not None:
        difference = compare_with_program(chart, command, count)
        others.append(f"`{command}`")
    if difference is not None:
        err.print("\n".join(difference.lines()), markup=False)
        raise fail(
            "import-refuted",
            f"the chart and {difference.other} differ after {len(difference.steps)} steps",
            Span(imported.found.document.source, 0, 1),
            help="compare the two sides above with the machine",
        )
    names = ", ".join(("interpreter", *others))
    return (f"compared   {count:,} random events: {names}: no difference",)
