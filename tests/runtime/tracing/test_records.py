"""Records as bytes and back; streams in any pieces; nothing that is lost goes uncounted."""

from __future__ import annotations

import os
from collections.abc import Sequence

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from fsmkit.diagnostics import FsmkitError
from fsmkit.runtime.tracing.framing import (
    MOST,
    Unframer,
    cobs_decode,
    cobs_encode,
    crc16,
    decode_frame,
    encode_frame,
    encode_frames,
)
from fsmkit.runtime.tracing.merging import merge_contexts
from fsmkit.runtime.tracing.numbering import Numbering
from fsmkit.runtime.tracing.records import (
    MODULUS,
    CutError,
    Gap,
    Lost,
    Record,
    SnapshotRecord,
    Spoilt,
    Sync,
    TimeRecord,
    TransitionRecord,
    read_record,
    read_varint,
    record_bytes,
    varint,
)
from fsmkit.runtime.tracing.stream import Line, Stream, Timed
from tests.runtime.tracing.conftest import NUMBERING, records, syncs

ANY = records(NUMBERING)
SOME = st.lists(ANY, max_size=30)
FLIPS = int(os.environ.get("FSMKIT_FLIPS", "150"))
"""Flipped bits that are tried; a larger number takes new ones each time."""
FIRST = Sync(NUMBERING.hash, 0, 0, 5, 0, (0,) * len(NUMBERING.greatest))


def told(data: Sequence[bytes], numbering: Numbering = NUMBERING) -> list[object]:
    """Read pieces of a stream."""
    stream = Stream([numbering])
    found = [timed.told for piece in data for timed in stream.feed(piece)]
    return [*found, *(timed.told for timed in stream.end())]


def of(*many: Record) -> bytes:
    return b"".join(record_bytes(NUMBERING, record) for record in many)


# --- records ----------------------------------------------------------------------------------


@given(ANY)
def test_a_record_is_read_back(record: Record) -> None:
    data = record_bytes(NUMBERING, record)
    assert read_record(NUMBERING, data, 0) == (record, len(data))


@given(ANY)
def test_a_record_that_is_cut_is_no_record(record: Record) -> None:
    data = record_bytes(NUMBERING, record)
    for end in range(1, len(data)):
        with pytest.raises(CutError):
            read_record(NUMBERING, data[:end], 0)


@given(st.binary(min_size=1, max_size=80))
def test_any_bytes_are_a_record_or_none(data: bytes) -> None:
    try:
        _, after = read_record(NUMBERING, data, 0)
    except (CutError, ValueError, IndexError):
        return
    assert 0 < after <= len(data)


@given(st.integers(0, MODULUS - 1))
def test_numbers_take_a_byte_for_seven_bits(value: int) -> None:
    data = varint(value)
    assert len(data) == max(1, -(-value.bit_length() // 7))
    assert read_varint(data, 0) == (value, len(data))


@pytest.mark.parametrize(
    "data", [b"\xff\xff\xff\xff\x1f", b"\xff\xff\xff\xff\xff\xff", b"\x80" * 9]
)
def test_a_number_has_32_bits(data: bytes) -> None:
    with pytest.raises(ValueError, match="32 bits"):
        read_varint(data, 0)


def test_a_transition_takes_one_byte_and_two_with_a_time() -> None:
    assert of(TransitionRecord(0, 1)) == b"\x01"
    assert of(TimeRecord(5), TransitionRecord(0, 1)) == b"\x85\x01"
    assert len(of(TimeRecord(16_000), TransitionRecord(0, 1))) == 4


# --- streams ----------------------------------------------------------------------------------


@given(SOME, st.data())
def test_a_stream_may_come_in_any_pieces(some: list[Record], data: st.DataObject) -> None:
    whole = of(FIRST, *some)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(whole)), max_size=5)))
    pieces = [whole[a:b] for a, b in zip([0, *cuts], [*cuts, len(whole)], strict=True)]
    assert told(pieces) == [FIRST, *some]


@given(st.binary(max_size=60), SOME)
def test_a_reader_begins_at_the_next_sync(before: bytes, some: list[Record]) -> None:
    found = told([before.replace(b"\x73", b"\x00") + of(FIRST, *some)])
    assert found[bool(before) :] == [FIRST, *some]
    if before:
        assert found[0] == Spoilt(len(before), "the trace does not start here")


def size(told: Record | Spoilt | Gap) -> int:
    """Return the bytes of a record; 0 of what cannot be written: a symbol that no chart has."""
    if isinstance(told, Spoilt | Gap):
        return 0
    try:
        return len(record_bytes(NUMBERING, told))
    except FsmkitError:
        return 0


@given(SOME, SOME, st.integers(0), st.integers(1, 255))
@settings(max_examples=FLIPS, derandomize=FLIPS == 150)
@example([SnapshotRecord(b"")], [TimeRecord(1)], 1, 37)
def test_after_a_bit_flip_it_finds_the_next_sync(
    some: list[Record], more: list[Record], place: int, flip: int
) -> None:
    """What comes after the sync that follows is right, and bytes that were skipped are counted.

    Data that were saved may have a length of their own: a wrong one takes all that follows.
    """
    damaged = bytearray(of(*some))
    if damaged:
        damaged[place % len(damaged)] ^= flip
    stream = Stream([NUMBERING])
    data = of(FIRST) + bytes(damaged) + of(FIRST) * 2 + of(*more)
    found = [timed.told for timed in stream.feed(data)]
    found += [timed.told for timed in stream.end()]
    spoilt = sum(each.size for each in found if isinstance(each, Spoilt))
    assert spoilt == stream.counts.spoilt
    assert sum(map(size, found)) <= len(data)
    took_all = any(isinstance(each, SnapshotRecord) and each not in some for each in found)
    if more and not spoilt and not took_all:
        assert found[-len(more) :] == more or len(found) < len(some) + len(more)


@given(SOME, st.integers(0))
def test_a_stream_may_end_anywhere(some: list[Record], end: int) -> None:
    whole = of(FIRST, *some)
    found = told([whole[: end % (len(whole) + 1)]])
    read = [each for each in found if not isinstance(each, Spoilt)]
    assert read == [FIRST, *some][: len(read)]
    size = sum(each.size for each in found if isinstance(each, Spoilt))
    assert len(of(*read)) + size == end % (len(whole) + 1)  # type: ignore[arg-type]


def test_times_wrap_around() -> None:
    stream = Stream([NUMBERING])
    start = Sync(NUMBERING.hash, MODULUS - 2, 0, 5, 0, FIRST.numbers)
    data = of(
        start,
        TimeRecord(5),
        TransitionRecord(0, 1),
        TimeRecord(MODULUS - 1),
        TransitionRecord(0, 1),
    )
    assert [timed.at for timed in stream.feed(data)] == [
        MODULUS - 2, MODULUS + 3, MODULUS + 3, MODULUS + 2, MODULUS + 2,
    ]  # fmt: skip


def test_a_chart_that_is_not_there_is_named() -> None:
    other = Sync(b"\x01\x02\x03\x04", 7, 3, 1, 0, (1,))
    stream = Stream([NUMBERING])
    assert list(stream.feed(of(other) + b"\x05\x06" + of(FIRST))) == [
        Timed(0, 0, Spoilt(17, "the trace does not start here")),
        Timed(0, 0, FIRST),
    ]
    assert stream.counts.unknown == {b"\x01\x02\x03\x04": 1}


def test_losses_are_counted() -> None:
    stream = Stream([NUMBERING])
    list(stream.feed(of(FIRST, Lost(3), TransitionRecord(0, 1), Lost(4))))
    assert stream.counts.lost == 7


def test_a_flood_is_read_in_time() -> None:
    stream = Stream([NUMBERING])
    flood = b"\x73" * 16_000 + b"\x73\x8c\x00" * 2_400
    assert sum(1 for _ in stream.feed(flood)) == 0
    (left,) = stream.end()
    assert isinstance(left.told, Spoilt)
    assert left.told.size == len(flood)


# --- frames -----------------------------------------------------------------------------------


@given(st.binary(max_size=600))
@example(b"\x01" * 254)
@example(b"\x01" * 255)
@example(b"\x00" * 254)
def test_cobs(data: bytes) -> None:
    there = cobs_encode(data)
    assert 0 not in there
    assert len(there) <= len(data) + 1 + len(data) // 254
    assert cobs_decode(there) == data


@given(st.binary(max_size=300))
def test_what_is_no_cobs_gives_none_or_its_own(data: bytes) -> None:
    found = cobs_decode(data)
    assert found is None or cobs_decode(cobs_encode(found)) == found


def test_the_crc_is_the_one_of_the_catalogue() -> None:
    assert crc16(b"123456789") == 0x29B1


@given(st.integers(0, 127), st.binary(max_size=MOST), st.booleans())
def test_a_frame_is_read_back(sequence: int, data: bytes, is_within: bool) -> None:
    frame = encode_frame(sequence, data, is_within=is_within)
    assert frame.endswith(b"\0")
    assert decode_frame(frame[:-1]) == (sequence, is_within, data)


@given(st.binary(min_size=1, max_size=MOST), st.integers(0), st.integers(1, 255))
def test_a_frame_that_is_changed_is_dropped(data: bytes, place: int, flip: int) -> None:
    frame = bytearray(encode_frame(7, data)[:-1])
    frame[place % len(frame)] ^= flip
    assert decode_frame(bytes(frame)) is None


@given(SOME, st.sets(st.integers(0, 40)), st.data())
@settings(max_examples=150)
def test_lost_frames_are_counted_and_what_follows_is_right(
    some: list[Record], gone: set[int], data: st.DataObject
) -> None:
    """A frame a record, as a target makes them that is seldom busy; the last one comes."""
    whole = [record_bytes(NUMBERING, record) for record in (FIRST, *some, FIRST)]
    sent, number, kept, lost, waiting = b"", 0, list[object](), 0, 0
    for place, record in enumerate(whole):
        parts = [record[at : at + MOST] for at in range(0, len(record), MOST)]
        dropped = place in gone and 0 < place < len(whole) - 1
        for at, part in enumerate(parts):
            if not dropped:
                sent += encode_frame(number, part, is_within=at > 0)
            number += 1
        if dropped:
            lost += len(parts)
            waiting += len(parts)
        else:
            kept += [Gap(waiting)] if waiting else []
            waiting = 0
            kept.append([FIRST, *some, FIRST][place])
    line = Line(Stream([NUMBERING]))
    cut = data.draw(st.integers(0, len(sent)))
    found = [timed.told for piece in (sent[:cut], sent[cut:]) for timed in line.feed(piece)]
    assert found == kept
    assert line.unframer.lost == lost == line.stream.counts.gaps


def test_a_record_over_several_frames_is_given_up_where_one_is_lost() -> None:
    big = bytes(range(1, 240)) * 2
    data = of(FIRST) + b"\x75" + varint(len(big)) + big
    parts = encode_frames(data).split(b"\0")
    stream = Line(Stream([NUMBERING]))
    sent = b"\0".join([parts[0], parts[2], encode_frame(3, of(FIRST))])
    found = [timed.told for timed in stream.feed(sent)]
    assert [type(each) for each in found] == [Sync, Spoilt, Gap, Spoilt, Sync]
    assert stream.stream.counts.spoilt == 240 - len(of(FIRST)) + len(data) - 480


def test_noise_without_end_is_counted_once_and_forgotten() -> None:
    unframer = Unframer()
    assert list(unframer.feed(b"\x55" * 1_000_000)) == []
    assert unframer.spoilt == 1
    assert list(unframer.feed(b"\x55\0" + encode_frame(0, b"abc"))) == [b"abc"]


# --- contexts ---------------------------------------------------------------------------------


@given(st.lists(st.lists(st.integers(0, 50), max_size=10), max_size=4))
def test_contexts_are_merged_by_time(contexts: list[list[int]]) -> None:
    many = [[Timed(at, n, FIRST) for at in sorted(times)] for n, times in enumerate(contexts)]
    found = list(merge_contexts(many))
    assert [each.at for each in found] == sorted(at for times in contexts for at in times)
    for number, own in enumerate(many):
        assert [each for each in found if each.instance == number] == own


@given(st.lists(syncs(NUMBERING), max_size=5))
def test_a_sync_tells_its_time(some: list[Sync]) -> None:
    stream = Stream([NUMBERING])
    times = [timed.at % MODULUS for timed in stream.feed(of(*some))]
    assert times == [each.ticks for each in some]
