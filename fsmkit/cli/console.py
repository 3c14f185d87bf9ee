"""What every verb prints with: findings on standard error, results on standard output.

Streams: `result` prints what a verb is there to print, `out` remarks on what was done, which
``--quiet`` leaves out, and `err` findings and progress.
"""

from __future__ import annotations

import json
import platform
import sys
import tempfile
import traceback
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final, Literal

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

import fsmkit
from fsmkit.diagnostics import Diagnostic, FsmkitError, Severity, render

STYLES = {Severity.ERROR: "bold red", Severity.WARNING: "bold yellow", Severity.NOTE: "bold cyan"}
COLOR_SYSTEMS: Final[dict[str, Literal["auto", "256"] | None]] = {
    "auto": "auto",
    "always": "256",
    "never": None,
}


class WrongOptionError(FsmkitError):
    """Diagnostics about the value of an option: the command line is used wrongly."""


class Stream(Console):
    """A stream of styled text, set up anew for each command line."""

    def __init__(self, *, stderr: bool = False, width: int | None = None) -> None:
        """Open standard output, or standard error; ``width`` is that of the terminal, or given."""
        self._is_error, self._wide = stderr, width
        self.set_up()

    def set_up(self, color: str = "auto") -> None:
        """Print in colours always, never, or on terminals (``auto``)."""
        super().__init__(
            stderr=self._is_error,
            highlight=False,
            soft_wrap=self._wide is None,
            width=self._wide,
            no_color=True if color == "never" else None,
            color_system=COLOR_SYSTEMS[color],
        )
        self._is_styled = self.is_terminal or color == "always" or self._wide is not None

    def print(self, *objects: Any, **options: Any) -> None:
        """Print as `rich.console.Console.print` does, but plain text in a pipe as it is.

        A run of a large chart prints hundreds of thousands of lines; rich takes a millisecond for
        each.
        """
        is_plain = (
            not (self._is_styled or self.quiet)
            and len(objects) == 1
            and options.keys() <= {"markup", "style"}
        )
        text = objects[0] if is_plain else None
        if isinstance(text, Text):
            self.file.write(f"{_harmless(text.plain)}\n")
        elif isinstance(text, str) and options.get("markup") is False:
            self.file.write(f"{_harmless(text)}\n")
        else:
            super().print(*objects, **options)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Yield what is printed; nothing in a text is a command to the terminal."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=_harmless(segment.text))


def _harmless(text: str) -> str:
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() or c in "\n\t" else "\N{REPLACEMENT CHARACTER}" for c in text
    )


LONGEST_LINE = 10_000
"""Characters of a line of a tree in a pipe."""
result, out, err = Stream(), Stream(), Stream(stderr=True)
unwrapped = Stream(width=LONGEST_LINE)
"""As `result`, for trees in a pipe: a line an item."""

reported: list[Diagnostic] = []
"""The findings of the command line at hand, for the SARIF log."""
verbosity = 0
"""-1: errors only; 1: with the explanation of each rule."""


def set_up(color: str = "auto", how_much: int = 0) -> None:
    """Begin a command line."""
    global verbosity  # noqa: PLW0603  (one command line at a time, as of standard output)
    verbosity = how_much
    for stream in (result, unwrapped, out, err):
        stream.set_up(color)
    out.quiet = how_much < 0


def report(diagnostics: Iterable[Diagnostic]) -> None:
    """Print findings as text on standard error, then how many there were."""
    found = tuple(diagnostics)
    reported.extend(found)
    if verbosity < 0:
        found = tuple(d for d in found if d.severity is Severity.ERROR)
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
    for rule in dict.fromkeys(d.rule for d in found) if verbosity > 0 else ():
        err.print(Text.assemble((f"{rule.code} {rule.name}\n\n", "bold"), rule.explanation, "\n"))
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
