"""The page on existing C, followed to the letter."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.docs.test_tutorial import FENCE, PUT, ROOT, follow
from tests.needs import need

PAGE = ROOT / "docs" / "how-to" / "existing-c.md"


@pytest.mark.slow
@pytest.mark.cc
def test_the_page_does_what_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, require_tool: Callable[[str], str]
) -> None:
    require_tool("cc")
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
        else:
            assert language == "console", content
            commands += follow(content, tmp_path)
    assert commands == 10
