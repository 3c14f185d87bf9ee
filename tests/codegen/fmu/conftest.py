"""Shared parts of the tests of FMUs."""

from __future__ import annotations

from importlib.util import find_spec

import pytest

from tests.needs import need


@pytest.fixture(autouse=True)
def _fmpy() -> None:
    need(find_spec("fmpy") is not None, "fmpy")
