"""The page on pages that simulate, followed to the letter."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from tests.docs.test_tutorial import FENCE, PUT, ROOT, follow

PAGE = ROOT / "docs" / "how-to" / "simulate.md"


@pytest.mark.slow
@pytest.mark.cc
def test_the_page_does_what_it_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = Path(sys.executable).parent
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    text, end, commands = PAGE.read_text(encoding="utf-8"), 0, 0
    for block in FENCE.finditer(text):
        before, (language, content) = text[end : block.start()], block.groups()
        end = block.end()
        if language == "console":
            commands += follow(content, tmp_path)
        else:
            put = PUT.search(before)
            assert put is not None, content
            (tmp_path / put[1]).write_text(content, encoding="utf-8")
    assert commands == 2
    assert (tmp_path / "gate.html").stat().st_size > 100_000
