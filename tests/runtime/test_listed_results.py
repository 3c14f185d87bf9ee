"""A simulation returns results of an operation only as its ``from`` list declares them."""

from __future__ import annotations

from pathlib import Path

import pytest

import fsmkit
from fsmkit.cli import execute
from fsmkit.inspector.simulation import Simulation
from fsmkit.runtime.script import DeclaredHost
from fsmkit.system.system import system_of

CHART = """
chart: Drill
types: {Kind: [none, hot = 4, lost = -2], Pair: {a: 0..9, b: bool}}
data: {got: 0..24000 = 0, kind: Kind = Kind.none, wide: int64 = 0, weight: float64 = 0.0}
operations:
  - speed() -> 0..24000 from {0, 50, 24000}
  - what() -> Kind from {Kind.hot, Kind.lost}
  - far() -> int64 from {-9007199254740993, 9007199254740993}
  - weigh() -> float64 from {0.5, -1.25}
events: {in: [go]}
initial: idle
states:
  idle: {on: {go: {do: [got = speed(), kind = what(), wide = far(), weight = weigh()]}}}
"""
LISTED = {
    "speed": {0, 50, 24_000},
    "what": {4, -2},
    "far": {-(2**53) - 1, 2**53 + 1},
    "weigh": {0.5, -1.25},
}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    found = tmp_path / "drill.yaml"
    found.write_text(CHART, encoding="utf-8")
    return found


def test_a_host_returns_each_value_of_the_list_and_no_other(path: Path) -> None:
    host = DeclaredHost(fsmkit.read_chart(path), seed=7)
    for operation, values in LISTED.items():
        assert {host.call(operation, ()) for _ in range(100)} == values


def test_a_run_and_a_simulation_use_it(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["run", str(path), "--events", "go;" * 40]) == 0
    printed = capsys.readouterr().out
    found = {line.split("= ")[1] for line in printed.splitlines() if "speed() =" in line}
    assert found == {"0", "50", "24000"}
    simulation = Simulation(system_of(fsmkit.read_chart(path)))
    assert all(isinstance(host, DeclaredHost) for host in simulation._hosts)
