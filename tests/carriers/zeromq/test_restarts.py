"""Restarts of both sides, some of them kills: an account of every event that was sent.

Each event is delivered once, or refused by the sender, or counted by the receiver: as lost, or as
missed, which is before the first frame that it heard. Only what a killed sender had not let out yet
is counted by nobody: its number died with it; the receiver counts the restart. ``make attacks`` has
fifty restarts of each side; the suite has some.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from fsmkit.runtime.links import Counters
from tests.runtime.links.conftest import HERE, PATIENCE, Build, Player

pytest.importorskip("zmq")
IS_WHOLE = bool(os.environ.get("FSMKIT_ATTACKS"))
RESTARTS = 50 if IS_WHOLE else 2
"""Of each side."""
Start = Callable[[int], Player]


@dataclass
class Segment:
    """What one run of the receiver knows of one session: events from a number on."""

    start: int
    delivered: int
    lost: int

    @property
    def end(self) -> int:
        return self.start + self.delivered + self.lost


@dataclass
class Session:
    """A run of the sender."""

    number: int
    sent: int = 0
    refused: int = 0
    was_killed: bool = False
    segments: list[Segment] = field(default_factory=list)

    @property
    def missed(self) -> int:
        """Check that no event came twice; return those between what runs of the receiver know."""
        end = missed = 0
        for segment in self.segments:
            assert segment.start >= end, "an event was delivered twice, or counted twice"
            missed += segment.start - end
            end = segment.end
        return missed

    @property
    def cut_off(self) -> int:
        """Return those after the last that the receiver knows."""
        found = self.sent - (self.segments[-1].end if self.segments else 0)
        assert found >= 0, "more came than was sent"
        assert self.was_killed or found == 0, f"{found} of an orderly session are not accounted for"
        return found


class Receiver:
    """A run of the receiving node, and how far its account is settled."""

    def __init__(self, player: Player) -> None:
        self.player = player
        self.counters = Counters()
        self.got = 0

    def cycle(self) -> None:
        self.player.tell("c")

    def look(self) -> tuple[Counters, int]:
        words = self.player.ask_all("p")
        last = words[-1].split()
        return self.player.counters(), int(last[last.index("got") + 1])

    def rest(self) -> None:
        """Go on until nothing has come for a while."""
        before = None
        since = time.monotonic()
        while time.monotonic() - since < 0.15:
            self.cycle()
            if (found := self.look()) != before:
                before, since = found, time.monotonic()
            time.sleep(0.002)

    def settle(self, session: Session) -> None:
        """Write into the account what is known of a session since the last time."""
        counters, got = self.look()
        if counters.session != session.number:
            return
        is_first = self.counters.session == 0
        is_same = self.counters.session == session.number
        first = counters.missed if is_first else 0
        start = session.segments[-1].end if is_same else first
        lost = counters.lost_events - self.counters.lost_events
        lost += counters.overflow - self.counters.overflow
        session.segments.append(Segment(start, (got - self.got) % 256, lost))
        self.counters, self.got = counters, got


class Play:
    """A sender and a receiver, either of which is started again and again."""

    def __init__(self, sender: Start, receiver: Start, each: int) -> None:
        self.start_sender, self.start_receiver, self.each = sender, receiver, each
        self.sessions = [Session(100)]
        self.runs = 1
        self.sender = sender(100)
        self.receiver = Receiver(receiver(1))
        self.meet()

    def meet(self) -> None:
        for player in (self.sender, self.receiver.player):
            assert player.ask(f"l {int(PATIENCE * 1000)}").startswith("ready")

    def send(self, times: int) -> None:
        for _ in range(times):
            self.sender.tell("s 1", "c")
            self.sessions[-1].sent += self.each
            self.receiver.cycle()
            time.sleep(0.001)

    def burst(self, times: int) -> None:
        """Send more in a cycle than there is room for."""
        self.sender.tell(*["s 1"] * times, "c")
        self.sessions[-1].sent += times

    def end(self, player: Player, *, kills: bool) -> None:
        if kills:
            player.kill()
            return
        assert int(player.ask("q")) < 1500
        assert player.close() == 0

    def restart_sender(self, *, kills: bool) -> None:
        session = self.sessions[-1]
        if not kills:
            time.sleep(0.05)
            session.refused = int(self.sender.ask_all("p")[-2].split()[2])
        else:
            self.sender.tell(*["s 1", "c"] * 10)  # it is killed in the midst of these
            session.sent += 10 * self.each
            time.sleep(0.002)
        session.was_killed = kills
        self.end(self.sender, kills=kills)
        self.receiver.rest()
        self.receiver.settle(session)
        self.sessions.append(Session(session.number + 1))
        self.sender = self.start_sender(session.number + 1)
        self.send(3)  # perhaps before anybody listens
        self.meet()

    def restart_receiver(self, *, kills: bool) -> None:
        self.receiver.settle(self.sessions[-1])
        self.end(self.receiver.player, kills=kills)
        for _ in range(5):
            self.sender.tell("s 1", "c")
            self.sessions[-1].sent += self.each
            time.sleep(0.001)
        self.runs += 1
        self.receiver = Receiver(self.start_receiver(self.runs))
        self.meet()


@pytest.fixture
def start(
    build: Build, endpoints: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[[str, str], Start]]:
    """Make nodes in C and in Python; what is left of them is ended after the test."""
    monkeypatch.setenv("ASAN_OPTIONS", "quarantine_size_mb=1")
    ends = (endpoints["a"], endpoints["b"])
    players: list[Player] = []

    def made(language: str, node: str) -> Start:
        def python(session: int) -> Player:
            module = ("-m", "tests.runtime.links.link_player", node)
            players.append(Player(Path(sys.executable), *module, session, *ends))
            return players[-1]

        def in_c(session: int) -> Player:
            program = build(node, HERE / "link_player.c", "-DWITH_ZMQ")
            players.append(Player(program, session, "threaded", *ends))
            return players[-1]

        return python if language == "python" else in_c

    yield made
    for player in players:
        if player.process.poll() is None:
            player.kill()


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize(
    ("sender", "receiver", "each"),
    [(("c", "b"), ("python", "a"), 3), (("python", "a"), ("c", "b"), 1)],
    ids=["C to Python", "Python to C"],
)
def test_every_event_is_accounted_for(
    sender: tuple[str, str],
    receiver: tuple[str, str],
    each: int,
    start: Callable[[str, str], Start],
) -> None:
    play = Play(start(*sender), start(*receiver), each)
    for n in range(RESTARTS):
        play.send(10)
        if each == 1 and n % 5 == 1:
            play.burst(100)
            play.receiver.rest()
        play.restart_receiver(kills=n % 2 == 1)
        play.send(10)
        play.restart_sender(kills=n % 4 >= 2)
    play.send(5)
    play.restart_sender(kills=False)
    sessions = play.sessions[:-1]
    delivered = sum(segment.delivered for session in sessions for segment in session.segments)
    lost = sum(segment.lost for session in sessions for segment in session.segments)
    missed = sum(session.missed for session in sessions)
    cut_off = sum(session.cut_off for session in sessions)
    sent = sum(session.sent for session in sessions)
    refused = sum(session.refused for session in sessions)
    account = (
        f"{RESTARTS} restarts of each side: {sent} sent = {delivered} delivered + {lost} lost "
        f"+ {missed} missed + {cut_off} cut off with killed senders; {refused} refused, among these"
    )
    (sys.__stdout__ if IS_WHOLE else sys.stdout).write(f"\n{account}\n")  # type: ignore[union-attr]
    assert sent == delivered + lost + missed + cut_off, account
    assert delivered > sent // 3, account
    assert refused > 0 or each > 1, account  # the burst
