"""Response times: published figures, and a bus with bit times on which nothing is later."""

from __future__ import annotations

import os
import random
import sys
from collections.abc import Iterator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fsmkit.carriers.can.response_times import (
    TimedFrame,
    fd_frame_bits,
    frame_bits,
    load_of,
    microseconds,
    response_times,
)
from tests.carriers.can.can_bus import Bus, bits_of

pytestmark = pytest.mark.external

BITRATE = 500_000
LENGTHS = (0, 1, 8, 12, 16, 20, 24, 32, 48, 64)
SECONDS = 60 if os.environ.get("FSMKIT_LONG_CAN") else 6
"""Seconds on the bus; `FSMKIT_LONG_CAN=1` runs the whole minute."""


def frame(number: int, length: int, cycle_ms: float, *, is_extended: bool = False) -> TimedFrame:
    bits = frame_bits(length, is_extended=is_extended)
    return TimedFrame(number, is_extended, bits, int(cycle_ms * BITRATE / 1000))


def test_frames_have_the_lengths_of_the_paper() -> None:
    assert [frame_bits(n, is_extended=False) for n in (0, 1, 8)] == [55, 65, 135]
    assert [frame_bits(n, is_extended=True) for n in (0, 8)] == [80, 160]


def test_the_example_that_refuted_the_earlier_analysis() -> None:
    """The second instance of the last message is the worst; an earlier analysis saw the first."""
    frames = [
        TimedFrame(1, False, 125, 312),
        TimedFrame(2, False, 125, 437),
        TimedFrame(3, False, 125, 437),
    ]
    found = response_times(frames)
    # in units of 125 bits: 2.0, 3.0, 3.5; the second instance of the last is the worst
    assert [found[n, False] for n in (1, 2, 3)] == [250, 375, 438]


def test_an_overloaded_priority_has_no_bound() -> None:
    frames = [TimedFrame(1, False, 100, 150), TimedFrame(2, False, 100, 150)]
    assert load_of(frames) > 1
    found = response_times(frames)
    assert found[1, False] == 200
    assert found[2, False] is None
    assert response_times([TimedFrame(1, False, 135, 5000)], 100)[1, False] is None


@settings(deadline=None)
@given(frame_id=st.integers(0, 2**29 - 1), content=st.binary(max_size=8), is_extended=st.booleans())
def test_no_frame_is_longer_than_its_bound(
    frame_id: int, content: bytes, is_extended: bool
) -> None:
    number = frame_id if is_extended else frame_id & 0x7FF
    bits = bits_of(number, content, is_extended=is_extended)
    assert bits <= frame_bits(len(content), is_extended=is_extended)


@settings(deadline=None)
@given(
    number=st.integers(0, 2**11 - 1),
    length=st.sampled_from(LENGTHS),
    seed=st.integers(0, 2**32 - 1),
    share=st.sampled_from([0, 0.05, 0.5]),
)
def test_no_frame_of_can_fd_is_longer_than_its_bound(
    number: int, length: int, seed: int, share: float
) -> None:
    draw = random.Random(seed)
    content = bytes(draw.randrange(256) if draw.random() < share else 0 for _ in range(length))
    bits = bits_of(number, content, is_extended=False, is_fd=True)
    assert bits <= fd_frame_bits(length)


def test_the_bound_of_can_fd_is_near() -> None:
    """All zeros have a stuff bit in five; the worst, in four, is rare. Two bits are tolerances."""
    for length in LENGTHS:
        bits = bits_of(0, bytes(length), is_extended=False, is_fd=True)
        assert fd_frame_bits(length) - bits <= 2 + 2 + (22 + 8 * length) // 20 + 2


def test_messages_that_nodes_share_are_not_later_than_computed() -> None:
    """Frames of CAN FD among them, all queued at once behind the longest."""
    frames = [
        TimedFrame(0x100, False, frame_bits(1, is_extended=False), 5000),
        TimedFrame(0x101, False, fd_frame_bits(32), 5000),
        TimedFrame(0x102, False, fd_frame_bits(64), 10000),
        TimedFrame(0x103, False, frame_bits(3, is_extended=False), 5000),
        TimedFrame(0x104, False, frame_bits(8, is_extended=False), 50000),
    ]
    sizes = dict(zip(frames, (1, 32, 64, 3, 8), strict=True))
    bound = response_times(frames)
    coming = [(at - 1, frames[2], bytes(64)) for at in range(50000, 500000, 50000)]
    coming += [
        (at, part, bytes(sizes[part]))
        for part in frames
        for at in range(0, 500000, part.period)
        if part is not frames[2] or at % 50000
    ]
    worst = dict.fromkeys(bound, 0)
    for sent in Bus().run(iter(sorted(coming, key=lambda found: found[0]))):
        key = sent.frame.frame, sent.frame.is_extended
        worst[key] = max(worst[key], sent.ended - sent.queued)
    for key, most in worst.items():
        limit = bound[key]
        assert limit is not None
        assert 0.8 * limit <= most <= limit


def minute(frames: list[TimedFrame], seed: int) -> Iterator[tuple[int, TimedFrame, bytes]]:
    """Yield what is queued; phases are drawn anew each second, and are all equal at times."""
    draw = random.Random(seed)
    for second in range(SECONDS):
        start, end = second * BITRATE, (second + 1) * BITRATE
        is_instant = second % 2 == 0
        coming = []
        for part in frames:
            at = start + (0 if is_instant else draw.randrange(part.period))
            size = (part.bits - 44) // 10  # bytes, within one
            while at < end - part.period:
                length = min(8, max(0, size))
                fill = draw.choice([draw.randbytes(length), bytes(length), b"\xff" * length])
                coming.append((at, part, fill))
                at += part.period
        # a frame of the lowest priority begins one bit before all others are queued
        if is_instant and second:
            coming.append((start - 1, frames[-1], bytes(8)))
        yield from sorted(coming, key=lambda found: found[0])


def at_sixty_percent() -> list[TimedFrame]:
    """Return messages at 100 Hz and below, by priority, that load the bus by 60 percent."""
    frames: list[TimedFrame] = []
    number = 0
    while load_of(frames) < 0.6:
        number += 1
        frames.append(frame(number * 16, 8, 10 if number <= 18 else 20))
    return frames


@pytest.mark.parametrize("error_every", [None, 5000])
def test_no_frame_is_later_than_its_response_time(error_every: int | None) -> None:
    frames = at_sixty_percent()
    assert 0.6 <= load_of(frames) < 0.63
    bound = response_times(frames, error_every)
    worst = dict.fromkeys(bound, 0)
    bus = Bus(error_every)
    count = 0
    for sent in bus.run(minute(frames, 1)):
        key = sent.frame.frame, sent.frame.is_extended
        count += 1
        worst[key] = max(worst[key], sent.ended - sent.queued)
    assert count > 3000 * SECONDS // 3
    for key, most in worst.items():
        limit = bound[key]
        assert limit is not None
        assert most <= limit
    figures = [
        (key[0], microseconds(worst[key], BITRATE), microseconds(bound[key] or 0, BITRATE))
        for key in sorted(worst)[:5]
    ]
    line = f"id, worst measured, R in us: {figures}; {count} frames, {bus.errors} errors"
    sys.stdout.write(f"{line}\n")
    if error_every is None:
        for _, measured, limit in figures:
            assert limit <= 1.5 * measured
    else:
        assert bus.errors > 10 * SECONDS
