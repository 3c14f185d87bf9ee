"""The page on other model checkers: its commands run, and print what it shows."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

from fsmkit.cli import execute
from tests.export.other_checkers import has_storm
from tests.needs import need

pytestmark = pytest.mark.cc

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/how-to/other-checkers.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w*)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


@pytest.fixture(name="folder")
def folder_with_models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Run the exports of the page in a copy of what they read."""
    shutil.copytree(ROOT / "machines/fischer", tmp_path / "machines/fischer")
    monkeypatch.chdir(tmp_path)
    for language, block in BLOCKS:
        if language == "console":
            command, _, shown = block.partition("\n")
            with redirect_stdout(StringIO()) as out:
                code = execute(command.removeprefix("$ fsmkit ").split())
            assert (code, out.getvalue()) == (0, shown)
    return tmp_path


@pytest.mark.slow
def test_spin(folder: Path, require_tool: Callable[[str], str]) -> None:
    require_tool("spin")
    (lines,) = [b.splitlines() for language, b in BLOCKS if not language and b.startswith("spin")]
    said = []
    for line in lines:
        done = subprocess.run(
            line, shell=True, cwd=folder, capture_output=True, text=True, check=True
        )
        said.append(done.stdout)
    assert "71 states, stored" in said[1]
    assert "71" in lines[1]
    assert "errors: 1" in said[2]


def test_storm(folder: Path) -> None:
    need(has_storm(), "stormpy")
    (number,) = [n for n, (language, _) in enumerate(BLOCKS) if language == "python"]
    done = subprocess.run(
        [sys.executable, "-c", BLOCKS[number][1]],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == BLOCKS[number + 1][1]
