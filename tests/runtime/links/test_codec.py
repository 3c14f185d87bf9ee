"""Frames: their bytes, and that nothing else is taken for one."""

from __future__ import annotations

import math
import re
import struct
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fsmkit.language import FloatType, Type, Value
from fsmkit.language.values import from_python, to_python
from fsmkit.runtime.links import EventMap
from fsmkit.runtime.links.codec import HEADER, Codec, Frame, Rejected, bounds
from fsmkit.system.deployment.deployment import Deployment
from fsmkit.system.deployment.event_map import LEVELS

WORDS = st.integers(0, 2**32 - 1)


def values_of(type_: Type) -> st.SearchStrategy[Value]:
    span = bounds(type_)
    if isinstance(type_, FloatType):
        return st.floats(width=32 if type_.bits == 32 else 64, allow_nan=False)
    assert span is not None
    numbers = st.integers(*span) | st.sampled_from(span)
    return numbers.map(lambda n: from_python(to_python(n, type_), type_))


def frames(event_map: EventMap) -> st.SearchStrategy[Frame]:
    codec = Codec(event_map)

    def of(sender: int, message: int) -> st.SearchStrategy[Frame]:
        types = codec.layout_of(sender, message).types
        values = st.tuples(*map(values_of, types))
        session = st.integers(1, 2**32 - 1)
        return st.builds(Frame, st.just(sender), session, WORDS, WORDS, st.just(message), values)

    events = st.sampled_from(event_map.messages).flatmap(lambda m: of(m.sender, m.number))
    levels = st.integers(0, len(event_map.nodes) - 1).flatmap(lambda node: of(node, LEVELS))
    return events | levels


def test_the_bytes_of_a_frame_are_those_of_the_reference_page(deployment: Deployment) -> None:
    event_map = deployment.map
    frame = Frame(0, 7, 2, 1, 3, (1, -5, 2.0, 0.5, 2))
    hash_ = struct.pack("<I", event_map.hash).hex()
    assert Codec(event_map).encode(frame).hex() == (
        f"464b0100{hash_}070000000200000001000000030001fbff00000000000000400000003f02"
    )


@pytest.mark.slow
@given(data=st.data())
def test_every_frame_comes_back(data: st.DataObject, deployment: Deployment) -> None:
    codec = Codec(deployment.map)
    frame = data.draw(frames(deployment.map))
    assert codec.decode(codec.encode(frame), 1 - frame.sender) == frame
    assert codec.decode(codec.encode(frame), frame.sender) is Rejected.FOREIGN


def test_every_message_of_the_ring_comes_back(ring: Deployment) -> None:
    codec = Codec(ring.map)
    assert len(ring.map.messages) == 51
    for message in ring.map.messages:
        payload = {part.name: "overrun" for part in message.fields}
        values = ring.map.message(message.name, **payload).values
        frame = Frame(message.sender, 1, 2, 3, message.number, values)
        assert codec.decode(codec.encode(frame), message.receiver) == frame
        assert len(codec.encode(frame)) == HEADER.size + len(message.fields)


@pytest.mark.slow
@given(data=st.data(), content=st.binary(max_size=60))
def test_other_bytes_are_no_frame(
    data: st.DataObject, content: bytes, deployment: Deployment
) -> None:
    codec = Codec(deployment.map)
    assert isinstance(codec.decode(content, 1), Rejected)
    whole = codec.encode(data.draw(frames(deployment.map).filter(lambda f: f.sender == 0)))
    cut = data.draw(st.integers(0, len(whole) - 1))
    assert codec.decode(whole[:cut], 1) is Rejected.MALFORMED
    assert codec.decode(whole + b"\0", 1) is Rejected.MALFORMED
    place = data.draw(st.integers(2, 7).filter(lambda n: n != 3))
    changed = bytes([*whole[:place], whole[place] ^ 0x10, *whole[place + 1 :]])
    assert codec.decode(changed, 1) is Rejected.FOREIGN


@pytest.mark.parametrize(
    ("values", "place", "byte"),
    [((4000, True), 22, 0xFF), ((4000, True), 24, 2), ((0, False), 8, 0)],
)
def test_a_value_outside_its_type_is_malformed(
    values: tuple[Value, ...], place: int, byte: int, deployment: Deployment
) -> None:
    codec = Codec(deployment.map)
    content = bytearray(codec.encode(Frame(0, 1, 0, 0, 1, values)))
    assert isinstance(codec.decode(bytes(content), 1), Frame)
    content[place] = byte
    assert codec.decode(bytes(content), 1) is Rejected.MALFORMED


def test_not_a_number_comes_through(deployment: Deployment) -> None:
    codec = Codec(deployment.map)
    frame = Frame(0, 1, 0, 0, 3, (0, 0, math.nan, math.inf, 0))
    found = codec.decode(codec.encode(frame), 1)
    assert isinstance(found, Frame)
    assert isinstance(found.values[2], float)
    assert math.isnan(found.values[2])
    assert found.values[3] == math.inf


def test_a_map_is_written_and_read(deployment: Deployment, ring: Deployment) -> None:
    for event_map in (deployment.map, ring.map):
        again = EventMap.from_json(event_map.as_json())
        assert again.as_json() == event_map.as_json()
        assert again.hash == event_map.hash
        with pytest.raises(ValueError, match="was changed"):
            EventMap.from_json(event_map.as_json().replace('"b"', '"c"'))
    assert deployment.map.hash != ring.map.hash


def test_the_map_is_that_of_the_system(deployment: Deployment) -> None:
    assert [message.name for message in deployment.map.messages] == [
        "west.hit -> east.ball",
        "east.hit -> west.ball",
        "west.call -> east.called",
        "east.note -> west.noted",
        "judge.told -> west.noted",
    ]
    assert [level.name for level in deployment.map.levels] == [
        "west.speed -> east.speed",
        "west.lit -> judge.lit",
        "judge.mood -> west.mood",
    ]


def test_what_a_message_cannot_be_is_said(deployment: Deployment) -> None:
    event_map = deployment.map
    with pytest.raises(ValueError, match=r"`n` of `west\.hit -> east\.ball` is outside"):
        event_map.message("west.hit -> east.ball", n=4001, last=False)
    with pytest.raises(ValueError, match=r"carries \(n, last\), not \(n\)"):
        event_map.message("west.hit -> east.ball", n=1)
    with pytest.raises(ValueError, match=r"no message `west\.hit` crosses"):
        event_map.message("west.hit")


def test_any_value_in_an_event_map_is_read_or_rejected(deployment: Deployment) -> None:
    """Each value of a map is replaced by each hostile one: nothing but `ValueError` comes of it."""
    text = deployment.map.as_json()
    hostile = ["1e400", "-1", "9" * 5000, "1.5", "null", "true", '"x"', "[]", "{}", "NaN"]
    hostile += ["[" * 100_000 + "]" * 100_000, '"' + "a" * 100_000 + '"', "1e999999999"]
    values = r'(?<=[\s\[:,])(?:-?\d+|"[^"]*"(?!\s*:)|true|false)(?=[\s\],}])'
    variants = 0
    for place in re.finditer(values, text):
        for value in hostile:
            variants += 1
            changed = text[: place.start()] + value + text[place.end() :]
            with suppress(ValueError):
                EventMap.from_json(changed)
    assert variants > 1000
