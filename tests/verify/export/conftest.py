"""What several tests of exports look at."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.verify.export.collect import network_of
from fsmkit.verify.export.exporter import Wanted
from fsmkit.verify.export.network import Network
from fsmkit.verify.replay import load_any

CHART = Path(__file__).parents[3] / "machines/production_cell/supervisor.yaml"


@pytest.fixture(scope="module")
def supervisor() -> Network:
    """Return a chart that stands open, untimed, as exports have it."""
    return network_of(load_any(CHART, Findings()), Wanted(untimed=True))
