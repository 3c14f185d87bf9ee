"""Attacks on a link from the loopback: what a stranger can make it keep, and make it believe.

Short here; ``make attacks`` has them whole (200,000 subscriptions, 100 MB, a thousand connections)
and prints the memory of the victim before and after. Each attack is bounded and ends by itself. The
victim is a process in Python, or in C under the address and undefined-behaviour sanitizers, and for
the figures without them.
"""

from __future__ import annotations

import os
import random
import sys
import time
from collections.abc import Iterator
from dataclasses import astuple, dataclass
from pathlib import Path

import pytest

from fsmkit.carriers.zeromq.introductions import HELLO, MARK
from fsmkit.carriers.zeromq.link import LINGER
from fsmkit.runtime.links.codec import Codec, Frame
from fsmkit.runtime.links.receiving import QUIET, Receiver
from fsmkit.system.deployment.deployment import Deployment
from tests.carriers.zeromq.stranger import COMMAND, MORE, Stranger, frame, resident
from tests.runtime.links.conftest import HERE, PATIENCE, Build, Open, Player
from tests.runtime.links.link_player import Node
from tests.runtime.links.test_c import random_bytes

pytestmark = pytest.mark.cc

zmq = pytest.importorskip("zmq")
IS_WHOLE = bool(os.environ.get("FSMKIT_ATTACKS"))
VICTIMS = ("python", "c", "c plain") if IS_WHOLE else ("python", "c")
MOST = 24_000
"""Kilobytes that a victim may grow by in an attack."""
SLACK = 1000
"""Milliseconds beyond the linger: threads may get little of a busy computer."""


def whole(long: int, short: int) -> int:
    return long if IS_WHOLE else short


@dataclass
class Victim:
    """Node a, which is attacked; it is told to cycle by the test."""

    player: Player
    endpoints: dict[str, str]
    before: int = 0

    @property
    def at(self) -> str:
        return self.endpoints["a"]

    def memory(self, field: str = "VmRSS") -> int:
        return resident(self.player.process.pid, field)

    def cycle(self, seconds: float = 0.0) -> None:
        until = time.monotonic() + seconds
        while True:
            self.player.tell("c")
            time.sleep(0.005)
            if time.monotonic() >= until:
                return

    def dropped(self) -> int:
        return int(self.player.ask("k").split()[1])

    def listener(self) -> int:
        return int(self.player.ask("k").split()[0])


@pytest.fixture(params=VICTIMS)
def victim(
    request: pytest.FixtureRequest,
    endpoints: dict[str, str],
    build: Build,
    monkeypatch: pytest.MonkeyPatch,
) -> Iterator[Victim]:
    """Run node a; at the end it must close within its linger, and not have grown."""
    monkeypatch.setenv("ASAN_OPTIONS", "quarantine_size_mb=1:malloc_context_size=2")
    ends = (endpoints["a"], endpoints["b"])
    if request.param == "python":
        player = Player(
            Path(sys.executable), "-m", "tests.runtime.links.link_player", "a", 5, *ends
        )
    else:
        sanitizers = {"sanitizers": ""} if request.param == "c plain" else {}
        program = build("a", HERE / "link_player.c", "-DWITH_ZMQ", **sanitizers)
        player = Player(program, 5, "threaded", *ends)
    assert player.ask("k") == "0 0"
    made = Victim(player, endpoints)
    made.cycle(0.2)
    made.before = made.memory()
    yield made
    after, peak = made.memory(), made.memory("VmHWM")
    closed = int(player.ask("q"))
    assert player.close() == 0
    print(
        f"\n{request.node.name}: {made.before} kB before, {after} after, {peak} at most; "
        f"closed in {closed} ms",
        file=sys.__stdout__ if IS_WHOLE else sys.stdout,
    )
    assert peak - made.before < MOST
    assert closed < LINGER + SLACK


def still_talks(victim: Victim, connect: Open, deployment: Deployment) -> None:
    """Let the true node b come; both hear each other."""
    link = connect("b", session=9)
    node = Node(link, "b")
    until = time.monotonic() + PATIENCE
    while victim.listener() != 9 or link.counters("a").frames < 3:
        assert time.monotonic() < until, "the true peer is not known any more"
        node.cycle()
        victim.cycle()
    before = got(victim)
    while (got(victim) - before) % 256 < 5:  # where a machine is slow, some of them are lost
        assert time.monotonic() < until, "events of the true peer do not come any more"
        link.send(deployment.map.message("east.hit -> west.ball", n=1, last=False))
        node.cycle()
        victim.cycle()


def got(victim: Victim) -> int:
    return next(
        int(words[words.index("got") + 1])
        for words in map(str.split, victim.player.ask_all("p"))
        if "got" in words
    )


def hello(session: int, token: int, echo: int, node: int = 1) -> bytes:
    return HELLO.pack(MARK, node, session, token, echo)


@pytest.mark.parametrize("kind", ["SUB", "DEALER"])
def test_subscriptions_are_not_kept(
    victim: Victim,
    kind: str,
    connect: Open,
    deployment: Deployment,
) -> None:
    count = whole(200_000, 20_000)
    with Stranger(victim.at, kind) as stranger:
        content = b"".join(frame(b"\x01topic %08d" % n) for n in range(count))
        stranger.send(content)
        victim.cycle(1.0)
        assert stranger.is_cut(5.0)
    still_talks(victim, connect, deployment)


@pytest.mark.slow
@pytest.mark.parametrize("flags", [0, MORE])
def test_a_message_that_is_too_long_is_cut_off(
    victim: Victim,
    flags: int,
    connect: Open,
    deployment: Deployment,
) -> None:
    size = whole(100, 20) * 1_000_000
    for _ in range(3):
        with Stranger(victim.at) as stranger:
            assert not stranger.send(frame(bytes(size), flags))
            assert stranger.sent < size
    with Stranger(victim.at, greets=False) as stranger:
        stranger.send(b"\xff" + bytes(8) + b"\x7f\x03\x00" + b"NULL".ljust(52, b"\0"))
        assert not stranger.send(frame(bytes(size), 4))
    still_talks(victim, connect, deployment)


def test_a_message_without_end_is_cut_off(
    victim: Victim,
    connect: Open,
    deployment: Deployment,
) -> None:
    """ZeroMQ keeps parts until the last has come, beyond all its limits; the gate does not."""
    part = frame(b"x" * 200, MORE) * 100
    with Stranger(victim.at) as stranger:
        until = time.monotonic() + PATIENCE
        limit = whole(200, 50) * 1_000_000
        while stranger.sent < limit and stranger.send(part):
            assert time.monotonic() < until
            time.sleep(0.0002)  # some 100 MB a second
        assert stranger.sent < limit // 2
        assert stranger.is_cut(5.0)
    still_talks(victim, connect, deployment)


def test_pings_behind_messages_that_wait_end_nothing(
    victim: Victim, connect: Open, deployment: Deployment
) -> None:
    """With a limit on messages that wait, libzmq aborts: Assertion failed: !_io_error."""
    ping = frame(b"\x04PING\x00\x00", COMMAND)
    for _ in range(whole(100, 20)):
        with Stranger(victim.at) as stranger:
            stranger.send((frame(b"") * 20 + ping) * 20)
        time.sleep(0.02)
    with Stranger(victim.at) as stranger:
        stranger.send(frame(b"") * 20_000 + ping)
    victim.cycle(0.6)
    still_talks(victim, connect, deployment)


def test_connections_are_limited(
    victim: Victim,
    connect: Open,
    deployment: Deployment,
) -> None:
    count = whole(500, 100)
    strangers = [Stranger(victim.at, greets=n % 2 == 0) for n in range(count)]
    victim.cycle(0.3)
    handles = len(list(Path(f"/proc/{victim.player.process.pid}/fd").iterdir()))
    assert handles < 32 * 2 + 60, handles
    assert victim.dropped() >= count - 32
    still_talks(victim, connect, deployment)  # while strangers have the seats
    for stranger in strangers:
        stranger.close()


def test_a_flood_of_hellos_does_not_hold_a_link(victim: Victim) -> None:
    """It says too much, and is put out; until then no more than some are looked at each time."""
    count = whole(200_000, 20_000)
    chance = random.Random(1)
    content = b"".join(frame(hello(7, chance.randrange(1, 2**64), 0)) for _ in range(count))
    with Stranger(victim.at) as stranger:
        stranger.send(content)
        victim.cycle(0.5)
        assert stranger.is_cut(5.0)
    assert victim.listener() == 0


def test_an_impostor_does_not_listen(
    victim: Victim,
    connect: Open,
    deployment: Deployment,
) -> None:
    chance = random.Random(2)
    with Stranger(victim.at) as impostor:
        for _ in range(100):
            echo = chance.choice((0, 1, chance.randrange(2**64)))
            impostor.send(frame(hello(77, chance.randrange(1, 2**64), echo)))
            victim.cycle()
        assert victim.player.ask("l 300").startswith("timeout")
        assert victim.listener() == 0
        impostor.socket.settimeout(0.2)
        heard = b""
        try:
            while more := impostor.socket.recv(65536):
                heard += more
        except OSError:
            pass
        assert b"FK" not in heard  # no frame was sent to it
        still_talks(victim, connect, deployment)  # while it goes on
        for _ in range(20):
            impostor.send(frame(hello(78, 5, 6)))
            victim.cycle()
        assert victim.listener() == 9


class Squatter:
    """Somebody who has taken the endpoint of node b, and is listened to there."""

    def __init__(self, endpoint: str) -> None:
        self.context = zmq.Context()
        self.socket = self.context.socket(zmq.ROUTER)
        self.socket.setsockopt(zmq.LINGER, 200)
        self.socket.setsockopt(zmq.RCVTIMEO, int(PATIENCE * 1000))
        until = time.monotonic() + PATIENCE
        while True:
            try:
                self.socket.bind(endpoint)
                break
            except zmq.ZMQError:
                assert time.monotonic() < until
                time.sleep(0.05)
        self.route = self.socket.recv_multipart()[0]

    def send(self, *parts: bytes) -> None:
        self.socket.send_multipart([self.route, *parts])

    def close(self) -> None:
        self.context.destroy()


@pytest.mark.parametrize("passes", [False, True])
def test_a_forged_session_locks_nobody_out(
    victim: Victim,
    connect: Open,
    deployment: Deployment,
    passes: bool,
) -> None:
    """At once, or when the forgery counted because the peer was silent, soon."""
    node = Node(connect("b", session=1000), "b")
    until = time.monotonic() + PATIENCE
    while victim.player.counters().session != 1000:
        assert time.monotonic() < until
        node.cycle()
        victim.cycle()
    node.link.close()
    squatter = Squatter(victim.endpoints["b"])
    forgery = Codec(deployment.map).encode(Frame(1, forged := 1000 + 2**31 - 1, 0, 0, 0, (0,)))
    if passes:  # frames of the true peer that are still under way end its silence
        while victim.player.counters().session != forged:
            assert time.monotonic() < until
            victim.player.tell(*["c"] * (QUIET + 1))
            squatter.send(forgery)
            victim.cycle()
    else:
        squatter.send(forgery)
        while not (counters := victim.player.counters()).late:
            assert time.monotonic() < until
        assert counters.session == 1000
    squatter.close()
    time.sleep(0.1)
    again = Node(connect("b", session=1001), "b")
    cycles = 0
    while (counters := victim.player.counters()).session != 1001:
        assert time.monotonic() < until
        again.cycle()
        victim.cycle()
        cycles += counters.late > 0
    assert cycles < QUIET + 100
    again.link.send(deployment.map.message("east.hit -> west.ball", n=1, last=False))
    before = got(victim)
    while got(victim) == before:
        assert time.monotonic() < until
        again.cycle()
        victim.cycle()


def test_garbage_from_strangers_and_from_the_endpoint_of_a_peer(
    victim: Victim,
    connect: Open,
    deployment: Deployment,
) -> None:
    chance = random.Random(3)
    for _ in range(whole(300, 30)):
        with Stranger(victim.at, greets=chance.random() < 0.5) as stranger:
            stranger.send(chance.randbytes(chance.randrange(1, 3000)))
    squatter = Squatter(victim.endpoints["b"])
    count = whole(5_000, 500)
    for n in range(count):
        content = chance.randbytes(chance.randrange(200))
        squatter.send(*([content] if n % 3 else [content, b"FK", b""]))
        if n % 100 == 0:
            victim.cycle()
    until = time.monotonic() + PATIENCE
    parts = count + 2 * len(range(0, count, 3))
    while sum(map(int, victim.player.ask_all("p")[-2].split()[3:5])) < parts:
        assert time.monotonic() < until, "not all garbage was counted"
        time.sleep(0.05)
    squatter.close()
    still_talks(victim, connect, deployment)


def test_every_frame_is_judged_alike(deployment: Deployment, build: Build) -> None:
    """Frame by frame: C and Python count the same after each, whole, damaged or random."""
    contents = random_bytes(deployment.map, 99, whole(100_000, 5_000))
    receiver = Receiver(Codec(deployment.map), 1, 256, None)
    player = Player(build("b", HERE / "link_player.c"), 1)
    chunk = 100  # what it says to so many fits into any pipe
    for first in range(0, len(contents), chunk):
        here = contents[first : first + chunk]
        player.tell(*(f"v {content.hex()}" for content in here))
        for content in here:
            receiver.arrive(0, content)
            assert player.read() == counted(receiver), content.hex()
        if first % (20 * chunk) == 0:
            receiver.cycle += QUIET
            while receiver.events.get() is not None:
                pass
            player.tell(*["c"] * QUIET)
    assert receiver.counters(0).restarts > len(contents) // 1000
    assert player.close() == 0


def counted(receiver: Receiver) -> str:
    numbers = (*astuple(receiver.counters(0)), receiver.malformed, receiver.foreign)
    return " ".join(str(number % 2**32) for number in numbers)
