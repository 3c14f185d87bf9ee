"""Frames by topics of ROS between a node in C and one in Python, each in a process of its own."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

import fsmkit
from fsmkit.carriers.ros.plugin import PLUGIN
from fsmkit.runtime.links import Link
from fsmkit.runtime.links.opening import open_link
from fsmkit.system.deployment.deployment import Deployment
from tests.carriers.ros.counting import between
from tests.carriers.ros.test_c_carrier import Builder, node, numbers
from tests.carriers.ros.test_python_carrier import _loopback, domain, said  # noqa: F401  (fixtures)

pytestmark = [pytest.mark.external, pytest.mark.slow, pytest.mark.cc]

JUDGED = "lens.judged -> camera.judged"
COUNT = 10_000


@pytest.fixture(scope="module")
def deployment(tmp_path_factory: pytest.TempPathFactory, domain: int) -> Deployment:  # noqa: F811
    found = fsmkit.read(between(tmp_path_factory.mktemp("links"), domain))
    assert isinstance(found, Deployment)
    return found


@pytest.fixture(scope="module")
def player(
    tmp_path_factory: pytest.TempPathFactory,
    domain: int,  # noqa: F811
    require_tool: Callable[[str], str],
) -> Path:
    folder = tmp_path_factory.mktemp("player")
    path = between(folder, domain)
    return Builder(folder, require_tool).build(path, "frames_player.c", own="a")


@contextmanager
def lens(deployment: Deployment, session: int) -> Iterator[Link]:
    """Open the link of the node in Python."""
    link = open_link(
        deployment.map,
        "b",
        session=session,
        kind=deployment.carrier,
        options=PLUGIN.link_options(deployment),
    )
    try:
        yield link
    finally:
        link.close()


def cycle(link: Link) -> list[object]:
    link.begin_cycle()
    found: list[object] = []
    while (message := link.receive()) is not None:
        found.append(message.values[0])
    link.end_cycle({})
    return found


def until(is_so: Callable[[], object], link: Link) -> list[object]:
    end = time.monotonic() + 30
    found: list[object] = []
    while not is_so():
        found += cycle(link)
        assert time.monotonic() < end, "nothing has come"
        time.sleep(0.001)
    return found


def test_ten_thousand_events_each_way_come_once_and_in_order(
    player: Path, deployment: Deployment
) -> None:
    with lens(deployment, 5) as link, node(player, COUNT, 1, 0) as camera:
        link.wait_listeners(20)
        found = until(lambda: link.counters("a").frames > 3, link)
        sent = 0
        end = time.monotonic() + 60
        while len(found) < COUNT or sent < COUNT:
            for _ in range(min(20, COUNT - sent) if sent < len(found) + 200 else 0):
                sent += link.send(deployment.map.message(JUDGED, number=sent % 60_000))
            found += cycle(link)
            assert time.monotonic() < end
            time.sleep(0.001)
        assert found == list(range(COUNT))
        assert camera.stdin is not None
        seen: dict[str, int] = {}
        while seen.get("come") != COUNT:
            camera.stdin.write("\n")
            seen = numbers(said(camera))
            cycle(link)
        assert {name: seen[name] for name in ("wrong", "lost", "doubled", "overflow")} == {
            "wrong": 0, "lost": 0, "doubled": 0, "overflow": 0,
        }  # fmt: skip
        assert (seen["malformed"], seen["foreign"], seen["unsent"]) == (0, 0, 0)
        counters = link.counters("a")
        assert (counters.lost_frames, counters.doubled, counters.overflow) == (0, 0, 0)


def test_a_killed_node_is_silent_and_its_next_run_a_restart(
    player: Path, deployment: Deployment
) -> None:
    with lens(deployment, 5) as link:
        with node(player, 0, 1, 0) as camera:
            until(lambda: link.counters("a").frames > 3, link)
            camera.kill()
        until(lambda: link.silence("a") >= 100, link)
        assert link.counters("a").restarts == 0
        with node(player, 0, 2, 0) as camera:
            begin = time.monotonic()
            until(lambda: link.counters("a").restarts == 1, link)
            assert time.monotonic() - begin < 20  # it compiles nothing, and the lease is 2 s
            assert link.silence("a") < 100


def test_a_node_in_c_counts_silence_and_restarts(player: Path, deployment: Deployment) -> None:
    with ExitStack() as first:
        link = first.enter_context(lens(deployment, 5))
        with node(player, 0, 1, 0) as camera:

            def seen() -> dict[str, int]:
                assert camera.stdin is not None
                camera.stdin.write("\n")
                return numbers(said(camera))

            until(lambda: link.counters("a").frames > 3, link)
            first.close()
            while seen()["silence"] < 100:
                pass
            with lens(deployment, 6) as link:
                until(lambda: seen()["restarts"] == 1, link)
                assert seen()["silence"] < 100


def test_the_domain_is_confined_unless_it_is_insecure(
    player: Path,
    deployment: Deployment,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What CYCLONEDDS_URI says has no effect: a node with a false interface is heard."""
    monkeypatch.setenv("CYCLONEDDS_URI", os.environ["CYCLONEDDS_URI"].replace('"lo"', '"none"'))
    with lens(deployment, 5) as link, node(player, 0, 1, 0):
        until(lambda: link.counters("a").frames > 3, link)
