"""What several tests of exports look at."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.export.collect import network_of
from fsmkit.export.exporter import ExportOptions
from fsmkit.export.network import Network
from fsmkit.system.any_file import load_any
from tests.verify.conftest import load  # noqa: F401

CHART = Path(__file__).parents[2] / "machines/production_cell/supervisor.yaml"


@pytest.fixture(scope="module")
def supervisor() -> Network:
    """Return a chart that stands open, untimed, as exports have it."""
    return network_of(load_any(CHART, Findings()), ExportOptions(untimed=True))
