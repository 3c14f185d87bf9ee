"""The folders and the target of a C compiler, which libclang needs to read the same headers."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fsmkit.diagnostics import fail

BEGIN = '#include "..." search starts here:'
END = "End of search list."
TARGET = re.compile(r"^Target: (\S+)$", re.MULTILINE)
OPTION_PREFIXES = (
    "-m",
    "-D",
    "-U",
    "-I",
    "-std=",
    "-fshort-",
    "-funsigned-",
    "-fsigned-",
    "-fno-short-",
)
"""The prefixes of options that clang interprets as gcc does."""
SECONDS = 30


@dataclass(frozen=True, slots=True)
class Compiler:
    """The output of ``CC -E -v``: the folders in order, and the target, "" if it is missing."""

    folders: tuple[str, ...]
    target: str
    options: tuple[str, ...] = ()
    """The command's options that change the declarations of a header."""


def compiler_of(command: Sequence[str], options: Sequence[str]) -> Compiler:
    """Return the folders and the target of a compiler, given the options of a build.

    Raises:
        FsmkitError: ``header-not-read`` if it cannot be run or lists no folder.

    """
    line = [*command, *options, "-E", "-v", "-x", "c", os.devnull]
    try:
        done = subprocess.run(
            line,
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
            timeout=SECONDS,
            env={**os.environ, "LC_ALL": "C"},
            stdin=subprocess.DEVNULL,
        )
        output, code = done.stderr, done.returncode
    except (OSError, ValueError, subprocess.TimeoutExpired) as error:
        output, code = f"{type(error).__name__}: {error}", 1
    _, started, rest = output.partition(BEGIN)
    listed, ended, _ = rest.partition(END)
    folders = tuple(each.strip() for each in listed.splitlines() if each.startswith(" "))
    found = tuple(folder for folder in folders if Path(folder).is_dir())
    if code or not started or not ended or not found:
        last = next((each for each in reversed(output.splitlines()) if each.strip()), "nothing")
        raise fail(
            "header-not-read",
            f"`{command[0]} -E -v` names no folder of headers; it prints: {last.strip()[:200]}",
            help="set CC to the C compiler of the build, and give its options after `--`",
        )
    target = TARGET.search(output)
    own = tuple(word for word in command[1:] if word.startswith(OPTION_PREFIXES))
    return Compiler(found, "" if target is None else target[1], own)
