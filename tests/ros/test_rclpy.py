"""Nodes in C and Python and a program of rclpy: ten thousand events each way."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest

import fsmkit
from fsmkit.runtime.fan import open_link
from fsmkit.runtime.ros.plugin import PLUGIN
from fsmkit.system.deployment import Deployment
from tests.needs import where
from tests.ros.counting import counting
from tests.ros.test_c_carrier import Builder, node
from tests.ros.test_python_carrier import (  # noqa: F401  (two are fixtures)
    LOOPBACK,
    _loopback,
    domain,
    go,
    said,
    translator,
    until,
)

HAS_RCLPY = all(find_spec(name) is not None for name in ("rclpy", "std_msgs"))
pytestmark = [
    pytest.mark.external,
    pytest.mark.slow,
    where(HAS_RCLPY, "rclpy is not installed: a part of ROS, which the tests do without"),
]

COUNT = 10_000
ANY_INTERFACE = LOOPBACK.replace('name="lo" multicast="false"', 'autodetermine="true"')
"""Fast DDS announces addresses that Cyclone DDS 0.10 does not use on ``lo`` alone."""
LOOK = "camera.look -> lens.look"


@pytest.fixture(autouse=True)
def _ros(
    _loopback: None,  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
    domain: int,  # noqa: F811
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")


@contextmanager
def program(depth: int) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, str(Path(__file__).with_name("rclpy_peer.py")), str(COUNT)]
    with subprocess.Popen(
        [*command, str(depth)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def test_a_node_in_python_exchanges_bursts_with_rclpy(
    tmp_path: Path,
    domain: int,  # noqa: F811
) -> None:
    deployment = fsmkit.read(counting(tmp_path, domain, "camera"))
    assert isinstance(deployment, Deployment)
    link = open_link(
        deployment.map, "b", session=1, foreign=PLUGIN.foreign_options(deployment, "b")
    )
    try:
        with program(COUNT) as lens:
            topics = translator(link)
            until(lambda: not topics.unheard and not topics.unserved, link, levels={})
            assert said(lens) == "ready"
            go(lens)
            found: list[object] = []
            sent, cycles = 0, 0
            waits = topics._sent["/look"].waiting
            while len(found) < COUNT or topics.counters.sent < COUNT:
                link.begin_cycle()
                while (message := link.receive()) is not None:
                    found.append(message.payload["number"])
                for _ in range(min(50, COUNT - sent) if not waits else 0):
                    sent += link.send(deployment.map.message(LOOK, number=sent))
                link.end_cycle({})
                cycles += 1
                assert cycles < 200_000
            assert said(lens) == f"{COUNT} True"
            assert found == list(range(COUNT))
    finally:
        link.close()


@pytest.mark.cc
def test_a_node_in_c_exchanges_bursts_with_rclpy(
    tmp_path: Path,
    domain: int,  # noqa: F811
    require_tool: Callable[[str], str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", ANY_INTERFACE)
    deployment = counting(tmp_path, domain, "camera")
    player = Builder(tmp_path, require_tool).build(deployment, "burst_player.c")
    with program(COUNT) as lens, node(player, COUNT) as camera:
        assert said(lens) == "ready"
        go(lens)
        go(camera)
        assert said(lens) == f"{COUNT} True"
        assert said(camera) == f"{COUNT} 0"
