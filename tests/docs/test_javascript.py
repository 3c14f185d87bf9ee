"""The page on generated JavaScript, followed to the letter."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.docs.test_tutorial import FENCE, PUT, ROOT, follow

PAGE = ROOT / "docs" / "reference" / "javascript.md"


@pytest.mark.slow
@pytest.mark.external
def test_the_page_does_what_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, require_tool: Callable[[str], str]
) -> None:
    require_tool("node")
    folder = Path(sys.executable).parent
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    text, end, commands = PAGE.read_text(encoding="utf-8"), 0, 0
    for block in FENCE.finditer(text):
        before, (language, content) = text[end : block.start()], block.groups()
        end = block.end()
        if put := PUT.search(before):
            (tmp_path / put[1]).write_text(content, encoding="utf-8")
        else:
            assert language == "console", content
            commands += follow(content, tmp_path)
    assert commands == 2
