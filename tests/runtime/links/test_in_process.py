"""Order, loss, levels, restarts: links within one program, and the counting of every kind."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fsmkit.carriers.in_process import InProcessLink, Wire
from fsmkit.plugins import plugin
from fsmkit.runtime.links import EventMap, Faults, Link, LinkKind, LinkRequest, LinkTimeout, Message
from fsmkit.runtime.links.codec import Codec, Frame
from fsmkit.runtime.links.receiving import Receiver
from fsmkit.system.deployment.deployment import Deployment

HIT = "west.hit -> east.ball"
LEVELS_A = {"west.speed -> east.speed": 5, "west.lit -> judge.lit": False}


def hit(event_map: EventMap, n: int) -> Message:
    return event_map.message(HIT, n=n % 4001, last=False)


def pair(
    event_map: EventMap, faults: Faults | None = None, slots: int = 256
) -> tuple[InProcessLink, InProcessLink]:
    wire = Wire()
    a = InProcessLink(event_map, "a", wire, slots=slots)
    return a, InProcessLink(event_map, "b", wire, faults=faults, slots=slots)


def drain(link: Link) -> list[int]:
    link.begin_cycle()
    found = []
    while (message := link.receive()) is not None:
        assert isinstance(message.values[0], int)
        found.append(message.values[0])
    return found


def test_events_keep_their_order_and_levels_their_last_value(deployment: Deployment) -> None:
    a, b = pair(deployment.map)
    for n in range(40):
        assert a.send(hit(a.map, 2 * n))
        assert a.send(hit(a.map, 2 * n + 1))
        a.end_cycle({"west.speed -> east.speed": n - 300, "west.lit -> judge.lit": n % 2 == 1})
    assert b.level("west.speed -> east.speed") == 39 - 300
    assert b.level("west.lit -> judge.lit") is True
    assert a.level("judge.mood -> west.mood") is None
    assert drain(b) == list(range(80))
    counters = b.counters("a")
    assert (counters.frames, counters.lost_frames, counters.lost_events) == (120, 0, 0)
    assert a.sent == 120


def test_a_message_says_whom_it_is_for(deployment: Deployment) -> None:
    a, b = pair(deployment.map)
    name = "west.call -> east.called"
    a.send(a.map.message(name, who=3, why=-5, level=0.5, small=0.25, mood="wild"))
    a.end_cycle(LEVELS_A)
    b.begin_cycle()
    message = b.receive()
    assert message is not None
    assert (message.machine, message.event) == ("east", "called")
    assert message.payload == {"who": 3, "why": -5, "level": 0.5, "small": 0.25, "mood": "wild"}


def test_what_comes_in_during_a_cycle_waits_for_the_next(deployment: Deployment) -> None:
    a, b = pair(deployment.map)
    b.begin_cycle()
    a.send(hit(a.map, 1))
    a.end_cycle(LEVELS_A)
    assert b.receive() is None
    assert drain(b) == [1]


def test_a_tenth_of_the_frames_lost_is_counted_exactly(deployment: Deployment) -> None:
    faults = Faults(seed=3, loss=0.1)
    a, b = pair(deployment.map, faults)
    got: list[int] = []
    for n in range(2000):
        if n == 1999:
            faults.loss = 0.0
        if n % 3:
            a.send(hit(a.map, n))
        a.end_cycle(LEVELS_A)
        got += drain(b)
    counters = b.counters("a")
    events = len([n for n in range(2000) if n % 3])
    assert got == sorted(set(got))
    assert faults.lost == counters.lost_frames
    assert 250 < faults.lost < 420
    assert len(got) + counters.lost_events == events
    assert counters.frames == a.sent == 2000 + events


@pytest.mark.slow
@given(
    loss=st.floats(0, 0.5),
    duplication=st.floats(0, 0.5),
    delay=st.floats(0, 0.5),
    cycles=st.integers(0, 6),
    seed=st.integers(0, 2**64 - 1),
)
def test_nothing_comes_twice_or_out_of_order_and_all_is_accounted_for(
    loss: float, duplication: float, delay: float, cycles: int, seed: int, deployment: Deployment
) -> None:
    faults = Faults(seed, loss, duplication, delay, cycles)
    a, b = pair(deployment.map, faults)
    got: list[int] = []
    for n in range(60):
        a.send(hit(a.map, n))
        a.end_cycle(LEVELS_A)
        got += drain(b)
    faults.loss = faults.delay = 0.0
    for _ in range(10):
        a.end_cycle(LEVELS_A)
        got += drain(b)
    counters = b.counters("a")
    assert all(one < other for one, other in pairwise(got))
    assert len(got) + counters.lost_events + counters.missed == 60
    assert counters.doubled + counters.late <= faults.duplicated


@given(order=st.lists(st.integers(0, 30), min_size=1, max_size=80), start=st.integers(0, 2**32 - 1))
def test_counting_agrees_with_its_definition(
    order: list[int], start: int, deployment: Deployment
) -> None:
    """Frames 0..30 in any order, again and again, also around 2^32."""
    codec = Codec(deployment.map)
    receiver = Receiver(codec, 1, 1000, None)
    for number in order:
        sequence = (start + number) % 2**32
        receiver.arrive(0, codec.encode(Frame(0, 9, sequence, sequence, 1, (number, False))))
    in_order = [n for place, n in enumerate(order) if n > max(order[:place], default=-1)]
    taken = []
    while (message := receiver.events.get()) is not None:
        taken.append(message.values[0])
    counters = receiver.peers[0].counters
    assert taken == in_order
    assert counters.lost_frames == max(order) - order[0] + 1 - len(in_order)
    assert counters.lost_events == counters.lost_frames
    assert counters.doubled == len(order) - len(set(order))
    assert counters.late == len(set(order)) - len(in_order)
    assert counters.frames == len(order)


def test_a_full_ring_refuses_and_the_receiver_counts_it(deployment: Deployment) -> None:
    a, b = pair(deployment.map, slots=4)
    assert [a.send(hit(a.map, n)) for n in range(6)] == [True] * 4 + [False] * 2
    a.end_cycle(LEVELS_A)
    assert drain(b) == [0, 1, 2, 3]
    assert a.refused == 2
    assert b.counters("a").lost_events == 0
    a.end_cycle(LEVELS_A)  # nothing but levels, and they tell
    assert b.counters("a").lost_events == 2
    assert b.counters("a").lost_frames == 0


def test_a_slow_receiver_counts_what_it_has_no_room_for(deployment: Deployment) -> None:
    a, b = pair(deployment.map, slots=4)
    for n in range(7):
        a.send(hit(a.map, n))
        a.end_cycle(LEVELS_A)
    assert drain(b) == [0, 1, 2, 3]
    assert b.counters("a").overflow == 3


def test_a_restarted_peer_is_told_by_its_session(deployment: Deployment) -> None:
    wire = Wire()
    b = InProcessLink(deployment.map, "b", wire)
    first = InProcessLink(deployment.map, "a", wire, session=100)
    for n in range(10):
        first.send(hit(first.map, n))
        first.end_cycle(LEVELS_A)
    second = InProcessLink(deployment.map, "a", wire, session=101)
    second.send(hit(second.map, 77))
    second.end_cycle(LEVELS_A)
    first.send(hit(first.map, 11))
    first.end_cycle(LEVELS_A)  # a late word of the dead
    assert drain(b) == [*range(10), 77]
    counters = b.counters("a")
    assert (counters.session, counters.restarts, counters.lost_events) == (101, 1, 0)
    assert (counters.frames, counters.late) == (2, 2)


def test_what_was_sent_before_the_first_frame_that_came_is_missed_not_lost(
    deployment: Deployment,
) -> None:
    wire = Wire()
    a = InProcessLink(deployment.map, "a", wire)
    for n in range(3):
        a.send(hit(a.map, n))
    a.end_cycle(LEVELS_A)
    b = InProcessLink(deployment.map, "b", wire)
    a.send(hit(a.map, 3))
    a.end_cycle(LEVELS_A)
    assert drain(b) == [3]
    assert b.counters("a").missed == 3
    assert b.counters("a").lost_events == 0


def test_silence_grows_from_the_last_frame(deployment: Deployment) -> None:
    faults = Faults()
    a, b = pair(deployment.map, faults)
    silences = []
    for n in range(8):
        faults.is_cut = 3 <= n < 6
        a.end_cycle(LEVELS_A)
        b.begin_cycle()
        silences.append(b.silence("a"))
    assert silences == [0, 0, 0, 1, 2, 3, 0, 0]


def test_a_delayed_frame_holds_back_those_behind_it(deployment: Deployment) -> None:
    faults = Faults(seed=1, delay=1.0, delay_cycles=3)
    a, b = pair(deployment.map, faults)
    got = []
    for n in range(3):
        if n == 1:
            faults.delay = 0.0
        a.send(hit(a.map, n))
        a.end_cycle(LEVELS_A)
        got.append(drain(b))
    got += [drain(b), drain(b)]
    assert got == [[], [], [0, 1, 2], [], []]
    assert b.counters("a").lost_frames == 0


def test_faults_are_the_same_under_the_same_seed(deployment: Deployment) -> None:
    def losses(seed: int) -> Sequence[int]:
        a, b = pair(deployment.map, Faults(seed, loss=0.3))
        got = []
        for n in range(50):
            a.send(hit(a.map, n))
            a.end_cycle(LEVELS_A)
            got += drain(b)
        return got

    assert losses(5) == losses(5)
    assert losses(5) != losses(6)


def test_links_are_found_by_name(deployment: Deployment) -> None:
    wire = Wire()
    kind = plugin(LinkKind, "in_process")
    a = kind.open(LinkRequest(deployment.map, "a", 1, options={"wire": wire}))
    assert isinstance(a, Link)
    with pytest.raises(LinkTimeout, match=r"node `a` waited 0\.1 s for `b` to listen"):
        a.wait_listeners(0.1)
    b = kind.open(LinkRequest(deployment.map, "b", 1, options={"wire": wire}))
    a.wait_listeners(0.1)
    a.end_cycle(LEVELS_A)
    b.wait_frames("a", 1)
    with pytest.raises(LinkTimeout, match="`b` waited for `a`: 2 frames of session 0, there are 1"):
        b.wait_frames("a", 2)
    with pytest.raises(ValueError, match="too many"):
        b.wait_frames("a", 0)
    b.close()
    with pytest.raises(LinkTimeout):
        a.wait_listeners(0)


def test_wrong_use_is_said(deployment: Deployment) -> None:
    a, b = pair(deployment.map)
    with pytest.raises(ValueError, match="is not sent by `b`"):
        b.send(hit(a.map, 1))
    with pytest.raises(ValueError, match="the levels of this node are"):
        a.end_cycle({})
    with pytest.raises(ValueError, match="no level `x`"):
        a.level("x")
    with pytest.raises(ValueError, match="there is no node `c`"):
        a.counters("c")
