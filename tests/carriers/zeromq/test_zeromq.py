"""Links over ZeroMQ on loopback: Python and C, threads and deterministic, restarts, keys."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.diagnostics import FsmkitError
from fsmkit.runtime.links import EventMap, Faults, Link, LinkTimeout
from fsmkit.system.deployment.deployment import Deployment
from tests.runtime.links.conftest import PATIENCE, Open, Player

zmq = pytest.importorskip("zmq")
pytest.importorskip("zmq.auth")
Play = Callable[..., Player]
LEVELS: dict[str, dict[str, object]] = {
    "a": {"west.speed -> east.speed": -300, "west.lit -> judge.lit": False},
    "b": {"judge.mood -> west.mood": "cross"},
}


def cycles_until(link: Link, is_done: Callable[[], bool], levels: dict[str, object]) -> None:
    until = time.monotonic() + PATIENCE
    while not is_done():
        assert time.monotonic() < until, "it did not come"
        link.begin_cycle()
        link.end_cycle(levels)
        time.sleep(0.001)


def hit(link: Link, n: int) -> bool:
    return link.send(link.map.message("west.hit -> east.ball", n=n, last=False))


def received(link: Link) -> list[int]:
    found = []
    while (message := link.receive()) is not None:
        assert isinstance(message.values[0], int)
        found.append(message.values[0])
    return found


def test_threads_carry_all_in_order(connect: Open) -> None:
    a, b = connect("a"), connect("b")
    a.wait_listeners(PATIENCE)
    b.wait_listeners(PATIENCE)
    got: list[int] = []
    until = time.monotonic() + PATIENCE
    number = 0
    while len(got) < 500 and time.monotonic() < until:
        a.begin_cycle()
        number += number < 500 and hit(a, number)
        a.end_cycle(LEVELS["a"])
        b.begin_cycle()
        got += received(b)
        time.sleep(0.0005)
    assert got == list(range(500))
    assert b.counters("a").lost_frames == 0
    assert b.level("west.speed -> east.speed") == -300
    assert b.silence("a") < 500


def test_a_deterministic_step_sees_what_was_sent_and_no_more(connect: Open) -> None:
    a, b = (connect(node, is_deterministic=True) for node in "ab")
    a.wait_listeners(PATIENCE)
    b.wait_listeners(PATIENCE)
    got: list[list[int]] = []
    told = 0
    for n in range(30):
        b.wait_frames("a", told, session=1, timeout=PATIENCE)
        told = a.sent
        a.begin_cycle()
        hit(a, n)
        a.end_cycle(LEVELS["a"])  # b must not see this before its next step
        b.begin_cycle()
        got.append(received(b))
        b.end_cycle(LEVELS["b"])
    assert got == [[], [], *([n] for n in range(28))]
    with pytest.raises(LinkTimeout, match="there are 60 of session 1"):
        b.wait_frames("a", 1000, session=1, timeout=0.2)


def test_faults_count_as_received_in_deterministic_steps(connect: Open) -> None:
    faults = Faults(seed=2, loss=0.3)
    a, b = connect("a", is_deterministic=True), connect("b", faults=faults, is_deterministic=True)
    a.wait_listeners(PATIENCE)
    got: list[int] = []
    for n in range(100):
        hit(a, n)
        a.end_cycle(LEVELS["a"])
        b.wait_frames("a", a.sent, session=1, timeout=PATIENCE)
        b.begin_cycle()
        got += received(b)
    faults.loss = 0.0
    a.end_cycle(LEVELS["a"])
    b.wait_frames("a", a.sent, session=1, timeout=PATIENCE)
    counters = b.counters("a")
    assert len(got) + counters.lost_events + counters.missed == 100
    assert faults.lost > 30


def test_without_listeners_it_is_said(connect: Open) -> None:
    with pytest.raises(LinkTimeout, match="for `b` to listen"):
        connect("a").wait_listeners(0.05)


def test_an_endpoint_that_is_taken_is_a_finding(connect: Open, endpoints: dict[str, str]) -> None:
    connect("a")
    with pytest.raises(FsmkitError, match="link of `b` cannot be opened: Address already in use"):
        connect("b", endpoints={**endpoints, "b": endpoints["a"]})
    with pytest.raises(FsmkitError, match="`b` has no endpoint"):
        connect("a", endpoints={"a": "inproc://a"})


@pytest.mark.cc
def test_c_and_python_talk_both_ways(connect: Open, play: Play, endpoints: dict[str, str]) -> None:
    b = play("b", 77, "threaded", endpoints["a"], endpoints["b"])
    a = connect("a")
    a.wait_listeners(PATIENCE)
    assert b.ask("l").startswith("ready")
    hit(a, 4000)
    a.end_cycle(LEVELS["a"])
    until = time.monotonic() + PATIENCE
    while "n 4000" not in (told := turn(b)) and time.monotonic() < until:
        time.sleep(0.001)
    assert told == "east got 1 n 4000 least 0 level 0x0p+0 sum 0x0p+0 speed -300 lit 0"
    b.tell("s 3", "c")
    cycles_until(a, lambda: a.counters("b").frames > 3, LEVELS["a"])
    a.begin_cycle()
    assert a.counters("b").session == 77
    assert b.close() == 0


def turn(player: Player) -> str:
    """Let a node do a cycle and return how its machines are."""
    player.tell("c")
    return player.ask_all("p")[-1]


@pytest.mark.cc
def test_deterministic_steps_of_c_and_python(
    connect: Open, play: Play, endpoints: dict[str, str]
) -> None:
    b = play("b", 5, "deterministic", endpoints["a"], endpoints["b"])
    a = connect("a", session=6, is_deterministic=True)
    assert b.ask("l").startswith("ready")
    a.wait_listeners(PATIENCE)
    got = []
    for n in range(20):
        hit(a, n)
        a.end_cycle(LEVELS["a"])
        assert b.ask(f"w 0 6 {a.sent}").startswith("ready")
        b.tell("s 1", "c")
        words = b.ask_all("p")
        assert f" n {n} " in words[-1]
        a.wait_frames("b", int(words[-2].split()[1]), session=5, timeout=PATIENCE)
        a.begin_cycle()
        while (message := a.receive()) is not None:
            got.append(message.name)
    assert (
        got
        == [
            "east.hit -> west.ball",
            "east.note -> west.noted",
            "judge.told -> west.noted",
        ]
        * 20
    )
    assert b.ask("w 0 6 1000") == (
        "timeout: node `b` waited for `a`: 1000 frames of session 6, there are 40 of session 6"
    )
    assert b.ask("w 0 6 3").startswith("beyond")
    assert b.close() == 0


@pytest.mark.cc
def test_a_killed_node_that_comes_back_is_heard_again(
    connect: Open, play: Play, endpoints: dict[str, str]
) -> None:
    first = play("b", 100, "deterministic", endpoints["a"], endpoints["b"])
    a = connect("a", is_deterministic=True)
    a.wait_listeners(PATIENCE)
    assert first.ask("l").startswith("ready")
    first.tell(*["c"] * 10)
    a.wait_frames("b", 10, session=100, timeout=PATIENCE)
    first.kill()
    second = play("b", 101, "deterministic", endpoints["a"], endpoints["b"])
    assert second.ask("l").startswith("ready")
    second.tell("s 4", "c")
    a.wait_frames("b", 4, session=101, timeout=PATIENCE)
    a.begin_cycle()
    assert a.receive() is not None
    counters = a.counters("b")
    assert (counters.restarts, counters.lost_events, counters.lost_frames) == (1, 0, 0)
    assert second.close() == 0


def make_keys(folder: Path, *names: str) -> Path:
    folder.mkdir(exist_ok=True)
    for name in names:
        zmq.auth.create_certificates(folder, name)
    return folder


@pytest.mark.cc
def test_nodes_with_keys_hear_each_other_and_nobody_else(
    connect: Open,
    play: Play,
    endpoints: dict[str, str],
    tmp_path: Path,
    deployment: Deployment,
) -> None:
    keys = make_keys(tmp_path / "keys", "a", "b")
    public = [zmq.auth.load_certificate(keys / f"{name}.key")[0].decode() for name in "ab"]
    b = play(
        "b", 1, "deterministic", endpoints["a"], endpoints["b"], *public, keys / "b.key_secret"
    )
    a = connect("a", is_deterministic=True, keys=keys)
    a.wait_listeners(PATIENCE)
    assert b.ask("l").startswith("ready")
    b.tell("c")
    a.wait_frames("b", 1, session=1, timeout=PATIENCE)
    hit(a, 12)
    a.end_cycle(LEVELS["a"])
    assert b.ask(f"w 0 1 {a.sent}").startswith("ready")
    a.close()
    stranger = connect("a", is_deterministic=True, keys=forged(keys, tmp_path / "forged"))
    with pytest.raises(LinkTimeout):
        stranger.wait_listeners(0.3)  # b does not take its word
    b.tell(*["c"] * 5)
    with pytest.raises(LinkTimeout):
        stranger.wait_frames("b", 1, timeout=0.3)  # nor does it speak to it
    assert isinstance(deployment.map, EventMap)
    assert b.close() == 0


def forged(keys: Path, folder: Path) -> Path:
    """Return keys in which node a has another pair."""
    make_keys(folder, "a")
    (folder / "b.key").write_text((keys / "b.key").read_text())
    return folder


def test_missing_keys_are_a_finding(connect: Open, tmp_path: Path) -> None:
    with pytest.raises(FsmkitError, match="cannot be opened"):
        connect("a", keys=tmp_path)
