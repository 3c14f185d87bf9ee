"""Nodes in C and Python and a program of rclpy: ten thousand events each way."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from importlib.util import find_spec
from pathlib import Path

import pytest

import fsmkit
from benchmarks.ros.others import others
from fsmkit.carriers.ros.plugin import PLUGIN
from fsmkit.runtime.links.opening import open_link
from fsmkit.system.deployment.deployment import Deployment
from tests.carriers.ros.counting import counting
from tests.carriers.ros.test_c_carrier import Builder, node
from tests.carriers.ros.test_python_carrier import (  # noqa: F401  (two are fixtures)
    LOOPBACK,
    _loopback,
    domain,
    go,
    said,
    translator,
    until,
)
from tests.needs import where

HAS_RCLPY = all(find_spec(name) is not None for name in ("rclpy", "std_msgs"))
ROS_PYTHON = os.environ.get("FSMKIT_ROS_PYTHON", sys.executable if HAS_RCLPY else "")
"""The interpreter of an environment with rclpy: it and `fsmkit` may have one each."""
pytestmark = [
    pytest.mark.external,
    pytest.mark.slow,
    where(ROS_PYTHON, "no rclpy here, a part of ROS: FSMKIT_ROS_PYTHON names a Python with it"),
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
    command = [ROS_PYTHON, str(Path(__file__).with_name("rclpy_peer.py")), str(COUNT)]
    with subprocess.Popen(
        [*command, str(depth)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    ) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.parametrize("is_busy", [False, True], ids=["alone", "with 32 other topics"])
def test_a_node_in_python_exchanges_bursts_with_rclpy(
    tmp_path: Path,
    domain: int,  # noqa: F811
    *,
    is_busy: bool,
) -> None:
    deployment = fsmkit.read(counting(tmp_path, domain, "camera"))
    assert isinstance(deployment, Deployment)
    link = open_link(
        deployment.map, "b", session=1, foreign=PLUGIN.foreign_options(deployment, "b")
    )
    try:
        with others(domain) if is_busy else nullcontext(), program(COUNT) as lens:
            topics = translator(link)
            until(lambda: not topics.unheard and not topics.unserved, link, levels={})
            assert said(lens) == "ready"
            go(lens)
            found: list[object] = []
            sent = 0
            end = time.monotonic() + 60
            waits = topics._sent["/look"].waiting
            while len(found) < COUNT or topics.counters.sent < COUNT:
                link.begin_cycle()
                while (message := link.receive()) is not None:
                    found.append(message.payload["number"])
                for _ in range(min(50, COUNT - sent) if not waits else 0):
                    sent += link.send(deployment.map.message(LOOK, number=sent))
                link.end_cycle({})
                assert time.monotonic() < end, f"{len(found)} of {COUNT} have come"
            assert said(lens) == f"{COUNT} True"
            assert found == list(range(COUNT))
    finally:
        link.close()


@pytest.mark.cc
@pytest.mark.parametrize("is_busy", [False, True], ids=["alone", "with 32 other topics"])
def test_a_node_in_c_exchanges_bursts_with_rclpy(
    tmp_path: Path,
    domain: int,  # noqa: F811
    require_tool: Callable[[str], str],
    monkeypatch: pytest.MonkeyPatch,
    *,
    is_busy: bool,
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", ANY_INTERFACE)
    deployment = counting(tmp_path, domain, "camera", is_insecure=True)
    player = Builder(tmp_path, require_tool).build(deployment, "burst_player.c")
    beside = others(domain, is_insecure=True) if is_busy else nullcontext()
    with beside, program(COUNT) as lens, node(player, COUNT) as camera:
        assert said(lens) == "ready"
        go(lens)
        go(camera)
        assert said(lens) == f"{COUNT} True"
        assert said(camera) == f"{COUNT} 0"
