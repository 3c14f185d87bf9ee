"""Foreign nodes of deployments: what is read, what is refused, what is written for the others."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import fsmkit
from fsmkit.cli import execute
from fsmkit.codegen.units.service import services_of
from fsmkit.diagnostics import FsmkitError
from fsmkit.runtime.links import EventMap
from tests.reading import load_deployment

FILES = {
    "oven.yaml": """\
system: Oven
machines: {control: control.yaml, heater: heater.yaml, fan: heater.yaml}
connect:
  - heater.warm -> control.warmed
  - control.set_power -> heater.set_power
  - heater.temperature -> control.temperature
environment: {will: [heater, fan]}
""",
    "control.yaml": """\
chart: Control
inputs: {temperature: -400..1000}
events: {in: [warmed(n 0..9)], out: [set_power(percent 0..100)]}
initial: idle
states:
  idle:
    on: {warmed: {if: temperature > 0, do: send set_power(percent = 5)}}
""",
    "heater.yaml": """\
chart: Heater
outputs: {temperature: -400..1000 = 0}
events: {in: [set_power(percent 0..100), seen(n 0..9)], out: [warm(n 0..9)]}
initial: on
states:
  on: {after: {10ms: {target: on, do: send warm(n = 1)}}}
""",
}
NODES = "{a: [control], can: {machines: [heater, fan], foreign: can}}"
LINKS = "links: {foreign: {can: {bus: can0, bitrate: 250000}}}\n"


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Write a deployment beside its system."""

    def written(nodes: str, links: str = LINKS, **changes: str) -> Path:
        for name, text in FILES.items():
            (tmp_path / name).write_text(changes.get(name.removesuffix(".yaml"), text))
        path = tmp_path / "deployment.yaml"
        path.write_text(f"system: oven.yaml\nnodes: {nodes}\n{links}", encoding="utf-8")
        return path

    return written


def test_a_foreign_node_has_its_place_in_the_map_and_no_program(
    write: Callable[..., Path], tmp_path: Path
) -> None:
    deployment = load_deployment(write(NODES))
    foreign = deployment.foreign[1]
    assert foreign is not None
    assert deployment.foreign[0] is None
    assert {name: text.value for name, text in foreign.options.items()} == {
        "bus": "can0",
        "bitrate": "250000",
    }
    assert [m.name for m in deployment.map.messages] == [
        "heater.warm -> control.warmed",
        "control.set_power -> heater.set_power",
    ]
    assert deployment.map.own_nodes == (0,)
    again = EventMap.from_json(deployment.map.as_json())
    assert (again.foreign, again.hash) == (("", "can"), deployment.map.hash)
    plain = load_deployment(write("{a: [control], can: [heater, fan]}", ""))
    assert plain.map.hash == deployment.map.hash
    assert '"foreign"' not in plain.map.as_json()
    assert execute(["compile", str(write(NODES)), "--out", str(tmp_path / "out")]) == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a", "links.json"]
    assert "NODE_CAN" in (tmp_path / "out/a/oven_a.h").read_text()


def test_only_nodes_of_fsmkit_have_endpoints_services_and_health(
    write: Callable[..., Path], tmp_path: Path
) -> None:
    ends = LINKS.replace("{foreign", "{endpoints: {a: 'ipc://x'}, foreign")
    deployment = load_deployment(write(NODES, ends + "health: {a: 'ipc://h'}\n"))
    assert deployment.map.endpoints == ("ipc://x", "")
    assert deployment.health == ("ipc://h", "")
    assert [service.node for service in services_of(deployment, "/bin/x {node}")] == ["a"]
    assert execute(["compile", str(write(NODES, ends)), "--out", str(tmp_path / "out")]) == 0
    assert '"ipc://x",\n    NULL,' in (tmp_path / "out/a/oven_a.c").read_text()


@pytest.mark.parametrize(
    ("nodes", "links", "rule", "message", "place"),
    [
        ("{a: {machines: [control], foreign: can}, b: [heater]}", "", "broken-deployment",
         "`control` is not of the environment, and `a` is foreign", "control"),
        ("{a: [control], b: {machines: [heater], foreign: canned}}", "", "unexpected-value",
         "no foreign nodes of the kind `canned`", "canned"),
        ("{a: [control], b: {machines: [heater], strange: can}}", "", "unknown-key",
         "strange", "strange"),
        ("{a: [control], b: {machines: [heater], foreign: [can]}}", "", "unexpected-shape",
         "must be a text", "[can]"),
        (NODES, LINKS.replace("bus", "buss"), "unknown-key", "buss", "buss"),
        (NODES, LINKS.replace("{can: ", "{a: "), "unknown-key", "`a`", "a"),
        (NODES, LINKS.replace("{foreign", "{endpoints: {a: 'ipc://x', can: 'ipc://y'}, foreign"),
         "unknown-key", "`can`", "can"),
    ],
)  # fmt: skip
def test_a_wrong_foreign_node_is_refused_at_its_place(
    nodes: str, links: str, rule: str, message: str, place: str, write: Callable[..., Path]
) -> None:
    path = write(nodes, links)
    with pytest.raises(FsmkitError) as caught:
        load_deployment(path)
    found = [f for f in caught.value.diagnostics if f.rule.name == rule and message in f.message]
    assert found, list(caught.value.diagnostics)
    assert found[0].primary is not None
    span = found[0].primary.span
    assert path.read_text()[span.start : span.end] == place


def test_two_foreign_nodes_are_not_connected(write: Callable[..., Path]) -> None:
    oven = FILES["oven.yaml"].replace("connect:\n", "connect:\n  - fan.warm -> heater.seen\n")
    nodes = (
        "{a: [control], b: {machines: [heater], foreign: can}, c: {machines: [fan], foreign: can}}"
    )
    with pytest.raises(FsmkitError) as caught:
        load_deployment(write(nodes, "", oven=oven))
    (found,) = [f for f in caught.value.diagnostics if f.rule.name == "broken-deployment"]
    assert "`fan` is connected to `heater`, and both are on foreign nodes" in found.message


@pytest.mark.cc
def test_checking_a_deployment_with_a_foreign_node_is_checking_its_system(
    write: Callable[..., Path],
) -> None:
    path = write(NODES)
    counted = [
        fsmkit.check(load_deployment(path)).exploration.states,
        fsmkit.check(path.parent / "oven.yaml").exploration.states,
    ]
    assert counted[0] == counted[1] > 1
