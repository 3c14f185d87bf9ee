"""The tutorial, followed to the letter: its files are written, its commands run."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "tutorial" / "first-machine.md"
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PUT = re.compile(r"[Pp]ut\s+this\s+into\s+`([^`]+)`:\s*$")
REPLACE = re.compile(r"[Rr]eplace the last line of `([^`]+)` by\s*$")
FIGURES = re.compile(r"; [\d.]+ s, (at once|[\d,]+ states/s)")
"""How long an exploration took: it differs from run to run. All other figures are compared."""


@pytest.mark.slow
@pytest.mark.cc
def test_the_tutorial_does_what_it_says(
    tmp_path: Path, require_tool: Callable[[str], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    require_tool("cc")
    require_tool("dot")
    folder = Path(sys.executable).parent
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    monkeypatch.delenv("CC", raising=False)
    text, end, commands = PAGE.read_text(encoding="utf-8"), 0, 0
    for block in FENCE.finditer(text):
        before, (language, content) = text[end : block.start()], block.groups()
        end = block.end()
        if put := PUT.search(before):
            (tmp_path / put[1]).write_text(content, encoding="utf-8")
        elif replace := REPLACE.search(before):
            lines = (tmp_path / replace[1]).read_text(encoding="utf-8").splitlines()
            (tmp_path / replace[1]).write_text("\n".join([*lines[:-1], content]), encoding="utf-8")
        else:
            assert language == "console", content
            commands += follow(content, tmp_path)
    assert commands >= 9


def follow(block: str, folder: Path) -> int:
    """Run the commands of a block, and compare what they print; return how many there are."""
    parts = re.split(r"^\$ (.*)\n", block, flags=re.MULTILINE)
    assert parts[0] == ""
    for command, expected in zip(parts[1::2], parts[2::2], strict=True):
        done = subprocess.run(
            ["/bin/sh", "-c", f"{command} 2>&1"],
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
        )
        assert tidy(done.stdout) == tidy(expected), command
    return len(parts) // 2


def tidy(printed: str) -> list[str]:
    return [FIGURES.sub("", line).rstrip() for line in printed.splitlines()]
