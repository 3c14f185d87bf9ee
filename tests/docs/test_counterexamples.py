"""Pages on `check`: their files are written, their commands run, and print that."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

HOW_TO = Path(__file__).parents[2] / "docs/how-to"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
MAY_CHANGE = re.compile(r"[\d.]+ s, (at once|[\d,]+ states/s)| +$", re.MULTILINE)
"""Seconds, and blanks at the end of a line."""
PUT = re.compile(r"[Pp]ut this into `([^`]+)`:\s*$")


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize(("page", "commands"), [("counterexamples", 10), ("mutants", 1)])
def test_what_the_commands_print(
    page: str, commands: int, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    require_tool("cc")
    text, end = (HOW_TO / f"{page}.md").read_text(encoding="utf-8"), 0
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = os.environ | {"PATH": path, "COLUMNS": "80"}
    ran = 0
    for block in BLOCK.finditer(text):
        if put := PUT.search(text[end : block.start()]):
            (tmp_path / put[1]).write_text(block[2], encoding="utf-8")
        end = block.end()
        for command in re.split(r"^\$ ", block[2], flags=re.MULTILINE)[1:]:
            line, _, printed = command.partition("\n")
            done = subprocess.run(
                line, shell=True, cwd=tmp_path, env=environment,
                capture_output=True, text=True, check=False,
            )  # fmt: skip
            expected = 1 if line.startswith("fsmkit check") and "|" not in line else 0
            assert done.returncode == expected, (line, done.stderr)
            assert MAY_CHANGE.sub("", done.stdout) == MAY_CHANGE.sub("", printed), line
            ran += 1
    assert ran == commands
    if page != "counterexamples":
        return
    svg = (tmp_path / "garage.svg").read_text(encoding="utf-8")
    assert "violated: never_stuck: gate.In(failed)" in svg
