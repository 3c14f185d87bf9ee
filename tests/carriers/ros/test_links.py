"""Frames between nodes of fsmkit by topics of ROS."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

import fsmkit
from fsmkit.diagnostics import FsmkitError
from fsmkit.plugins import plugin
from fsmkit.runtime.links import EventMap, Link, LinkKind, LinkRequest, LinkTimeout
from fsmkit.system.deployment.deployment import Deployment
from tests.carriers.ros.counting import between
from tests.carriers.ros.test_python_carrier import _loopback, domain  # noqa: F401  (fixtures)

pytestmark = [pytest.mark.external, pytest.mark.slow]

TALK = Path(__file__).parents[2] / "runtime/links/talk/deployment.yaml"
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
        LinkRequest(event_map, node, session, options={"domain": domain, "namespace": "/talk"})
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


@pytest.mark.parametrize(
    ("links", "rule", "message"),
    [
        ("{kind: ros, endpoints: {a: 'ipc://a', b: 'ipc://b'}}", "broken-deployment", "endpoints"),
        ("{kind: ros, curve: keys}", "broken-deployment", "have no `curve`"),
        ("{kind: ros, bus: can0}", "broken-deployment", "`ros` have no `bus`"),
        ("{domain: 7}", "broken-deployment", "`zeromq` have no `domain`"),
        ("{kind: ros, domain: 233}", "unexpected-value", "0 to 232"),
        ("{kind: ros, namespace: a__b}", "unexpected-value", "not a namespace"),
        ("{kind: ros, insecure: perhaps}", "unexpected-value", "`insecure`"),
    ],
)
def test_what_a_deployment_says_of_topics_is_checked(
    tmp_path: Path, links: str, rule: str, message: str
) -> None:
    path = between(tmp_path, 7)
    text = path.read_text(encoding="utf-8")
    path.write_text(text[: text.index("links:")] + f"links: {links}\n", encoding="utf-8")
    with pytest.raises(FsmkitError, match=message) as caught:
        fsmkit.read(path)
    assert rule in [found.rule.name for found in caught.value.diagnostics]


def test_one_node_needs_no_topics(tmp_path: Path) -> None:
    path = between(tmp_path, 7)
    text = path.read_text(encoding="utf-8").replace(
        "{a: [camera], b: [lens]}", "{a: [camera, lens]}"
    )
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FsmkitError, match="join two nodes"):
        fsmkit.read(path)


def test_a_domain_is_either_confined_or_not(event_map: EventMap, domain: int) -> None:  # noqa: F811
    insecure = replace(event_map, is_insecure=True)
    with opened(event_map, "a", domain), pytest.raises(FsmkitError, match="is open already"):
        opened(insecure, "b", domain).__enter__()
