"""The tools that measure: compilers, the counter of instructions, the lister of sections."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

HOST = ("gcc", "-O2")
CORTEX_M0 = ("arm-none-eabi-gcc", "-Os", "-mcpu=cortex-m0", "-mthumb")
COUNTER = ("valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null")
SIZES = {HOST: "size", CORTEX_M0: "arm-none-eabi-size"}

INSTALLED_BY_MAKE = ("valgrind", "arm-none-eabi-gcc", "arm-none-eabi-size")

_COUNTED = re.compile(r"I\s+refs:\s+([\d,]+)")
_SECTION = re.compile(r"^(\S+)\s+(\d+)\s+\d+\s*$", re.MULTILINE)


class UnavailableError(Exception):
    """A tool, a package or a feature that a measurement needs is missing; the text names it."""


def run(command: Sequence[str | Path], folder: Path) -> str:
    """Return the output of a command; raises `UnavailableError` if it is missing or fails."""
    words = [str(word) for word in command]
    if shutil.which(words[0], path=None) is None and not Path(words[0]).is_file():
        help_ = "; `make tools` installs it" if words[0] in INSTALLED_BY_MAKE else ""
        raise UnavailableError(f"{words[0]} is not installed{help_}")
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        said = "\n".join((done.stderr or done.stdout).splitlines()[-8:])
        raise UnavailableError(f"{Path(words[0]).name} failed ({done.returncode}): {said}")
    return done.stdout + done.stderr


def version(tool: str, folder: Path) -> str:
    """Return the first line of a tool's version output; empty if it is missing."""
    try:
        return run([tool, "--version"], folder).splitlines()[0]
    except (UnavailableError, IndexError):
        return ""


def revision(root: Path) -> str:
    """Return the version of fsmkit and, in a checkout, its commit; ``-dirty`` with changes."""
    try:
        commit = run(["git", "describe", "--always", "--dirty", "--abbrev=12"], root).strip()
    except UnavailableError:
        commit = ""
    return f"{metadata.version('fsmkit')} {commit}".strip()


def instructions(command: Sequence[str | Path], folder: Path) -> int:
    """Return the instructions that a program executes."""
    return read_count(run([*COUNTER, *command], folder))


def read_count(text: str) -> int:
    """Return the number of instructions in the summary of cachegrind."""
    found = _COUNTED.search(text)
    if found is None:
        raise UnavailableError("cachegrind counted nothing")
    return int(found[1].replace(",", ""))


def sections(tool: tuple[str, ...], file: Path) -> dict[str, int]:
    """Return the bytes of each section of an object file; equal names are added."""
    return read_sections(run([SIZES[tool], "-A", "-d", file], file.parent))


def read_sections(text: str) -> dict[str, int]:
    """Return the bytes of each section in the output of ``size -A -d``."""
    found: dict[str, int] = {}
    for name, size in _SECTION.findall(text):
        found[name] = found.get(name, 0) + int(size)
    return found


def code_bytes(sections: dict[str, int]) -> int:
    """Return the bytes of code and constants, which a machine needs in flash memory.

    Initialized data count, because flash holds their initial values; unwind tables do not.
    """
    kinds = (".text", ".rodata", ".data")
    return sum(
        size for name, size in sections.items()
        if any(name == kind or name.startswith(f"{kind}.") for kind in kinds)
    )  # fmt: skip
