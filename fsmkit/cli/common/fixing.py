"""``fsmkit check --fix``: fixes that are sure, applied to the files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from fsmkit.chart.loading import read_bytes
from fsmkit.cli.common.many_files import models
from fsmkit.cli.common.options import Reading
from fsmkit.cli.common.writing import write_files
from fsmkit.diagnostics import Diagnostic, FsmkitError, Source
from fsmkit.diagnostics.fixes import Edit, apply_edits
from fsmkit.system.any_file import read_with_boards

MOST_ROUNDS = 20
"""Maximum number of passes over a file: a fix may reveal further errors."""


def fixed(files: Sequence[Path], reading: Reading) -> list[str]:
    """Apply the sure fixes in some files, and in those that they name; return a line for each."""
    told: list[str] = []
    for file in dict.fromkeys(file for path in files for file in models(path)):
        for _ in range(MOST_ROUNDS):
            edits: dict[str, tuple[Source, list[Edit]]] = {}
            for finding in _findings(file, reading):
                for fix in finding.fixes[:1]:
                    if fix.is_sure and _is_of_files(fix.edits):
                        for edit in fix.edits:
                            source = edit.span.source
                            edits.setdefault(source.name, (source, []))[1].append(edit)
                        place = "" if finding.primary is None else f"{finding.primary.span}: "
                        told.append(f"{place}{finding.rule.name}: {fix.title}")
            if not edits:
                break
            write_files({Path(n): apply_edits(s.text, e) for n, (s, e) in edits.items()})
    return told


def _is_of_files(edits: Sequence[Edit]) -> bool:
    """Whether all texts are files as they were read; other line ends or encodings stay alone."""
    for edit in edits:
        source = edit.span.source
        try:
            if read_bytes(Path(source.name)) != source.text.encode():
                return False
        except (FsmkitError, UnicodeError):
            return False
    return bool(edits)


def _findings(file: Path, reading: Reading) -> Iterator[Diagnostic]:
    findings = reading.findings()
    try:
        read_with_boards(file, findings, strict=reading.strict, parameters=reading.parameters)
    except FsmkitError as error:
        yield from error.diagnostics
    else:
        yield from findings
