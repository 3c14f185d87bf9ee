"""What the tests of CAN share."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.needs import need

HERE = Path(__file__).parent
HEATER = HERE / "heater.dbc"
RUNTIME = HERE.parents[1] / "fsmkit/runtime/c"


@pytest.fixture(autouse=True)
def _cantools() -> None:
    need(find_spec("cantools") is not None, "cantools")
