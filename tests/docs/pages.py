"""Follows a page of the documentation to the letter."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PUT = re.compile(r"[Pp]ut\s+this\s+into\s+`([^`]+)`[^\n]*:\s*$")
REPLACE = re.compile(r"[Rr]eplace the last line of `([^`]+)` by\s*$")
COMMAND = re.compile(r"^\$ (.*)\n", re.MULTILINE)
CODE = re.compile(r"\s# exit code (\d+)$")
"""A comment behind a command that does not end with 0."""
VARYING = re.compile(r"; explored in (less than 0.1 s|[\d.]+ s, [\d,]+ states/s)|(?<=, lines )\d+")
"""How long an exploration took, and how long a generated file is. All else is compared."""


def follow_page(page: Path, folder: Path, *, with_errors: bool = True) -> int:
    """Write the files of a page, run its commands in their order; return how many there are.

    A file is announced by the words `put this into`, a new end of one by `replace the last line
    of`. A block `console` has commands and what they print, ``with_errors`` on standard error, too;
    `cd` holds for all that follows. A command ends with 0, unless its comment says `# exit code 1`.
    Blocks of other languages show something.
    """
    text, end, count = page.read_text(encoding="utf-8"), 0, 0
    for block in FENCE.finditer(text):
        before, (language, content) = text[end : block.start()], block.groups()
        end = block.end()
        if put := PUT.search(before):
            (folder / put[1]).write_text(content, encoding="utf-8")
        elif replace := REPLACE.search(before):
            lines = (folder / replace[1]).read_text(encoding="utf-8").splitlines()
            (folder / replace[1]).write_text("\n".join([*lines[:-1], content]), encoding="utf-8")
        elif language == "console":
            first, *parts = COMMAND.split(content)
            assert first == ""
            for command, expected in zip(parts[::2], parts[1::2], strict=True):
                folder = _run(command, expected, folder, with_errors=with_errors)
            count += len(parts) // 2
    return count


def blocks(page: Path, language: str) -> list[str]:
    """Return the blocks of a page in a language."""
    return [content for found, content in FENCE.findall(page.read_text()) if found == language]


def _run(command: str, expected: str, folder: Path, *, with_errors: bool) -> Path:
    """Run a command, compare what it prints, and return the folder in which the next one runs."""
    if command.startswith("cd "):
        return (folder / command.removeprefix("cd ")).resolve(strict=True)
    errors = subprocess.STDOUT if with_errors else subprocess.DEVNULL
    done = subprocess.run(
        ["/bin/sh", "-c", command],
        cwd=folder, stdout=subprocess.PIPE, stderr=errors, text=True, check=False,
    )  # fmt: skip
    assert _tidy(done.stdout) == _tidy(expected), command
    said = CODE.search(command)
    assert done.returncode == (int(said[1]) if said else 0), command
    return folder


def _tidy(printed: str) -> list[str]:
    return [VARYING.sub("", line).rstrip() for line in printed.splitlines()]
