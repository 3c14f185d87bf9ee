"""The C compiler of this computer."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from fsmkit.diagnostics import fail

CANDIDATES = ("cc", "gcc", "clang")
QUICKEST = ("clang", "cc", "gcc")
"""Without optimization clang takes half the time of gcc."""


def find_compiler(candidates: Sequence[str] = CANDIDATES) -> list[str]:
    """Return the command of the C compiler: ``$CC``, else the first installed candidate."""
    chosen = os.environ.get("CC", "").strip()
    for candidate in [chosen] if chosen else candidates:
        words = shlex.split(candidate)
        if words and shutil.which(words[0]):
            return words
    what = f"`{chosen}` of the variable CC" if chosen else "cc, gcc or clang"
    raise fail(
        "no-c-compiler", f"there is no C compiler: {what} was not found",
        help="install gcc or clang, or name a compiler in the variable CC",
    )  # fmt: skip


def compile_c(
    arguments: Sequence[str | Path],
    folder: Path,
    candidates: Sequence[str] = CANDIDATES,
    *,
    compiler: Sequence[str] = (),
) -> None:
    """Run the compiler in a folder. A diagnostic for generated code is a bug of fsmkit.

    ``compiler``: its command, for instance of a cross compiler; by default `find_compiler`.
    """
    command = [*(compiler or find_compiler(candidates)), *map(str, arguments)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        shown = "\n".join(done.stderr.splitlines()[:20])
        raise fail(
            "c-compiler-failed", f"`{command[0]}` rejected the generated code:\n{shown}",
            help="this is a bug of fsmkit, unless the compiler knows no C99: please report it",
        )  # fmt: skip
