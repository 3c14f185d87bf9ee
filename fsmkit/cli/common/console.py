"""The output of verbs: findings on standard error, results on standard output.

`result` prints the result of a verb, `out` remarks that ``--quiet`` omits, and `err` findings and
progress.
"""

from __future__ import annotations

import platform
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fsmkit
from fsmkit.diagnostics import Diagnostic, FsmkitError, Severity, render
from fsmkit.emit.lines import json_text

if TYPE_CHECKING:
    from fsmkit.cli.common.styled import Styled

STYLES = {Severity.ERROR: "bold red", Severity.WARNING: "bold yellow", Severity.NOTE: "bold cyan"}


class WrongOptionError(FsmkitError):
    """Diagnostics about the value of an option: the command line is used wrongly."""


class Stream:
    """A stream of styled text, set up anew for each command line.

    The library that styles is imported when the first line is printed: it takes as long as the
    rest of a short command line.
    """

    def __init__(self, *, stderr: bool = False, width: int | None = None) -> None:
        """Open standard output or standard error; ``width`` overrides that of the terminal."""
        self._is_error, self._wide = stderr, width
        self.set_up()

    def set_up(self, color: str = "auto", *, quiet: bool = False) -> None:
        """Print in colours always, never, or on terminals (``auto``); nothing if ``quiet``."""
        self._color, self._quiet = color, quiet
        self._console: Styled | None = None

    @property
    def console(self) -> Styled:
        """The console of rich, for output that needs one."""
        if self._console is None:
            from fsmkit.cli.common.styled import Styled

            self._console = Styled(stderr=self._is_error, width=self._wide, color=self._color)
            self._console.quiet = self._quiet
        return self._console

    @property
    def is_terminal(self) -> bool:
        """Return whether the stream is a terminal."""
        return self.console.is_terminal

    @property
    def width(self) -> int:
        """Characters of a line."""
        return self.console.width

    def print(self, *objects: Any, **options: Any) -> None:
        """Print as `rich.console.Console.print` does, but plain text in a pipe as it is."""
        if not self._quiet:
            self.console.print(*objects, **options)


LONGEST_LINE = 10_000
"""Characters of a line of a tree in a pipe."""
result, out, err = Stream(), Stream(), Stream(stderr=True)
unwrapped = Stream(width=LONGEST_LINE)
"""As `result`, for trees in a pipe: a line an item."""

reported: list[Diagnostic] = []
"""The findings of the current command line, for the SARIF log."""
verbosity = 0
"""-1: errors only; 1: with the explanation of each rule."""


def set_up(color: str = "auto", how_much: int = 0) -> None:
    """Configure the streams of a command line."""
    global verbosity  # noqa: PLW0603  (one command line at a time, as of standard output)
    verbosity = how_much
    for stream in (result, unwrapped, err):
        stream.set_up(color)
    out.set_up(color, quiet=how_much < 0)


def report(diagnostics: Iterable[Diagnostic]) -> None:
    """Print findings as text on standard error, errors first, then how many there were."""
    found = tuple(diagnostics)
    reported.extend(found)
    order = list(Severity)
    found = tuple(sorted(found, key=lambda diagnostic: order.index(diagnostic.severity)))
    if verbosity < 0:
        found = tuple(d for d in found if d.severity is Severity.ERROR)
    if found:
        from rich.text import Text
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


@contextmanager
def progress(description: str, *, is_quiet: bool) -> Iterator[Callable[[str], None]]:
    """Show progress on a terminal; yields a function that changes its description."""
    if is_quiet or not err.is_terminal:
        yield lambda _: None
        return
    from rich.markup import escape
    from rich.progress import Progress, SpinnerColumn, TextColumn

    columns = SpinnerColumn(), TextColumn("{task.description}")
    with Progress(*columns, console=err.console, transient=True) as bar:
        task = bar.add_task(escape(description))
        yield lambda text: bar.update(task, description=escape(text))


def print_json(document: object) -> None:
    """Print one JSON document on standard output, for a reader that may wait for it in a pipe."""
    sys.stdout.write(json_text(document))
    sys.stdout.flush()


def interrupted() -> int:
    """Report an interrupt by the user; return the exit code of a shell for SIGINT."""
    sys.stderr.write("interrupted\n")  # immediately: a second interrupt may follow soon
    return 130


def crash(error: Exception) -> int:
    """Turn a bug of ours into a report in a file and two lines; the exit code for bugs."""
    details = "".join(traceback.format_exception(error))
    heading = (
        f"fsmkit {fsmkit.__version__}, Python {platform.python_version()}, {platform.system()}"
    )
    try:
        with tempfile.NamedTemporaryFile(
            "w",
            prefix="fsmkit-bug-",
            suffix=".txt",
            delete=False,
            encoding="utf-8",
            errors="backslashreplace",
        ) as file:
            file.write(f"{heading}\n{' '.join(sys.argv)}\n\n{details}")
            place = f"; the report is in {Path(file.name)}"
    except OSError:
        place = ""
    err.print(f"fsmkit has a bug: {type(error).__name__}: {error}{place}", markup=False)
    return 3
