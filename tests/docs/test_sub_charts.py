"""The page on charts of others, followed to the letter; its C is compiled with the machine's."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.chart.loading import load
from fsmkit.codegen.target import Target
from fsmkit.diagnostics import Findings
from fsmkit.plugins import plugin
from tests.docs.pages import DOCS, blocks, follow_page

PAGE = DOCS / "how-to" / "sub-charts.md"
WARNINGS = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]


@pytest.mark.cc
@pytest.mark.usefixtures("of_a_user")
def test_the_page_does_what_it_says(tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    compiler = require_tool("cc")
    assert follow_page(PAGE, tmp_path) == 1
    (of_host,) = blocks(PAGE, "c")
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
