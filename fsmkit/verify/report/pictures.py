"""Draw the traces of a report as sequence diagrams; the suffix of the file is the notation."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path

from fsmkit.diagnostics import fail
from fsmkit.verify.report.sequence import sequence
from fsmkit.verify.report.sequences import mermaid, plantuml, svg
from fsmkit.verify.report.sequences.model import Sequence
from fsmkit.verify.report.verdict import Report, Result

NOTATIONS: Mapping[str, Callable[[Sequence], str]] = {
    ".svg": svg.draw,
    ".mmd": mermaid.draw,
    ".puml": plantuml.draw,
}


def require_notation(path: Path) -> None:
    """Raise `FsmkitError` if no notation has the suffix of a file."""
    if path.suffix.lower() not in NOTATIONS:
        raise fail(
            "unknown-suffix",
            f"no kind of sequence diagram has the suffix `{path.suffix}` of `{path.name}`",
            help=f"use one of {', '.join(NOTATIONS)}",
        )


def pictures(report: Report, path: Path) -> dict[Path, str]:
    """Return a diagram of each trace: at ``path``, or if there are several, in files beside it."""
    draw = NOTATIONS[path.suffix.lower()]
    return {
        file: draw(sequence(report.closed, result, result.trace))
        for file, result in trace_files(report, path).items()
        if result.trace is not None
    }


def trace_files(report: Report, path: Path) -> dict[Path, Result]:
    """Return the results that have a trace, each with its file.

    A single one has the given path; several have the name of the property added: ``cell.svg``
    becomes ``cell_P2.svg``.
    """
    shown = [r for r in report.results if r.trace is not None and r.trace.steps]
    if len(shown) == 1:
        return {path: shown[0]}
    found: dict[Path, Result] = {}
    for result in shown:
        name = re.sub(r"\W+", "_", result.name)
        found[path.with_name(f"{path.stem}_{name}{path.suffix}")] = result
    return found
