"""Follows a page of the documentation to the letter."""

from __future__ import annotations

import os
import re
import subprocess
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PUT = re.compile(r"[Pp]ut\s+this\s+into\s+`([^`]+)`[^\n]*:\s*$")
REPLACE = re.compile(r"[Rr]eplace the last line of `([^`]+)` by\s*$")
PICTURE = re.compile(r"\]\(\.\./(?P<stored>pictures/lesson-\d-(?P<drawn>[\w.-]+))\)")
TEXT = re.compile(r"<text [^>]*>([^<]*)</text>")
BLESS = bool(os.environ.get("FSMKIT_BLESS"))
COMMAND = re.compile(r"^\$ (.*)\n", re.MULTILINE)
CODE = re.compile(r"\s# exit code (\d+)$")
"""A comment behind a command that does not end with 0."""
VARYING = re.compile(
    r"; explored in (less than 0.1 s|[\d.]+ s, [\d,]+ states/s)|; (computed|checked) in [\d.]+ s"
    r"|(?<=, lines )\d+"
)
"""How long an exploration took, and how long a generated file is. All else is compared."""


def follow_page(page: Path, folder: Path, *, with_errors: bool = True) -> int:
    """Write the files of a page, run its commands in their order; return how many there are.

    The words `put this into` announce a file, `replace the last line of` a new end of one. A block
    `console` has commands and their output, ``with_errors`` on standard error, too; `cd` holds for
    all that follows. A command ends with 0, unless its comment says `# exit code 1`. Blocks of
    other languages show something. The pictures of a lesson are files that its commands write.

    With `FSMKIT_BLESS=1` the page receives the output, and `docs/pictures` the pictures.
    """
    text, end, count, parts, here = page.read_text(encoding="utf-8"), 0, 0, [], folder
    for block in FENCE.finditer(text):
        before, (language, content) = text[end : block.start()], block.groups()
        end = block.end()
        if put := PUT.search(before):
            (here / put[1]).write_text(content, encoding="utf-8")
        elif replace := REPLACE.search(before):
            lines = (here / replace[1]).read_text(encoding="utf-8").splitlines()
            (here / replace[1]).write_text("\n".join([*lines[:-1], content]), encoding="utf-8")
        elif language == "console":
            first, *found = COMMAND.split(content)
            assert first == ""
            content = ""
            for command, expected in zip(found[::2], found[1::2], strict=True):
                here, printed = _run(command, expected, here, with_errors=with_errors)
                content += f"$ {command}\n{printed}"
            count += len(found) // 2
        parts += [before, f"```{language}\n{content}```"]
    if BLESS:
        page.write_text("".join((*parts, text[end:])), encoding="utf-8")
    for picture in PICTURE.finditer(text):
        _compare_picture(DOCS / picture["stored"], folder / picture["drawn"])
    return count


def blocks(page: Path, language: str) -> list[str]:
    """Return the blocks of a page in a language."""
    return [content for found, content in FENCE.findall(page.read_text()) if found == language]


def _run(command: str, expected: str, folder: Path, *, with_errors: bool) -> tuple[Path, str]:
    """Run a command and compare its output; return the folder of the next one, and the output."""
    if command.startswith("cd "):
        return (folder / command.removeprefix("cd ")).resolve(strict=True), ""
    errors = subprocess.STDOUT if with_errors else subprocess.DEVNULL
    done = subprocess.run(
        ["/bin/sh", "-c", command],
        cwd=folder, stdout=subprocess.PIPE, stderr=errors, text=True, check=False,
    )  # fmt: skip
    is_equal = _tidy(done.stdout) == _tidy(expected)
    if not BLESS:
        assert _tidy(done.stdout) == _tidy(expected), command
    exit_code = CODE.search(command)
    wanted = int(exit_code[1]) if exit_code else 0
    assert done.returncode == wanted, f"{command}\n{done.stdout}"
    printed = (
        expected if is_equal else "".join(f"{each.rstrip()}\n" for each in done.stdout.splitlines())
    )
    return folder, printed


def _compare_picture(stored: Path, drawn: Path) -> None:
    """Compare the texts of two pictures; Graphviz places them differently in each version."""
    if BLESS:
        stored.write_bytes(drawn.read_bytes())
    texts = [Counter(TEXT.findall(each.read_text(encoding="utf-8"))) for each in (stored, drawn)]
    assert texts[0] == texts[1], stored.name
    assert texts[0]


def _tidy(printed: str) -> list[str]:
    return [VARYING.sub("", line).rstrip() for line in printed.splitlines()]
