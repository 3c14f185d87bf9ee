"""The records of a trace, as values and as bytes (docs/reference/trace.md)."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import assert_never

from fsmkit.language import Value
from fsmkit.runtime.snapshot_bytes import pack_values, unpack_values
from fsmkit.runtime.tracing.numbering import HASH, Numbering

DIRECT = 112
"""Numbers below take one byte."""
TIME, LOST, INSTANCE, SYNC, FAR, SNAPSHOT, END, NOTE, RESTORE = range(0x70, 0x79)
SHORT_TIME = 0x80
MODULUS = 2**32
"""Of ticks."""
RUNNING, FINISHED, TELLS_ALL = 1, 2, 4
"""Bits of the status in a sync; the last one: records of level 2 follow."""
LONGEST_SNAPSHOT = 1 << 20
LONGEST_SYNC = (1 << 14) - 1
"""Its size stands in two bytes, as a varint that may be shorter."""


class CutError(Exception):
    """The bytes end within a record."""


@dataclass(frozen=True, slots=True)
class Passed:
    """Ticks, modulo 2^32, since the last time that was told."""

    ticks: int


@dataclass(frozen=True, slots=True)
class Lost:
    """So many records did not find room where they were written."""

    count: int


@dataclass(frozen=True, slots=True)
class Instance:
    """What follows is of another machine."""

    number: int


@dataclass(frozen=True, slots=True)
class Sync:
    """What a machine is: its chart, the time, its states and what its histories recorded.

    ``numbers``: for each machine of the chart's numbering the states of its regions and then of
    its histories, as in a saved machine (`plan.image`); ``fault``: as there.
    """

    hash: bytes
    ticks: int
    instance: int
    status: int
    fault: int
    numbers: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Saved:
    """A saved machine, at the time that was told last."""

    data: bytes


@dataclass(frozen=True, slots=True)
class End:
    """The end of a call of the host."""


@dataclass(frozen=True, slots=True)
class Restored:
    """The machine was restored: nothing that was before leads to what follows."""


@dataclass(frozen=True, slots=True)
class Note:
    """A number that the host told."""

    number: int


@dataclass(frozen=True, slots=True)
class Took:
    """A transition was taken."""

    machine: int
    transition: int


@dataclass(frozen=True, slots=True)
class Started:
    """A machine was started: 0, or one in a slot."""

    machine: int


@dataclass(frozen=True, slots=True)
class Came:
    """An event came: posted, or dispatched at once."""

    event: int
    payload: tuple[Value, ...] = ()
    is_dispatched: bool = False


@dataclass(frozen=True, slots=True)
class Read:
    """An input has another value."""

    place: int
    value: Value


@dataclass(frozen=True, slots=True)
class Returned:
    """An operation returned a value."""

    machine: int
    operation: str
    value: Value


@dataclass(frozen=True, slots=True)
class Gap:
    """Frames that were lost on the way; ``is_within``: what follows may begin within a record."""

    frames: int
    is_within: bool = False


@dataclass(frozen=True, slots=True)
class Spoilt:
    """Bytes that could not be read, and why."""

    size: int
    why: str


Record = (
    Restored
    | Passed
    | Lost
    | Instance
    | Sync
    | Saved
    | End
    | Note
    | Took
    | Started
    | Came
    | Read
    | Returned
)
Told = Record | Gap | Spoilt


# --- writing ----------------------------------------------------------------------------------


def varint(value: int) -> bytes:
    """Return a number of at most 32 bits in 7 bits a byte, the least first, bit 7: more follow."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes((*out, value))


def numbered(number: int) -> bytes:
    """Return the first bytes of a record of the numbering."""
    return bytes((number,)) if number < DIRECT else bytes((FAR,)) + varint(number - DIRECT)


def written(numbering: Numbering, record: Record) -> bytes:
    """Return the bytes of a record, as the writer in C gives them."""
    match record:
        case Passed(ticks):
            ticks %= MODULUS
            if not ticks:
                return b""
            return bytes((SHORT_TIME + ticks,)) if ticks < 128 else bytes((TIME,)) + varint(ticks)
        case Lost(count):
            return bytes((LOST,)) + varint(count)
        case Instance(number):
            return bytes((INSTANCE,)) + varint(number)
        case Sync(hash_, ticks, instance, status, fault, numbers):
            body = hash_ + struct.pack("<I", ticks % MODULUS) + varint(instance)
            body += bytes((status, fault)) + b"".join(map(varint, numbers))
            return bytes((SYNC, len(body) & 0x7F | 0x80, len(body) >> 7)) + body
        case Saved(data):
            return bytes((SNAPSHOT,)) + varint(len(data)) + data
        case End():
            return bytes((END,))
        case Restored():
            return bytes((RESTORE,))
        case Note(number):
            return bytes((NOTE,)) + varint(number)
        case Took(machine, transition):
            return numbered(numbering.base(machine) + transition)
        case Started(machine):
            return numbered(numbering.first_start + machine)
        case Came(event, payload, is_dispatched):
            first = numbering.first_dispatched if is_dispatched else numbering.first_event
            return _valued(numbering, first + event, payload)
        case Read(place, value):
            return _valued(numbering, numbering.first_input + place, (value,))
        case Returned(machine, operation, value):
            places = [(m, o.name) for m, o in numbering.results]
            number = numbering.first_result + places.index((machine, operation))
            return _valued(numbering, number, (value,))
        case _:
            assert_never(record)


def _valued(numbering: Numbering, number: int, values: tuple[Value, ...]) -> bytes:
    machine, fields, _ = numbering.fields[number]
    return numbered(number) + pack_values(numbering.images[machine], fields, values)


# --- reading ----------------------------------------------------------------------------------


def read_varint(data: bytes, at: int) -> tuple[int, int]:
    """Return a number and the place after it; `ValueError` for one of more than 32 bits."""
    value = 0
    for shift in range(0, 35, 7):
        if at >= len(data):
            raise CutError
        value |= (data[at] & 0x7F) << shift
        at += 1
        if data[at - 1] < 0x80:
            if value >= MODULUS:
                break
            return value, at
    raise ValueError("a number has more than 32 bits")


def read_record(numbering: Numbering | None, data: bytes, at: int) -> tuple[Record, int]:
    """Return the record at a place and the place after it.

    Without a numbering only those that stand for themselves can be read. `CutError`: it is not
    whole yet. `ValueError`: there is none.
    """
    first = data[at]
    if first >= SHORT_TIME:
        if first == SHORT_TIME:
            raise ValueError("a time of no ticks")
        return Passed(first - SHORT_TIME), at + 1
    if first < DIRECT:
        return _read_numbered(numbering, first, data, at + 1)
    match first:
        case 0x70 | 0x71 | 0x72 | 0x77:
            value, after = read_varint(data, at + 1)
            return _simple(first, value), after
        case 0x73:
            return read_sync(data, at)
        case 0x74:
            value, after = read_varint(data, at + 1)
            return _read_numbered(numbering, value + DIRECT, data, after)
        case 0x75:
            size, after = read_varint(data, at + 1)
            if size > LONGEST_SNAPSHOT:
                raise ValueError(f"a snapshot of {size} bytes")
            if after + size > len(data):
                raise CutError
            return Saved(data[after : after + size]), after + size
        case 0x76:
            return End(), at + 1
        case 0x78:
            return Restored(), at + 1
        case _:
            raise ValueError(f"no record begins with {first:02X}")


def _simple(first: int, value: int) -> Record:
    """Return a record that is a number."""
    match first:
        case 0x70:
            return Passed(value)
        case 0x71:
            return Lost(value)
        case 0x72 if value <= 0xFFFF:
            return Instance(value)
        case 0x77:
            return Note(value)
        case _:
            raise ValueError(f"no machine has the number {value}")


def read_sync(data: bytes, at: int) -> tuple[Sync, int]:
    """Return the sync at a place; its numbers are not compared with a chart."""
    size, start = read_varint(data, at + 1)
    if not HASH + 4 + 3 <= size <= LONGEST_SYNC:
        raise ValueError(f"a sync of {size} bytes")
    if start + size > len(data):
        raise CutError
    body = data[start : start + size]
    try:
        (ticks,) = struct.unpack_from("<I", body, HASH)
        instance, place = read_varint(body, HASH + 4)
        status, fault = body[place], body[place + 1]
        place += 2
        numbers = []
        while place < size:
            number, place = read_varint(body, place)
            numbers.append(number)
    except (CutError, IndexError) as error:
        raise ValueError("a sync whose size is wrong") from error
    if instance > 0xFFFF or status > RUNNING | FINISHED | TELLS_ALL:
        raise ValueError("a sync of no machine")
    found = Sync(body[:HASH], ticks, instance, status, fault, tuple(numbers))
    return found, start + size


def fits(numbering: Numbering, sync: Sync) -> bool:
    """Whether a sync is of that chart."""
    most = numbering.greatest
    return (
        sync.hash == numbering.hash
        and len(sync.numbers) == len(most)
        and all(number <= last for number, last in zip(sync.numbers, most, strict=True))
    )


def _read_numbered(
    numbering: Numbering | None, number: int, data: bytes, at: int
) -> tuple[Record, int]:
    if numbering is None:
        raise ValueError("its chart is not known yet")
    if number >= numbering.count:
        raise ValueError(f"`{numbering.chart.name}` has no record {number}")
    if number < numbering.first_start:
        return Took(*numbering.transitions[number]), at
    if number < numbering.first_event:
        return Started(number - numbering.first_start), at
    machine, fields, size = numbering.fields[number]
    if at + size > len(data):
        raise CutError
    image = numbering.images[machine]
    values = unpack_values(image, fields, data[at : at + size], takes_foreign=True)
    at += size
    if number < numbering.first_input:
        event = number - numbering.first_event
        is_dispatched = number >= numbering.first_dispatched
        event -= len(numbering.chart.events) if is_dispatched else 0
        return Came(event, values, is_dispatched), at
    if number < numbering.first_result:
        return Read(number - numbering.first_input, values[0]), at
    of, operation = numbering.results[number - numbering.first_result]
    return Returned(of, operation.name, values[0]), at
