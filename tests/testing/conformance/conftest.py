"""Where the public test data are: not part of the project, and skipped where not at hand."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

FOLDER = Path(
    os.environ.get("FSMKIT_CONFORMANCE", Path(__file__).parents[4] / "shared" / "conformance")
)


@pytest.fixture(scope="session")
def shared() -> Callable[[str], Path]:
    """Give the folder of a suite, or skip the test."""

    def find(suite: str) -> Path:
        folder = FOLDER / suite
        if not folder.is_dir():
            pytest.fail(f"the public test data are not at {folder}; set FSMKIT_CONFORMANCE")
        return folder

    return find
