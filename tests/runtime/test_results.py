"""Results of operations in simulations: as the ``from`` list declares them, or as given."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import fsmkit
from fsmkit.cli import execute
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.scenarios import read_scenario
from fsmkit.runtime.script import SeededHost
from fsmkit.system.of_one_chart import system_of
from tests.inspector.conftest import Client

CHART = """
chart: Drill
types: {Kind: [none, hot = 4, lost = -2], Pair: {a: 0..9, b: bool}}
data: {got: 0..24000 = 0, kind: Kind = Kind.none, wide: int64 = 0, weight: float64 = 0.0}
operations:
  - speed() -> 0..24000 from {0, 50, 24000}
  - what() -> Kind from {Kind.hot, Kind.lost}
  - far() -> int64 from {-9007199254740993, 9007199254740993}
  - weigh() -> float64 from {0.5, -1.25}
  - stop()
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
    host = SeededHost(fsmkit.read_chart(path), seed=7)
    for operation, values in LISTED.items():
        assert {host.call(operation, ()) for _ in range(100)} == values


@pytest.mark.parametrize(
    "target",
    [
        "interpreter",
        "python",
        *(pytest.param(n, marks=pytest.mark.external) for n in ("c", "javascript")),
    ],
)
def test_every_target_returns_the_same_results(
    path: Path, target: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """By chance as listed; once results are given these, in their order, and the last one stays."""
    events = "go;" * 40 + "speed returns 7, 8; what returns none; far returns 5;" + "go;" * 3
    assert execute(["run", str(path), "--trace", "--events", events]) == 0
    expected = capsys.readouterr().out
    assert execute(["run", str(path), "--target", target, "--trace", "--events", events]) == 0
    assert capsys.readouterr().out == expected
    speeds = [line.split("= ")[1] for line in expected.splitlines() if "op speed" in line]
    assert set(speeds[:-3]) == {"0", "50", "24000"}
    assert speeds[-3:] == ["7", "8", "8"]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("speed returns", "the result of `speed` needs a value of type `0..24000`"),
        ("speed returns 24001", "the result of `speed` is outside `0..24000`: 24001"),
        ("speed returns 1, x", "the result of `speed` is `0..24000`: `x` is not a valid number"),
        ("sped returns 1", "there is no operation with a result `sped`"),
        ("stop returns 1", "the operation `stop` returns nothing"),
    ],
)
def test_a_wrong_result_is_a_finding(
    path: Path, line: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["run", str(path), "--events", f"go; {line}"]) == 1
    assert message in capsys.readouterr().err


def saying(path: Path, seed: int) -> Client:
    """Return a client that has given results, let the machine call, and gone back once."""
    client = Client(Hub(fsmkit.read_chart(path), file=path, seed=seed))
    client.result("post", m="Drill", event="go")
    client.result("returns", m="Drill", operation="speed", results=[7, 8])
    for _ in range(3):
        client.result("post", m="Drill", event="go")
    return client


def test_results_are_part_of_the_history(path: Path) -> None:
    client = saying(path, 3)
    assert client.result("watch", expression="got")["value"] == 8
    client.result("seek", n=4)  # where they were given
    client.result("post", m="Drill", event="go")
    assert client.result("watch", expression="got")["value"] == 7


def test_a_client_that_gives_a_wrong_result_is_told_so(path: Path) -> None:
    client = Client(Hub(fsmkit.read_chart(path)))
    for operation, results, rule in (
        ("speed", [24_001], "wrong-value"),
        ("speed", [], "wrong-value"),
        ("stop", [1], "unknown-name"),
        ("sped", [1], "unknown-name"),
    ):
        given = {"m": "Drill", "operation": operation, "results": results}
        assert client.say("returns", **given)["rule"] == rule


@pytest.mark.parametrize("seed", [1, 3])
def test_a_session_with_results_is_saved(path: Path, seed: int) -> None:
    """As a script and as a pytest, which do the same again; also in a system."""
    client = saying(path, seed)
    script = client.result("save", **{"as": "script"})
    assert "returns speed 7 8" in script.splitlines()
    space: dict[str, Any] = {}
    exec(client.result("save", **{"as": "pytest"}), space)
    space["test_it_does_so_again"]()
    assert "op speed = 7" in space["TRACE"]


def test_a_script_with_results_is_a_scenario(path: Path, tmp_path: Path) -> None:
    script = tmp_path / "drill.script"
    script.write_text("start 0\nreturns speed 7 8\npost go\nrun 0\n", encoding="utf-8")
    (_, given, *_) = read_scenario(system_of(fsmkit.read_chart(path)), script).content["actions"]
    assert given == {"do": "returns", "m": "Drill", "operation": "speed", "results": [7, 8]}


@pytest.mark.usefixtures("path")
def test_machines_of_a_system_are_given_results(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    system = tmp_path / "drills.yaml"
    system.write_text(
        "system: Drills\nmachines: {a: drill.yaml, b: drill.yaml}\n"
        "environment: {may: [a.go, b.go]}\n"
    )
    events = "b.speed returns 7, 8; a.go; b.go; b.go"
    assert execute(["run", str(system), "--events", events, "--trace"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if line.startswith("b: op speed")] == [
        "b: op speed = 7",
        "b: op speed = 8",
    ]


def test_a_test_that_names_no_result_gets_a_listed_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "drill.yaml").write_text(CHART.replace("{0, 50", "{60, 50"), encoding="utf-8")
    tests = tmp_path / "drill.test.yaml"
    tests.write_text(
        "tests: Drill\nchart: drill.yaml\ncases: {one: [post go, {expect: {that: got == 60}}]}\n",
        encoding="utf-8",
    )
    assert execute(["test", str(tests)]) == 0, capsys.readouterr().out
