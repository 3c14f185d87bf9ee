"""What every verb prints with: findings on standard error, results on standard output."""

from __future__ import annotations

import json
import platform
import sys
import tempfile
import traceback
from collections.abc import Iterable
from pathlib import Path

from rich.console import Console
from rich.text import Text

import fsmkit
from fsmkit.diagnostics import Diagnostic, Severity, render

STYLES = {Severity.ERROR: "bold red", Severity.WARNING: "bold yellow", Severity.NOTE: "bold cyan"}

out = Console(highlight=False, soft_wrap=True)
err = Console(stderr=True, highlight=False, soft_wrap=True)

reported: list[Diagnostic] = []
"""The findings of the command line at hand, for the SARIF log."""


def report(diagnostics: Iterable[Diagnostic]) -> None:
    """Print findings as text on standard error, then how many there were."""
    found = tuple(diagnostics)
    reported.extend(found)
    for diagnostic in found:
        text = Text(render(diagnostic))
        text.stylize(STYLES[diagnostic.severity], 0, len(diagnostic.severity.value))
        err.print(text)
        err.print()
    counts = [
        f"{number} {severity.value}{'s' if number > 1 else ''}"
        for severity in Severity
        if (number := sum(d.severity is severity for d in found))
    ]
    if counts:
        err.print(", ".join(counts))


def print_json(document: object) -> None:
    """Print one JSON document on standard output."""
    sys.stdout.write(json.dumps(document, indent=2, ensure_ascii=False) + "\n")


def interrupted() -> int:
    """Say that the user stopped it; the exit code of a shell for SIGINT."""
    err.print("interrupted")
    return 130


def crash(error: Exception) -> int:
    """Turn a bug of ours into a report in a file and two lines; the exit code for bugs."""
    details = "".join(traceback.format_exception(error))
    heading = (
        f"fsmkit {fsmkit.__version__}, Python {platform.python_version()}, {platform.system()}"
    )
    try:
        with tempfile.NamedTemporaryFile(
            "w", prefix="fsmkit-bug-", suffix=".txt", delete=False, encoding="utf-8"
        ) as file:
            file.write(f"{heading}\n{' '.join(sys.argv)}\n\n{details}")
            place = f"; the report is in {Path(file.name)}"
    except OSError:
        place = ""
    err.print(f"fsmkit has a bug: {type(error).__name__}: {error}{place}", markup=False)
    return 3
