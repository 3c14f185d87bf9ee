"""Diagnostics of a node in Python: by Cyclone DDS, and by rclpy in an environment that has it."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest

import fsmkit
from fsmkit.carriers.ros.diagnostics import Diagnostics, Status
from fsmkit.runtime.node import Node
from fsmkit.system.deployment.deployment import Deployment
from tests.carriers.ros.cell import DEPLOYMENT, written
from tests.carriers.ros.test_python_carrier import _loopback, domain  # noqa: F401  (fixtures)
from tests.carriers.ros.test_rclpy import ROS_PYTHON
from tests.needs import where

pytestmark = [pytest.mark.external, pytest.mark.slow]

HALTING = """\
chart: Belt
outputs: {position: -100000..100000 = 0, pause: duration = 10ms}
events: {in: [go]}
initial: moving
states: {moving: {on: {go: {do: position = 100000 + 1 + position}}}}
"""


def statuses(found: tuple[Status, ...]) -> dict[str, tuple[int, str]]:
    return {each.name: (each.level, each.message) for each in found}


def test_statuses_show_counters_that_moved_and_faults(
    tmp_path: Path,
    domain: int,  # noqa: F811
) -> None:
    from cyclonedds.core import Policy, Qos
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    from fsmkit.carriers.ros.domain import Participant
    from tests.carriers.ros.dds_diagnostics import DiagnosticArray

    text = DEPLOYMENT.replace("domain: 7", f"domain: {domain}")
    deployment = fsmkit.read(written(tmp_path, deployment=text, belt=HALTING))
    assert isinstance(deployment, Deployment)
    seconds = 0.0
    with (
        Node(deployment, "b", session=1) as node,
        Diagnostics(node, domain=domain, clock=lambda: seconds) as diagnostics,
    ):
        node.cycle(0)
        assert statuses(diagnostics.statuses()) == {
            "Cell/b": (0, "no counter moved"),
            "Cell/b: vision": (0, "no counter moved"),
            "Cell/b: camera": (0, "runs"),
            "Cell/b: belt": (0, "runs"),
        }
        node.link.receiver.arrive(deployment.map.node("vision"), b"no frame")
        node.machines.post("belt", "go")
        node.cycle(1)
        found = statuses(diagnostics.statuses())
        assert found["Cell/b"] == (1, "moved: malformed")
        level, message = found["Cell/b: belt"]
        assert (level, message.startswith("stopped by the fault ")) == (2, True)
        assert statuses(diagnostics.statuses())["Cell/b"] == (0, "no counter moved")

        joined = Participant(domain, is_insecure=False)
        topic: Any = Topic(joined.participant, "rt/diagnostics", DiagnosticArray)
        qos = Qos(Policy.Reliability.Reliable(0), Policy.History.KeepLast(100))
        heard: Any = DataReader(joined.participant, topic, qos=qos)
        end = time.monotonic() + 30
        while not (arrays := heard.take(1)):
            diagnostics.update(overruns=4)
            seconds += 0.5
            assert time.monotonic() < end
            time.sleep(0.01)
        (array,) = arrays
        assert array.header.stamp.sec > 1_700_000_000
        own, peer, _, belt = array.status
        assert (own.name, own.hardware_id, int(belt.level)) == ("Cell/b", "Cell/b", 2)
        assert {each.key: each.value for each in own.values}["overruns"] == "4"
        assert [each.key for each in peer.values][-1] == "silence"
        del heard
        joined.leave()


def test_another_way_is_refused(tmp_path: Path, domain: int) -> None:  # noqa: F811
    text = DEPLOYMENT.replace("domain: 7", f"domain: {domain}")
    deployment = fsmkit.read(written(tmp_path, deployment=text))
    assert isinstance(deployment, Deployment)
    with Node(deployment, "b", session=1) as node, pytest.raises(ValueError, match="not `smoke`"):
        Diagnostics(node, way="smoke")


@where(ROS_PYTHON, "no rclpy here, a part of ROS: FSMKIT_ROS_PYTHON names a Python with it")
def test_rclpy_has_the_diagnostics_of_a_node(
    tmp_path: Path,
    domain: int,  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    path = written(tmp_path, deployment=DEPLOYMENT.replace("domain: 7", f"domain: {domain}"))
    script = Path(__file__).with_name("rclpy_diagnostics.py")
    root = Path(fsmkit.__file__).parents[1]
    done = subprocess.run(
        [ROS_PYTHON, str(script), str(path)],
        capture_output=True, text=True, check=False, timeout=60,
        env={**os.environ, "PYTHONPATH": str(root)},
    )  # fmt: skip
    assert done.stdout.splitlines() == [
        "b'\\x01' Cell/b moved: overruns",
        "b'\\x00' Cell/b: vision no counter moved",
        "b'\\x00' Cell/b: camera runs",
        "b'\\x00' Cell/b: belt runs",
    ], done.stderr
