"""A program of the user's own, which opens a file at a line."""

from __future__ import annotations

import shlex
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

from fsmkit.diagnostics import fail


def editor(command: str) -> Callable[[Path, int], None]:
    """Return a function that opens a file at a line.

    It replaces ``{file}`` and ``{line}`` in the words of the command; without ``{file}`` it
    appends the file. No shell is involved. Raises `FsmkitError` (``wrong-option``) if the program
    does not exist; the returned function raises ``wrong-command`` if it cannot start.
    """
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise fail("wrong-option", f"`{command}` is not a command: {error}") from error
    if not words or shutil.which(words[0]) is None:
        help_ = "write a program, as in `code -g {file}:{line}`"
        raise fail("wrong-option", f"there is no program `{words[0] if words else ''}`", help=help_)
    if not any("{file}" in word for word in words):
        words.append("{file}")

    def open_at(file: Path, line: int) -> None:
        place = str(file.resolve())
        filled = [w.replace("{line}", str(line)).replace("{file}", place) for w in words]
        silent = subprocess.DEVNULL
        try:
            subprocess.Popen(
                filled, stdin=silent, stdout=silent, stderr=silent, start_new_session=True
            )
        except OSError as error:
            raise fail(
                "wrong-command", f"`{words[0]}` cannot be started: {error.strerror}"
            ) from error

    return open_at
