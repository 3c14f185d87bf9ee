"""The links in C: the same bytes and the same counting as in Python, also of damaged frames."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import asdict

import pytest

from fsmkit.carriers.in_process import InProcessLink, Wire
from fsmkit.runtime.links import Counters, EventMap, Faults
from fsmkit.runtime.links.codec import Codec, Frame
from fsmkit.runtime.links.faults import WHOLE
from fsmkit.runtime.links.receiving import QUIET, Receiver
from fsmkit.system.deployment.deployment import Deployment
from tests.runtime.links.conftest import HERE, Build, Player

pytestmark = pytest.mark.cc

Play = Callable[..., Player]


def frames_of(link: InProcessLink) -> list[str]:
    found = []
    while (frame := link.next_frame()) is not None:
        found.append(frame.hex())
    return found


class Unwired(InProcessLink):
    """Keeps its frames, to be carried by hand."""

    def _wake(self) -> None:
        return


def test_what_python_sends_c_understands(deployment: Deployment, play: Play) -> None:
    event_map = deployment.map
    a, b = Unwired(event_map, "a", Wire(), session=5), play("b", 1)
    a.send(
        event_map.message(
            "west.call -> east.called", who=2, why=-5, level=-0.375, small=0.5, mood="wild"
        )
    )
    a.send(event_map.message("west.hit -> east.ball", n=4000, last=True))
    a.end_cycle({"west.speed -> east.speed": -300, "west.lit -> judge.lit": False})
    b.tell(*(f"f {frame}" for frame in frames_of(a)), "c")
    assert b.ask_all("p")[-1] == (
        "east got 1 n 4000 least -5 level -0x1.8p-2 sum 0x1p-1 speed -300 lit 0"
    )
    assert b.counters().frames == 3
    assert b.close() == 0


def test_what_c_sends_python_understands(deployment: Deployment, play: Play) -> None:
    event_map = deployment.map
    b, a = play("b", 9), Unwired(event_map, "a", Wire())
    b.tell("s 9", "c")
    for frame in b.ask_all("o"):
        a.receiver.arrive(1, bytes.fromhex(frame))
    a.begin_cycle()
    found = []
    while (message := a.receive()) is not None:
        found.append((message.name, message.values))
    assert found == [
        ("east.hit -> west.ball", (99999, False)),
        ("east.note -> west.noted", (-128, 2**64 - 1, -(2**63))),
        ("judge.told -> west.noted", (5, 6, 7)),
    ]
    assert a.level("judge.mood -> west.mood") == "cross"
    assert a.counters("b").session == 9
    assert b.close() == 0


def test_what_the_environment_hears_besides_goes_to_the_host(play: Play) -> None:
    a = play("a", 1)
    a.tell("s 8")
    assert a.ask("c") == "world hears hit 56 1"
    assert a.ask_all("p")[0] == "push 8"
    assert a.close() == 0


def random_bytes(event_map: EventMap, seed: int, count: int) -> list[bytes]:
    """Return frames of node a, in order or not, whole or damaged, and bytes that never were one."""
    chance = random.Random(seed)
    codec = Codec(event_map)
    found = []
    sequence = events = 0
    session = 3
    for _ in range(count):
        message = chance.choice((0, 1, 3))
        session += chance.random() < 0.02
        sequence = (sequence + chance.choice((1, 1, 1, 1, 0, 2, -1, 70))) % 2**32
        events = (events + chance.choice((0, 1, 1, 3))) % 2**32
        values = {
            0: (chance.randrange(-300, 70001), chance.random() < 0.5),
            1: (chance.randrange(4001), True),
            3: (chance.randrange(4), chance.randrange(-5, 201), 1.5, 0.25, chance.randrange(3)),
        }[message]
        content = codec.encode(Frame(0, session, sequence, events, message, values))
        match chance.randrange(6):
            case 0:
                place = chance.randrange(len(content))
                content = bytes([*content[:place], chance.randrange(256), *content[place + 1 :]])
            case 1:
                content = content[: chance.randrange(len(content))]
            case 2:
                content = content[: chance.randrange(8)] + chance.randbytes(chance.randrange(40))
            case 3:
                content = chance.randbytes(chance.randrange(200))
        found.append(content)
    return found


def modulo(counters: Counters) -> Counters:
    """Return counters as C has them: forged frames count far."""
    return Counters(**{name: value % 2**32 for name, value in asdict(counters).items()})


@pytest.mark.parametrize("seed", range(4))
def test_both_judge_all_bytes_alike(deployment: Deployment, play: Play, seed: int) -> None:
    """Under the address and undefined-behaviour sanitizers."""
    contents = random_bytes(deployment.map, seed, 3000)
    receiver = Receiver(Codec(deployment.map), 1, 256, None)
    player = play("b", 1)
    for place, content in enumerate(contents):
        receiver.arrive(0, content)
        player.tell(f"f {content.hex()}")
        if place % 100 == 0:  # time goes on: a session that is silent for long gives way
            receiver.cycle += QUIET
            while receiver.events.get() is not None:
                pass
            player.tell(*["c"] * QUIET)
    assert player.counters() == modulo(receiver.counters(0))
    totals = list(map(int, player.ask_all("p")[-2].split()[1:5]))
    assert totals[2:] == [receiver.malformed, receiver.foreign]
    assert min(receiver.malformed, receiver.foreign, receiver.counters(0).restarts) > 5
    player.tell("c")
    assert player.ask_all("p")[-1].startswith("east got ")
    assert player.close() == 0


@pytest.mark.parametrize("seed", [1, 2**63 + 5])
def test_faults_do_the_same_in_both(deployment: Deployment, play: Play, seed: int) -> None:
    faults = Faults(seed, loss=0.1, duplication=0.2, delay=0.1, delay_cycles=4)
    wire = Wire()
    a = InProcessLink(deployment.map, "a", wire)
    b = InProcessLink(deployment.map, "b", wire, faults=faults)
    carried = Unwired(deployment.map, "a", Wire())
    player = play("b", 1)
    chances = [round(chance * WHOLE) for chance in (0.1, 0.2, 0.1)]
    player.tell(f"x {seed} {' '.join(map(str, chances))} 4")
    for n in range(500):
        for link in (a, carried):
            link.send(deployment.map.message("west.hit -> east.ball", n=n, last=False))
            link.end_cycle({"west.speed -> east.speed": n, "west.lit -> judge.lit": True})
        player.tell(*(f"f {frame}" for frame in frames_of(carried)), "c")
        b.begin_cycle()
        while b.receive() is not None:
            pass
        if n % 50 == 0:
            assert player.counters() == b.counters("a")
    for _ in range(5):  # what is delayed comes
        player.tell("c")
        b.begin_cycle()
    assert player.counters() == b.counters("a")
    told = player.ask_all("p")
    assert told[-2].split()[-3:] == [str(faults.lost), str(faults.duplicated), str(faults.delayed)]
    assert min(faults.lost, faults.duplicated, faults.delayed) > 50
    assert f"got {(500 - b.counters('a').lost_events) % 256} " in told[-1]
    assert player.close() == 0


def test_a_cut_link_is_silent(deployment: Deployment, play: Play) -> None:
    a, b = Unwired(deployment.map, "a", Wire()), play("b", 1)
    b.tell("x 1 0 0 0 0")
    silences = []
    for n in range(6):
        b.tell(f"d {int(2 <= n < 5)}")
        a.end_cycle({"west.speed -> east.speed": 0, "west.lit -> judge.lit": True})
        b.tell(*(f"f {frame}" for frame in frames_of(a)), "c")
        silences.append(int(b.ask_all("p")[0].split()[-1]))
    assert silences == [0, 0, 1, 2, 3, 0]
    assert b.counters().frames == 6
    assert b.close() == 0


@pytest.mark.parametrize("sanitizers", ["thread", "address,undefined"])
def test_three_threads_share_a_link(build: Build, sanitizers: str) -> None:
    """A loop, a sender and a receiver: all in order, nothing lost uncounted, levels not torn."""
    player = Player(build("a", HERE / "link_stress.c", sanitizers=sanitizers))
    said = player.ask("go").split()
    assert player.close() == 0, said
    assert said[0] == "fine", said
    assert int(said[2]) > 0, "no levels were conflated: the threads did not meet"
