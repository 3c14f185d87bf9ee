"""What a reader of the pages has."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from tests.docs.pages import ROOT


@pytest.fixture
def of_a_user(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have `fsmkit` of this checkout, a terminal of 80 columns and the usual compiler."""
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.delenv("CC", raising=False)
