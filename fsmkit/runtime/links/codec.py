"""Frames: their bytes, as docs/reference/links.md describes them."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import fsmkit.language as lang
from fsmkit.language.conversion import integer_bounds
from fsmkit.system.deployment.event_map import LEVELS, EventMap

MAGIC = b"FK"
VERSION = 1
HEADER = struct.Struct("<2sBBIIIIH")
"""Magic, version, sender, hash of the map, session, sequence, events, message."""
LARGEST = 1 << 16
"""Bytes of a frame, at most."""
INTEGERS = (
    ("B", 0, 2**8 - 1),
    ("b", -(2**7), 2**7 - 1),
    ("H", 0, 2**16 - 1),
    ("h", -(2**15), 2**15 - 1),
    ("I", 0, 2**32 - 1),
    ("i", -(2**31), 2**31 - 1),
    ("Q", 0, 2**64 - 1),
    ("q", -(2**63), 2**63 - 1),
)
"""By size, then without a sign first."""


class Rejected(Enum):
    """The reason why bytes are not accepted as a frame."""

    MALFORMED = "malformed"
    """No frame, cut off, too long, or with a value that its type forbids."""
    FOREIGN = "foreign"
    """Another version, another event map, or an unknown node."""


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame, decoded. ``message`` is `LEVELS` or the number of an event."""

    sender: int
    session: int
    sequence: int
    events: int
    message: int
    values: tuple[lang.Value, ...]


def bounds(type_: lang.Type) -> tuple[int, int] | None:
    """Return the minimum and maximum integer code of a type, or None for floats."""
    found = integer_bounds(type_)
    if found is None and not isinstance(type_, lang.FloatType):
        raise ValueError(f"`{type_}` does not cross nodes")
    return found


def code_of(type_: lang.Type) -> str:
    """Return the letter of `struct` for the smallest integer that holds a type, or its float."""
    if isinstance(type_, lang.FloatType):
        return "f" if type_.bits == 32 else "d"
    span = bounds(type_)
    assert span is not None  # noqa: S101  (only floats have none)
    return next(code for code, lo, hi in INTEGERS if lo <= span[0] and span[1] <= hi)


@dataclass(frozen=True, slots=True)
class Layout:
    """The order and size of the values in a payload."""

    types: tuple[lang.Type, ...]
    packing: struct.Struct

    def encode(self, values: tuple[lang.Value, ...]) -> bytes:
        """Return the bytes of values of these types."""
        return self.packing.pack(*values)

    def decode(self, payload: bytes) -> tuple[lang.Value, ...] | None:
        """Return the values, or None if one is not a value of its type."""
        found: list[lang.Value] = []
        for value, type_ in zip(self.packing.unpack(payload), self.types, strict=True):
            span = bounds(type_)
            if span is not None and not span[0] <= value <= span[1]:
                return None
            if isinstance(type_, lang.EnumType) and value not in type_.numbers:
                return None
            found.append(bool(value) if isinstance(type_, lang.BoolType) else value)
        return tuple(found)


def layout(types: tuple[lang.Type, ...]) -> Layout:
    """Return how values of these types are packed: little-endian, without gaps."""
    return Layout(types, struct.Struct("<" + "".join(map(code_of, types))))


@dataclass(frozen=True)
class Codec:
    """Encodes and decodes the frames of an event map."""

    map: EventMap

    @cached_property
    def events(self) -> tuple[Layout, ...]:
        """The payloads of the events, by number from 1."""
        return tuple(layout(tuple(f.type for f in m.fields)) for m in self.map.messages)

    @cached_property
    def levels(self) -> tuple[Layout, ...]:
        """The levels of each node."""
        return tuple(
            layout(tuple(level.type for level in self.map.levels_of(node)))
            for node in range(len(self.map.nodes))
        )

    @cached_property
    def largest(self) -> int:
        """The bytes of the largest frame of the map."""
        return HEADER.size + max(found.packing.size for found in (*self.events, *self.levels))

    def layout_of(self, sender: int, message: int) -> Layout:
        """Return how the payload of a message is packed."""
        return self.levels[sender] if message == LEVELS else self.events[message - 1]

    def encode(self, frame: Frame) -> bytes:
        """Return the bytes of a frame."""
        header = HEADER.pack(
            MAGIC,
            VERSION,
            frame.sender,
            self.map.hash,
            frame.session,
            frame.sequence,
            frame.events,
            frame.message,
        )
        return header + self.layout_of(frame.sender, frame.message).encode(frame.values)

    def decode(self, content: bytes, node: int) -> Frame | Rejected:
        """Return the frame that arrived at `node`, or the reason for its rejection."""
        if content[:2] != MAGIC or len(content) < 3:
            return Rejected.MALFORMED
        if content[2] != VERSION:
            return Rejected.FOREIGN
        if not HEADER.size <= len(content) <= LARGEST:
            return Rejected.MALFORMED
        _, _, sender, hash_, session, sequence, events, message = HEADER.unpack_from(content)
        if hash_ != self.map.hash or sender >= len(self.map.nodes) or sender == node:
            return Rejected.FOREIGN
        if message > len(self.map.messages) or session == 0:
            return Rejected.MALFORMED
        if message != LEVELS and self.map.messages[message - 1].sender != sender:
            return Rejected.MALFORMED
        found = self.layout_of(sender, message)
        if len(content) != HEADER.size + found.packing.size:
            return Rejected.MALFORMED
        values = found.decode(content[HEADER.size :])
        if values is None:
            return Rejected.MALFORMED
        return Frame(sender, session, sequence, events, message, values)
