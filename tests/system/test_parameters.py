"""Parameters of systems, and constants of charts that the command line sets."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import fsmkit
from fsmkit.cli import execute
from fsmkit.diagnostics import FsmkitError
from fsmkit.verify.replay import perform

NODE = """\
chart: Node
types: {Mode: [slow, fast]}
constants: {N: 1, T: 1s, MODE: Mode.slow}
data: {n: 0..9 = 0}
events: {in: [go], out: [gone(n 0..9)]}
initial: a
states:
  a: {on: {go: {target: b, do: n = N; send gone(n = N)}}}
  b: {after: {T: c}}
  c: {}
"""
SYSTEM = """\
system: Nodes
doc: N nodes
parameters: {N: 3, LAST: N - 1, T_HOLD: 10ms}
machines:
  "node[i in 0..LAST]": {chart: node.yaml, with: {N: N, T: 2 * T_HOLD}}
connect:
  - node[i].gone -> node[(i + 1) % N].go
environment: {may: ["node[0].go"]}
properties:
  all: {never: "count(i in 0..LAST: node[i].In(c)) == N"}
  In: {never: "node[0].In(b) and node[0].n > N"}
"""


@pytest.fixture
def nodes(tmp_path: Path) -> Path:
    (tmp_path / "node.yaml").write_text(NODE)
    (tmp_path / "nodes.yaml").write_text(SYSTEM)
    return tmp_path / "nodes.yaml"


def test_a_parameter_stands_for_its_value(nodes: Path) -> None:
    system = fsmkit.read_system(nodes)
    assert [machine.name for machine in system.machines] == ["node[0]", "node[1]", "node[2]"]
    assert dict(system.machines[0].chart.constants)["N"].value == 3
    assert dict(system.machines[0].chart.constants)["T"].value == 20
    assert system.parameters == (("N", "3"), ("LAST", "2"), ("T_HOLD", "10ms"))


def test_a_value_of_the_caller_counts(nodes: Path) -> None:
    system = fsmkit.read_system(nodes, parameters={"N": 5, "T_HOLD": "1s"})
    assert len(system.machines) == 5
    assert dict(system.machines[4].chart.constants)["T"].value == 2000
    given = {"N": 7, "MODE": "Mode.fast"}
    chart = fsmkit.read_chart(nodes.with_name("node.yaml"), parameters=given)
    assert [literal.value for _, literal in chart.constants] == [7, 1000, 1]


def test_the_same_system_is_written_by_hand(nodes: Path) -> None:
    by_hand = SYSTEM.replace("parameters: {N: 3, LAST: N - 1, T_HOLD: 10ms}\n", "")
    for name, value in (("LAST", "3"), ("T_HOLD", "10ms"), ("N: N", "N: 4"), ("% N", "% 4"), ("== N", "== 4"), ("> N", "> 4")):  # fmt: skip  # noqa: E501
        by_hand = by_hand.replace(name, value)
    nodes.with_name("by_hand.yaml").write_text(by_hand)
    assert (
        fsmkit.read_system(nodes, parameters={"N": 4}).machines
        == fsmkit.read_system(nodes.with_name("by_hand.yaml")).machines
    )


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"M": 3}, "the system has no parameter `M`"),
        ({"N": 0}, "an index cannot run over"),
        ({"N": "]"}, ""),
        ({"N": "3; drop"}, ""),
        ({"T_HOLD": "long"}, ""),
    ],
)
def test_a_value_that_is_none_is_a_finding(
    nodes: Path, given: dict[str, object], message: str
) -> None:
    with pytest.raises(FsmkitError) as error:
        fsmkit.read_system(nodes, parameters=given)
    assert message in str(error.value)


def test_a_chart_has_constants_only(nodes: Path) -> None:
    with pytest.raises(FsmkitError, match="has no constant `M`"):
        fsmkit.read_chart(nodes.with_name("node.yaml"), parameters={"M": 1})
    nodes.write_text(SYSTEM.replace("{N: 3", '{"N-1": 3, N: 3'))
    with pytest.raises(FsmkitError, match="is not a valid parameter name"):
        fsmkit.read(nodes)


@pytest.mark.parametrize(("wrong", "code"), [("N", 2), ("=3", 2), ("N=", 2), ("N=3=4", 1)])
def test_the_option_is_a_name_and_a_value(nodes: Path, wrong: str, code: int) -> None:
    assert execute(["check", str(nodes), "--set", wrong, "--engine", "python"]) == code


def test_check_says_what_was_set_and_its_trace_holds_it(
    nodes: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["check", str(nodes), "--engine", "python", "--time", "discrete", "--set", "N=2"]
    folder = tmp_path / "traces"
    assert execute([*command, "--save-trace", str(folder)]) == 1
    assert "with N = 2, LAST = 1, T_HOLD = 10ms" in capsys.readouterr().out
    assert execute([*command, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["parameters"]["N"] == "2"
    document = json.loads(next(folder.glob("*.json")).read_text())
    assert len(perform(document)) == len(document["steps"])


def test_other_verbs_take_it(nodes: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chart = str(nodes.with_name("node.yaml"))
    assert execute(["run", chart, "--set", "N=4", "--events", "go"]) == 0
    assert "out gone n=4" in capsys.readouterr().out
    assert execute(["show", chart, "--set", "T=3s"]) == 0
    assert "3s" in capsys.readouterr().out
