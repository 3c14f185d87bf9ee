"""Frames between nodes of fsmkit by topics of ROS."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

import fsmkit
from fsmkit.plugins import plugin
from fsmkit.runtime.links import EventMap, Link, LinkKind, LinkTimeout
from fsmkit.system.deployment import Deployment
from tests.ros.test_python_carrier import _loopback, domain  # noqa: F401  (fixtures)

pytestmark = [pytest.mark.external, pytest.mark.slow]

TALK = Path(__file__).parents[1] / "runtime/links/talk/deployment.yaml"
HIT = "west.hit -> east.ball"
LEVELS: dict[str, dict[str, object]] = {
    "a": {"west.speed -> east.speed": 5, "west.lit -> judge.lit": True},
    "b": {},
}


@pytest.fixture(scope="module")
def event_map() -> EventMap:
    found = fsmkit.read(TALK)
    assert isinstance(found, Deployment)
    LEVELS["b"] = {
        level.name: next(iter(getattr(level.type, "members", ())), 0)
        for level in found.map.levels_of(found.map.node("b"))
    }
    return found.map


@contextmanager
def opened(event_map: EventMap, node: str, domain: int, session: int = 1) -> Iterator[Link]:  # noqa: F811
    link = plugin(LinkKind, "ros").open(
        event_map, node, session=session, options={"domain": domain, "namespace": "/talk"}
    )
    try:
        yield link
    finally:
        link.close()


def cycle(link: Link, node: str) -> list[object]:
    link.begin_cycle()
    found: list[object] = []
    while (message := link.receive()) is not None:
        found.append(message.values[0])
    link.end_cycle(LEVELS[node])
    return found


def until(is_so: Callable[[], object], *links: tuple[Link, str]) -> None:
    end = time.monotonic() + 30
    while not is_so():
        for link, node in links:
            cycle(link, node)
        assert time.monotonic() < end, "nothing has come"
        time.sleep(0.001)


def test_ten_thousand_events_come_once_and_in_order(event_map: EventMap, domain: int) -> None:  # noqa: F811
    count = 10_000
    with opened(event_map, "a", domain) as a, opened(event_map, "b", domain) as b:
        for link in (a, b):
            link.wait_listeners(30.0)
        until(lambda: b.counters("a").frames and a.counters("b").frames, (a, "a"), (b, "b"))
        found: list[object] = []
        sent = cycles = 0
        while len(found) < count:
            for _ in range(min(100, count - sent) if sent - len(found) < 100 else 0):
                sent += a.send(event_map.message(HIT, n=sent % 4001, last=False))
            cycle(a, "a")
            found += cycle(b, "b")
            cycles += 1
            assert cycles < 200_000
        assert found == [n % 4001 for n in range(count)]
        counters = b.counters("a")
        assert (counters.lost_frames, counters.lost_events, counters.doubled) == (0, 0, 0)
        assert (counters.overflow, counters.restarts, b.malformed, b.foreign) == (0, 0, 0, 0)
        assert b.level("west.speed -> east.speed") == 5


def test_a_node_that_ends_is_silent_and_the_next_is_a_restart(
    event_map: EventMap,
    domain: int,  # noqa: F811
) -> None:
    with opened(event_map, "b", domain) as b:
        with opened(event_map, "a", domain) as a:
            until(lambda: b.counters("a").frames > 5, (a, "a"), (b, "b"))
        with pytest.raises(LinkTimeout, match="for `a` to listen"):
            until_gone(b)
        for _ in range(50):
            cycle(b, "b")
        assert b.silence("a") >= 50
        with opened(event_map, "a", domain, session=2) as a:
            until(lambda: b.silence("a") <= 1, (a, "a"), (b, "b"))
            assert b.counters("a").restarts == 1


def until_gone(link: Link) -> None:
    """Wait with no time until the other node is missed."""
    while True:
        link.wait_listeners(0.0)
