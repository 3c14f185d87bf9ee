"""The pages on saving, replaying and tracing: files are written, commands run, and print that."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

PAGES = Path(__file__).parents[2] / "docs/how-to"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PUT = re.compile(r"[Pp]ut this into `([^`]+)`:\s*$")


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize(("page", "commands"), [("save-and-replay", 5), ("trace", 4)])
def test_what_the_commands_print(
    page: str, commands: int, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    require_tool("cc")
    text, end = (PAGES / f"{page}.md").read_text(encoding="utf-8"), 0
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    ran = 0
    for block in BLOCK.finditer(text):
        if put := PUT.search(text[end : block.start()]):
            (tmp_path / put[1]).write_text(block[2], encoding="utf-8")
        end = block.end()
        for command in re.split(r"^\$ ", block[2], flags=re.MULTILINE)[1:]:
            line, _, printed = command.partition("\n")
            done = subprocess.run(
                line, shell=True, cwd=tmp_path, env=os.environ | {"PATH": path},
                capture_output=True, text=True, check=False,
            )  # fmt: skip
            assert done.returncode == 0, (line, done.stderr)
            assert done.stdout == printed, line
            ran += 1
    assert ran == commands
