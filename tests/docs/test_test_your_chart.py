"""The page on tests of charts: its files are written, its commands run, and print that."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/how-to/test-your-chart.md"
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PUT = re.compile(r"Put this into `([^`]+)`:\s*$")


@pytest.mark.cc
@pytest.mark.slow
def test_what_the_commands_print(tmp_path: Path) -> None:
    text, end, ran = PAGE.read_text(encoding="utf-8"), 0, 0
    environment = os.environ | {"COLUMNS": "80", "PYTHONPATH": str(ROOT)}
    python = ""
    for block in BLOCK.finditer(text):
        if put := PUT.search(text[end : block.start()]):
            (tmp_path / put[1]).write_text(block[2], encoding="utf-8")
        end = block.end()
        python = block[2] if block[1] == "python" else python
        for command in re.split(r"^\$ ", block[2], flags=re.MULTILINE)[1:]:
            line, _, printed = command.partition("\n")
            own = re.sub("^fsmkit ", f"{shlex.quote(sys.executable)} -m fsmkit ", line)
            done = subprocess.run(
                ["sh", "-c", own],
                cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
            )  # fmt: skip
            assert done.returncode == 0, (line, done.stderr)
            assert done.stdout == printed, line
            ran += 1
    assert ran == 9
    (tmp_path / "test_gate.py").write_text(python)
    plain = environment | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "fsmkit.testing.pytest_plugin"],
        cwd=tmp_path, env=plain, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "3 passed" in done.stdout, done.stdout
