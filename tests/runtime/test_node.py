"""A node of a deployment in Python: its cycle is that of the generated C."""

from __future__ import annotations

from pathlib import Path

import pytest

import fsmkit
from fsmkit.carriers.in_process import Wire
from fsmkit.diagnostics import FsmkitError
from fsmkit.runtime.node import Node
from fsmkit.runtime.system_session import SystemSession

FILES = {
    "button": """\
chart: Button
data: {presses: 0..9 wrap = 0}
inputs: {lit: bool}
events: {in: [press], out: [pressed(count 0..9)]}
initial: ready
states:
  ready:
    on:
      press: {if: lit or presses < 9, do: "presses += 1; send pressed(count = presses)"}
""",
    "counter": """\
chart: Counter
data: {seen: 0..99 = 0}
events: {in: [pressed(count 0..9)]}
initial: counting
states: {counting: {on: {pressed: {do: seen += 1}}}}
""",
    "lamp": """\
chart: Lamp
capacity: {queue: 2}
operations: [shine(on bool), ring()]
outputs: {lit: bool = true}
data: {changes: 0..99 = 0}
events: {in: [pressed(count 0..9)]}
initial: bright
states:
  dark: {entry: shine(false), on: {pressed: {target: bright, do: lit = true; changes += 1}}}
  bright:
    entry: shine(true)
    on: {pressed: {target: dark, do: lit = false; changes += 1}}
    after: {50ms: {do: ring()}}
""",
    "bell": """\
chart: Bell
data: {rings: 0..99 = 0}
events: {in: [rang]}
initial: hanging
states: {hanging: {on: {rang: {do: rings += 1}}}}
""",
    "hall": """\
system: Hall
machines: {button: button.yaml, counter: counter.yaml, lamp: lamp.yaml, bell: bell.yaml}
connect:
  - button.pressed -> lamp.pressed
  - button.pressed -> counter.pressed
  - lamp.lit -> button.lit
  - lamp.ring -> bell.rang
environment: {may: [button.press]}
""",
    "deployment": """\
system: hall.yaml
nodes: {wall: [button, counter, bell], ceiling: [lamp]}
links: {endpoints: {wall: "ipc://wall.ipc", ceiling: "ipc://ceiling.ipc"}}
""",
}


@pytest.fixture
def hall(tmp_path: Path) -> fsmkit.Deployment:
    for name, content in FILES.items():
        (tmp_path / f"{name}.yaml").write_text(content, encoding="utf-8")
    found = fsmkit.read(tmp_path / "deployment.yaml")
    assert isinstance(found, fsmkit.Deployment)
    return found


def opened(hall: fsmkit.Deployment, **operations: object) -> tuple[Node, Node, list[bool]]:
    wire, shone = Wire(), list[bool]()
    options = {"wire": wire}
    lamp = {"lamp": {"shine": shone.append, **operations}}
    wall = Node(hall, "wall", session=1, kind="in_process", options=options)
    ceiling = Node(hall, "ceiling", session=2, kind="in_process", options=options, operations=lamp)
    return wall, ceiling, shone


def test_nodes_do_what_the_system_does(hall: fsmkit.Deployment) -> None:
    wall, ceiling, shone = opened(hall)
    whole = SystemSession(hall.written)
    whole.start()
    for now in range(400):
        if now % 60 == 10:
            assert wall.machines.post("button", "press")
            whole.post("button", "press")
        wall.cycle(now)
        ceiling.cycle(now)
        whole.run(now)
    wall.cycle(400)
    for node, machine, value in (
        (wall, "button", "presses"),
        (wall, "counter", "seen"),
        (wall, "bell", "rings"),
        (ceiling, "lamp", "changes"),
    ):
        assert node.machines.value(machine, value) == whole.value(machine, value) > 0  # type: ignore[operator]
    assert shone == [True, *(index % 2 == 1 for index in range(7))]
    assert wall.link.counters("ceiling").lost_frames == 0


def test_inputs_from_other_nodes_begin_as_the_outputs_there(hall: fsmkit.Deployment) -> None:
    wall, _, _ = opened(hall)
    wall.cycle(0)  # nothing has come from the ceiling
    assert wall.machines.snapshot("button").inputs == (True,)


def test_events_wait_where_a_queue_is_full(hall: fsmkit.Deployment) -> None:
    wall, ceiling, _ = opened(hall)
    wall.cycle(0)
    ceiling.cycle(0)
    for _ in range(6):
        wall.machines.post("button", "press")
    wall.cycle(1)
    ceiling.cycle(1)
    assert ceiling.machines.value("lamp", "changes") == 6  # its queue holds 2
    assert ceiling.lost == 0


def test_operations_that_nothing_performs_are_found(hall: fsmkit.Deployment) -> None:
    with pytest.raises(FsmkitError, match="nothing performs the operation `shine`"):
        Node(hall, "ceiling", session=1, kind="in_process", options={"wire": Wire()})


def test_a_connected_operation_is_performed_as_well(hall: fsmkit.Deployment) -> None:
    rung: list[int] = []
    wall, ceiling, _ = opened(hall, ring=lambda: rung.append(1))
    for now in range(60):
        ceiling.cycle(now)
        wall.cycle(now)
    assert rung == [1]
    assert wall.machines.value("bell", "rings") == 1


def test_unknown_nodes_are_refused(hall: fsmkit.Deployment) -> None:
    with pytest.raises(ValueError, match="there is no node `roof`"):
        Node(hall, "roof", session=1)
    with pytest.raises(ValueError, match="`wall` has no machine `lamp`, only button"):
        Node(hall, "wall", session=1, operations={"lamp": {}})


def test_time_does_not_go_back(hall: fsmkit.Deployment) -> None:
    wall, _, _ = opened(hall)
    wall.cycle(5)
    with pytest.raises(ValueError, match="time does not go back: 4 after 5"):
        wall.cycle(4)


KINDS = {
    "zeromq": 'endpoints: {wall: "ipc://wall.ipc", ceiling: "ipc://ceiling.ipc"}',
    "can": "bus: no_such_bus",
    "ros": "domain: 7",
}


@pytest.mark.parametrize("of_deployment", KINDS)
@pytest.mark.parametrize("kind", ["can", "in_process", "zeromq", "pigeon"])
def test_another_kind_than_that_of_the_deployment_is_opened_or_a_finding(
    of_deployment: str, kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    links = f"links: {{kind: {of_deployment}, {KINDS[of_deployment]}}}\n"
    nodes = FILES["deployment"].partition("links:")[0]
    for name, content in (FILES | {"deployment": nodes + links}).items():
        (tmp_path / f"{name}.yaml").write_text(content, encoding="utf-8")
    deployment = fsmkit.read(tmp_path / "deployment.yaml")
    assert isinstance(deployment, fsmkit.Deployment)
    assert deployment.carrier == of_deployment
    for options in ({}, {"hue": 1}, {"slots": 8}, {"net": 1}, {"wire": 2}):
        try:
            Node(deployment, "wall", session=1, kind=kind, options=options).close()
        except FsmkitError as error:
            (found,) = error.diagnostics
            assert found.help
            rules = {"link-not-opened", "wrong-option", "missing-package", "unknown-plugin"}
            assert found.rule.name in rules
        else:
            assert kind == of_deployment == "zeromq"
            assert options.keys() <= {"slots"}
