"""The page on charts of others, followed to the letter; its C is compiled with the machine's."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.loading import load
from fsmkit.plugins import Target, plugin
from tests.docs.test_tutorial import FENCE, PUT, ROOT, follow

PAGE = ROOT / "docs" / "how-to" / "sub-charts.md"
WARNINGS = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]


@pytest.mark.cc
def test_the_page_does_what_it_says(
    tmp_path: Path, require_tool: Callable[[str], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    compiler = require_tool("cc")
    folder = Path(sys.executable).parent
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    text, end, commands, of_host = PAGE.read_text(encoding="utf-8"), 0, 0, ""
    for block in FENCE.finditer(text):
        before, (language, content) = text[end : block.start()], block.groups()
        end = block.end()
        if language == "console":
            commands += follow(content, tmp_path)
        elif language == "c":
            of_host = content
        else:
            put = PUT.search(before)
            assert put is not None, content
            (tmp_path / put[1]).write_text(content, encoding="utf-8")
    assert commands == 1
    made = plugin(Target, "c").generate(load(tmp_path / "press.yaml"), Findings(), {})
    assert made is not None
    for name, written in made.files.items():
        (tmp_path / str(name)).write_text(str(written), encoding="utf-8")
    prototype = "uint8_t sum_of_tries(const press *m);\n"
    (tmp_path / "host.c").write_text(f'#include "press.h"\n{prototype}{of_host}')
    for source in ("press.c", "host.c"):
        command = [compiler, *WARNINGS, "-c", source]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
