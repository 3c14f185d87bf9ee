"""The worked example: what is proved of it rests on the cycle and the range of the DBC file."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import fsmkit
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings
from fsmkit.system.deployment.deployment import Deployment
from fsmkit.verify.explore import check

pytestmark = [pytest.mark.external, pytest.mark.cc]

FOLDER = Path(__file__).parents[3] / "machines/heated_mould"
HOLDS = {
    "deadlock": "holds",
    "livelock": "holds",
    "stops_when_silent": "holds",
    "stops_when_cold": "holds",
    "molds": "holds",
}


@pytest.fixture
def mould(tmp_path: Path) -> Path:
    shutil.copytree(FOLDER, tmp_path / "mould")
    return tmp_path / "mould"


def convert(folder: Path) -> str:
    """Write the chart of the heater again."""
    command = ["convert", str(folder / "heater.dbc"), "--to", "yaml", "--node", "HEATER"]
    assert execute([*command, "--may", "bus_off", "--out", str(folder / "heater.yaml")]) == 0
    return (folder / "heater.yaml").read_text()


def verdicts(folder: Path) -> dict[str, str]:
    found = fsmkit.read(folder / "deployment.yaml")
    assert isinstance(found, Deployment)
    report = check(found.written, Findings())
    return {result.name: result.verdict.value for result in report.results}


def test_all_holds_with_the_cycle_and_the_range_of_the_file(mould: Path) -> None:
    assert convert(mould) == (FOLDER / "heater.yaml").read_text()
    assert verdicts(mould) == HOLDS


def test_with_a_longer_cycle_the_module_moulds_on_in_silence(mould: Path) -> None:
    dbc = (mould / "heater.dbc").read_text()
    (mould / "heater.dbc").write_text(dbc.replace("BO_ 256 10;", "BO_ 256 1000;"))
    convert(mould)
    assert verdicts(mould) == {**HOLDS, "stops_when_silent": "violated"}
