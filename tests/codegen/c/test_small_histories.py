"""C for size of charts with histories compiles without a warning, whatever a path skips."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.cli import execute

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
CHART = """
chart: Skips
events: {in: [go, back]}
initial: a
states:
  a:
    initial: x
    states:
      h: {history: shallow, default: y}
      x: {on: {go: y}}
      y: {on: {go: out}}
  out: {on: {back: h}}
"""


@pytest.mark.external
def test_shallow_histories(tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    (tmp_path / "skips.yaml").write_text(CHART)
    argv = ["compile", str(tmp_path / "skips.yaml"), "--optimize", "size", "--out", str(tmp_path)]
    assert execute(argv) == 0
    assert "_path_step(" in (tmp_path / "skips.c").read_text()
    for compiler in ("gcc", "clang"):
        command = (require_tool(compiler), *STRICT, "-c", "skips.c", "-o", "skips.o")
        subprocess.run(command, cwd=tmp_path, check=True)
