"""Answered events as services of ROS, and the life of a node."""

from __future__ import annotations

import os
import subprocess
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

import fsmkit
from fsmkit.carriers.ros.network import ros_nodes
from fsmkit.cli import execute
from fsmkit.diagnostics import FsmkitError
from fsmkit.runtime.node import Node
from tests.carriers.ros.test_python_carrier import _loopback, domain  # noqa: F401  (fixtures)
from tests.carriers.ros.test_rclpy import ROS_PYTHON
from tests.needs import where
from tests.reading import load_deployment

SYSTEM = """\
system: Cell
machines: {camera: camera.yaml, operator: operator.yaml}
connect:
  - operator.focus -> camera.focus
  - operator.count -> camera.count
  - operator.go -> camera.go
  - operator.halt -> camera.halt
environment: {will: [operator]}
"""
CAMERA = """\
chart: Camera
data: {n: 0..255 = 0}
events: {in: ["focus(near bool) -> bool", count -> 0..255, go, halt]}
initial: off
states:
  off: {on: {go: on}}
  on:
    on:
      focus: {do: n = n + 1; reply event.near}
      count: {do: reply n}
      halt: off
"""
OPERATOR = """\
chart: Operator
events: {out: [focus(near bool), count, go, halt]}
initial: a
states: {a: {after: {1s: {do: send focus(near = true); send count; send go; send halt}}}}
"""
DEPLOYMENT = """\
system: cell.yaml
nodes:
  b: [camera]
  people: {machines: [operator], foreign: ros}
links:
  foreign:
    people:
      domain: 7
      namespace: /cell
      way: rclpy
      bind:
        operator.focus -> camera.focus: {type: std_srvs/srv/SetBool}
        operator.count -> camera.count: {type: std_srvs/srv/Trigger}
      lifecycle:
        activate: operator.go -> camera.go
        deactivate: operator.halt -> camera.halt
"""


SET_BOOL = "{type: std_srvs/srv/SetBool}"
TRIGGER = "{type: std_srvs/srv/Trigger}"
GO = "operator.go -> camera.go"


def written(folder: Path, deployment: str = DEPLOYMENT) -> Path:
    files = {"cell": SYSTEM, "camera": CAMERA, "operator": OPERATOR, "deployment": deployment}
    for name, text in files.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    return folder / "deployment.yaml"


def test_services_have_names_and_types(tmp_path: Path) -> None:
    text = DEPLOYMENT.replace(
        "        operator.focus -> camera.focus: {type: std_srvs/srv/SetBool}\n", ""
    )
    (ros,) = ros_nodes(load_deployment(written(tmp_path, text))).values()
    focus, count = ros.services
    assert (focus.name, focus.package, focus.type) == (
        "/cell/camera/focus", "fsmkit_cell", "CameraFocus",
    )  # fmt: skip
    assert [str(each.name) for each in focus.request] == ["near"]
    assert (count.name, count.package, count.type) == ("/cell/camera/count", "std_srvs", "Trigger")
    assert ros.lifecycle == {"activate": 3, "deactivate": 4}
    assert ros.wires == ()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("      way: rclpy\n", "", "answered events need `way: rclpy`"),
        ("      way: rclpy\n", "", "the life of a node needs `way: rclpy`"),
        ("way: rclpy", "way: smoke", "way `smoke` is unknown"),
        (f"focus: {SET_BOOL}", f"focus: {TRIGGER}", "is no service with"),
        (f"activate: {GO}", f"activate: {GO}e", "is no connection"),
        (f"activate: {GO}", "activate: operator.focus -> camera.focus", "carries values"),
        (TRIGGER, "{topic: focus_2, type: std_msgs/msg/Empty}", "is no service with"),
        (f"count: {TRIGGER}", "count: {topic: camera/focus}", "two events would be"),
        ("activate", "wake", "wake"),
    ],
)
def test_what_does_not_fit_is_reported(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in DEPLOYMENT
    with pytest.raises(FsmkitError, match=message):
        load_deployment(written(tmp_path, DEPLOYMENT.replace(old, new, 1)))


def test_services_of_their_own_are_written(tmp_path: Path) -> None:
    text = DEPLOYMENT.replace(f"        operator.count -> camera.count: {TRIGGER}\n", "")
    out = tmp_path / "x"
    command = ["compile", str(written(tmp_path, text)), "-t", "python", "--out", str(out)]
    assert execute([*command, "--quiet"]) == 0
    (found,) = (out / "srv").iterdir()
    assert found.name == "CameraCount.srv"
    lines = found.read_text(encoding="utf-8").splitlines()
    assert lines[1:] == ["---", "bool handled", "uint8 value"]


@pytest.mark.parametrize("more", [[], ["--package", "ros2"]])
def test_c_offers_no_service(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], more: list[str]
) -> None:
    path = written(tmp_path)
    assert execute(["compile", str(path), "--out", str(tmp_path / "x"), *more]) != 0
    assert "which a node in C does not offer" in capsys.readouterr().err


@pytest.mark.external
@where(find_spec("rclpy") is None, "rclpy is installed")
def test_without_rclpy_it_says_what_to_install(tmp_path: Path, domain: int) -> None:  # noqa: F811
    deployment = load_deployment(
        written(tmp_path, DEPLOYMENT.replace("domain: 7", f"domain: {domain}"))
    )
    with pytest.raises(FsmkitError) as caught:
        Node(deployment, "b", session=1)
    assert [found.rule.name for found in caught.value.diagnostics] == ["missing-package"]


def test_a_machine_answers_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The part of a node, with a translator in place of ROS."""

    class Beside:
        node = 1
        answer: Any = None

        def take(self, frame: object) -> None: ...

        def poll(self) -> None: ...

        def close(self) -> None: ...

    beside = Beside()
    monkeypatch.setattr(
        "fsmkit.carriers.ros.plugin.PLUGIN.translator", lambda *_: beside, raising=False
    )
    deployment = load_deployment(written(tmp_path))
    with Node(deployment, "b", session=1) as node:
        node.cycle(0)
        assert beside.answer(1, (True,)) == (False, None)
        node.machines.post("camera", "go")
        node.cycle(1)
        assert beside.answer(1, (True,)) == (True, 1)
        assert beside.answer(1, (False,)) == (True, 0)
        assert beside.answer(2, ()) == (True, 2)
        assert [each.machine for each in node.cycle(2)] == ["camera"] * 3


@pytest.mark.external
@pytest.mark.slow
@where(ROS_PYTHON, "no rclpy here, a part of ROS: FSMKIT_ROS_PYTHON names a Python with it")
def test_rclpy_calls_services_and_leads_the_life_of_a_node(
    tmp_path: Path,
    domain: int,  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    path = written(tmp_path, DEPLOYMENT.replace("domain: 7", f"domain: {domain}"))
    script = Path(__file__).with_name("rclpy_services.py")
    root = Path(fsmkit.__file__).parents[1]
    done = subprocess.run(
        [ROS_PYTHON, str(script), str(path)],
        capture_output=True, text=True, check=False, timeout=100,
        env={**os.environ, "PYTHONPATH": str(root)},
    )  # fmt: skip
    assert done.stdout.splitlines() == [
        "False  off",  # nobody has activated it
        "True off",  # configured
        "True on",
        "True True on",
        "True 1 on",
        "True off",
    ], done.stderr
