"""What the tests of CAN share."""

from __future__ import annotations

import socket
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.needs import need

HERE = Path(__file__).parent
HEATER = HERE / "heater.dbc"
RUNTIME = HERE.parents[2] / "fsmkit/runtime/c"


def free_port() -> int:
    """Return a port of UDP that nobody has now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("", 0))
        return int(free.getsockname()[1])


@pytest.fixture(autouse=True)
def _cantools() -> None:
    need(find_spec("cantools") is not None, "cantools")
