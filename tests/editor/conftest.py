"""One server for all tests of the editor: it starts once, and answers for a copy of the cell."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.editor.client import Editor

CELL = Path(__file__).parents[2] / "machines" / "production_cell"


@pytest.fixture(scope="session")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the cell, which tests may change."""
    folder = (tmp_path_factory.mktemp("editor") / "cell").resolve()
    kept = shutil.ignore_patterns("*.py", "*.c", "*.h", "__pycache__", "mutants", "homing", "rest")
    shutil.copytree(CELL, folder, ignore=kept)
    return folder


@pytest.fixture(scope="session")
def server(cell: Path) -> Iterator[Editor]:
    """Return an editor with a server for the cell."""
    editor = Editor(cell)
    yield editor
    editor.close()


@pytest.fixture
def editor(server: Editor) -> Iterator[Editor]:
    """Return the editor; what a test opens is closed after it."""
    yield server
    for path in list(server.versions):
        server.shut(path)
    server.texts.clear()
    assert not [m for m in server.messages if "Traceback" in m or "Error" in m]
    server.messages.clear()
