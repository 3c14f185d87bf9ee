"""CAN, ROS 2 and ZeroMQ in one system: it is proved, and runs with losses as it was proved."""

from __future__ import annotations

import os
import socket
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest

import fsmkit
from machines.moulding_line import __main__ as line
from machines.moulding_line.judge import Judged, Row, judge
from tests.needs import need, tool

FOLDER = Path(__file__).parents[2] / "machines/moulding_line"


@pytest.mark.cc
@pytest.mark.slow
@pytest.mark.parametrize("name", line.SYSTEMS)
def test_what_the_record_is_judged_by_is_proved(name: str) -> None:
    report = fsmkit.check(FOLDER / f"{name}.yaml")
    properties = fsmkit.read_system(FOLDER / f"{name}.yaml").properties
    expected = {each.name: "holds" for each in properties} | {
        "deadlock": "holds",
        "livelock": "holds",
    }
    assert {each.name: each.verdict.value for each in report.results} == expected


@pytest.mark.cc
@pytest.mark.slow
def test_a_molder_that_waits_too_short_moulds_beside_a_silent_heater(tmp_path: Path) -> None:
    text = (FOLDER / "molder.yaml").read_text(encoding="utf-8")
    assert "T_SILENT: 1100ms" in text
    hasty = tmp_path / "molder.yaml"
    hasty.write_text(text.replace("T_SILENT: 1100ms", "T_SILENT: 900ms"), encoding="utf-8")
    system = fsmkit.read_system(FOLDER / "heating.yaml", replace={"molder": hasty})
    report = fsmkit.check(system, properties=("never_blind",))
    (blind,) = (each for each in report.results if each.name == "never_blind")
    assert blind.verdict.value == "violated"


@pytest.mark.external
@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize("press", ["python", "c"])
def test_the_line_runs_with_losses_as_it_was_proved(tmp_path: Path, press: str) -> None:
    if press == "c":
        tool("idlc")
        need(Path("/usr/include/dds/dds.h").exists(), "cyclonedds-dev")
    for package in ("can", "cantools", "cyclonedds", "zmq"):
        need(find_spec(package) is not None, package)
    said = line.run(tmp_path, 10, 0.05, seed=5, deployment=elsewhere(tmp_path), press=press)
    assert len(said) == 4
    rows = line.read_rows(tmp_path)
    verdicts = {found.name: found.holds for _, found in line.judged(rows)}
    assert verdicts == {
        "closed_while_pushing": True,
        "served_is_wanted": True,
        "judges_what_was_moulded": True,
        "goes_on": None,
        "never_cold": True,
        "never_blind": None,
        "moulds": True,
    }
    assert line.moulded(rows) >= 1


def elsewhere(folder: Path) -> Path:
    """Write the deployment with a domain and ports that no other run on this computer has."""
    text = (FOLDER / "deployment.yaml").read_text(encoding="utf-8")
    text = text.replace("system: line.yaml", f"system: {FOLDER / 'line.yaml'}")
    text = text.replace("dbc: ..", f"dbc: {FOLDER.parent}")
    text = text.replace("domain: 17", f"domain: {20 + os.getpid() % 200}")
    for port in ("5591", "5592", "43117"):
        kind = socket.SOCK_DGRAM if port == "43117" else socket.SOCK_STREAM
        with socket.socket(socket.AF_INET, kind) as free:
            free.bind(("127.0.0.1", 0))
            text = text.replace(port, str(free.getsockname()[1]))
    (folder / "deployment.yaml").write_text(text, encoding="utf-8")
    return folder / "deployment.yaml"


def rows_of(*changes: tuple[int, int, str]) -> list[Row]:
    """Return the rows of a molder: the time in ms, the temperature, the leaf of the cycle."""
    chart = fsmkit.read_chart(FOLDER / "molder.yaml")
    index = chart.state_index
    return [
        Row(at * 1_000_000, "molder", frozenset({index["warm"], index[leaf]}), [0], [temperature])
        for at, temperature, leaf in changes
    ]


def verdict(rows: list[Row], name: str) -> Judged:
    system = fsmkit.read_system(FOLDER / "heating.yaml")
    return next(found for found in judge(system, rows) if found.name == name)


def test_a_record_that_breaks_a_property_is_judged_so() -> None:
    begin = (0, 1900, "asking")
    sound = rows_of(begin, (100, 1900, "molding"), (200, 1499, "molding"), (205, 1499, "filled"))
    assert verdict(sound, "never_cold").holds is True
    assert verdict(sound, "moulds").holds is False  # no block was
    late = replace(sound[-1], at=206_000_000)
    assert verdict([*sound[:-1], late], "never_cold") == Judged("never_cold", False, 0.2)
    assert verdict(rows_of(begin, (90, 1900, "judging")), "moulds") == Judged("moulds", True, 0.09)
    assert verdict(sound, "never_blind").holds is None  # of the heater there is no record
