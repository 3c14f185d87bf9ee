"""The output of ``check`` for files that are read but not explored: counts of their items."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fsmkit.cli.common.console import print_json, report, result
from fsmkit.diagnostics import Findings
from fsmkit.diagnostics.as_json import as_json as data_of


@dataclass(frozen=True, slots=True)
class CountedFile:
    """A file, the name of that in it, and how many parts of each kind it has."""

    file: Path
    name: str
    figures: Mapping[str, int]


def print_counts(
    files: Sequence[CountedFile], kind: str, of: str, findings: Findings, *, as_json: bool
) -> int:
    """Report the findings, print a line for each file, and return the exit code 0.

    Args:
        files: The files and their counts.
        kind: The key of the list in the JSON document: ``boards``, ``bindings``.
        of: The key of each file's name.
        findings: Warnings and notes.
        as_json: Whether one JSON document is printed instead of lines.

    """
    report(findings)
    if as_json:
        told = [{"file": str(each.file), of: each.name, **each.figures} for each in files]
        print_json({kind: told, "findings": [data_of(finding) for finding in findings]})
        return 0
    for each in files:
        counts = ", ".join(f"{what} {count}" for what, count in each.figures.items())
        result.print(f"{each.file}: {counts}", markup=False, highlight=False)
    return 0
