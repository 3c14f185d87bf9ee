"""The tests that a page shows are tests: pytest collects them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.pages import DOCS, ROOT, blocks, follow_page

PAGE = DOCS / "how-to" / "test-your-chart.md"


@pytest.mark.cc
@pytest.mark.slow
@pytest.mark.usefixtures("of_a_user")
def test_the_page_and_its_tests(tmp_path: Path) -> None:
    assert follow_page(PAGE, tmp_path, with_errors=False) == 9
    (tmp_path / "test_gate.py").write_text(blocks(PAGE, "python")[-1])
    environment = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "fsmkit.testing.pytest_plugin"],
        cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "3 passed" in done.stdout, done.stdout
