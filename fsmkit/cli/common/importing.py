"""The import of a machine of another tool, for `convert`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from fsmkit.chart.loading import elaborated, read_bytes
from fsmkit.cli.common.console import report
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.document.front_ends import reader_for
from fsmkit.document.python_objects import is_reference
from fsmkit.emit.lines import json_text
from fsmkit.foreign.imports import Import, Importer, report_data, report_lines


@dataclass(frozen=True, slots=True)
class ReadImport:
    """An import with the exit code, and the report as data and as lines."""

    found: Import
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
        elaborated((found.document,), Findings())
        return ReadImport(found, 0, data, lines)
    if not is_partial:
        raise FsmkitError(own)
    report(own)
    return ReadImport(found, 1, data, lines)
