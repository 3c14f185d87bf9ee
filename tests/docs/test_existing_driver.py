"""The tutorial on a driver, followed to the letter."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.docs.test_tutorial import FENCE, PUT, REPLACE, ROOT, follow
from tests.needs import need

PAGE = ROOT / "docs" / "tutorial" / "existing-driver.md"


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.external
def test_the_tutorial_does_what_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, require_tool: Callable[[str], str]
) -> None:
    require_tool("cc")
    require_tool("cmake")
    need(find_spec("clang") is not None, "libclang")
    folder = Path(sys.executable).parent
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
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
    assert commands == 14
