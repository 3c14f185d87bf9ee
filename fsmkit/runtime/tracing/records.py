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
"""Modulus of ticks."""
RUNNING, FINISHED, TELLS_ALL = 1, 2, 4
"""Bits of the status in a sync; the last one: records of level 2 follow."""
LONGEST_SNAPSHOT = 1 << 20
LONGEST_SYNC = (1 << 14) - 1
"""Maximum size of a sync, which is a varint of two bytes."""


class CutError(Exception):
    """The bytes end within a record."""


@dataclass(frozen=True, slots=True)
class TimeRecord:
    """Ticks, modulo 2^32, since the last recorded time."""

    ticks: int


@dataclass(frozen=True, slots=True)
class Lost:
    """So many records did not find room where they were written."""

    count: int


@dataclass(frozen=True, slots=True)
class Instance:
    """The machine of the following records."""

    number: int


@dataclass(frozen=True, slots=True)
class Sync:
    """The state of a machine: its chart, the time, its active states and histories.

    ``numbers``: for each machine of the chart's numbering the states of its regions and then of
    its histories, as in a saved machine (`plan.image`). ``fault`` is encoded likewise.
    """

    hash: bytes
    ticks: int
    instance: int
    status: int
    fault: int
    numbers: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class SnapshotRecord:
    """A saved machine, at the last recorded time."""

    data: bytes


@dataclass(frozen=True, slots=True)
class End:
    """The end of a call of the host."""


@dataclass(frozen=True, slots=True)
class RestoreRecord:
    """The machine was restored: the following records do not continue the previous state."""


@dataclass(frozen=True, slots=True)
class Note:
    """A number that the host recorded."""

    number: int


@dataclass(frozen=True, slots=True)
class TransitionRecord:
    """A transition was taken."""

    machine: int
    transition: int


@dataclass(frozen=True, slots=True)
class StartRecord:
    """A machine was started: 0, or the number of one in a slot."""

    machine: int


@dataclass(frozen=True, slots=True)
class EventRecord:
    """An event was posted, or dispatched immediately."""

    event: int
    payload: tuple[Value, ...] = ()
    is_dispatched: bool = False


@dataclass(frozen=True, slots=True)
class InputRecord:
    """An input changed its value."""

    place: int
    value: Value


@dataclass(frozen=True, slots=True)
class ResultRecord:
    """An operation returned a value."""

    machine: int
    operation: str
    value: Value


@dataclass(frozen=True, slots=True)
class Gap:
    """Frames that were lost; ``is_within``: the next bytes may start within a record."""

    frames: int
    is_within: bool = False


@dataclass(frozen=True, slots=True)
class Spoilt:
    """Damaged bytes, and the reason."""

    size: int
    why: str


Record = (
    RestoreRecord
    | TimeRecord
    | Lost
    | Instance
    | Sync
    | SnapshotRecord
    | End
    | Note
    | TransitionRecord
    | StartRecord
    | EventRecord
    | InputRecord
    | ResultRecord
)
TraceItem = Record | Gap | Spoilt


# --- writing ----------------------------------------------------------------------------------


def varint(value: int) -> bytes:
    """Return a number of at most 32 bits in 7 bits a byte, the least first, bit 7: more follow."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes((*out, value))


def number_bytes(number: int) -> bytes:
    """Return the number that starts a record, as bytes."""
    return bytes((number,)) if number < DIRECT else bytes((FAR,)) + varint(number - DIRECT)


def record_bytes(numbering: Numbering, record: Record) -> bytes:
    """Return the bytes of a record, equal to those of the writer in C."""
    match record:
        case TimeRecord(ticks):
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
        case SnapshotRecord(data):
            return bytes((SNAPSHOT,)) + varint(len(data)) + data
        case End():
            return bytes((END,))
        case RestoreRecord():
            return bytes((RESTORE,))
        case Note(number):
            return bytes((NOTE,)) + varint(number)
        case TransitionRecord(machine, transition):
            return number_bytes(numbering.base(machine) + transition)
        case StartRecord(machine):
            return number_bytes(numbering.first_start + machine)
        case EventRecord(event, payload, is_dispatched):
            first = numbering.first_dispatched if is_dispatched else numbering.first_event
            return _record_with_values(numbering, first + event, payload)
        case InputRecord(place, value):
            return _record_with_values(numbering, numbering.first_input + place, (value,))
        case ResultRecord(machine, operation, value):
            places = [(m, o.name) for m, o in numbering.results]
            number = numbering.first_result + places.index((machine, operation))
            return _record_with_values(numbering, number, (value,))
        case _:
            assert_never(record)


def _record_with_values(numbering: Numbering, number: int, values: tuple[Value, ...]) -> bytes:
    machine, fields, _ = numbering.fields[number]
    return number_bytes(number) + pack_values(numbering.images[machine], fields, values)


# --- reading ----------------------------------------------------------------------------------


def read_varint(data: bytes, at: int) -> tuple[int, int]:
    """Return a number and the offset after it; raises `ValueError` beyond 32 bits."""
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
    """Return the record at an offset, and the offset after it.

    Without a numbering, only records without chart items can be read. Raises `CutError` for an
    incomplete record, and `ValueError` for an invalid one.
    """
    first = data[at]
    if first >= SHORT_TIME:
        if first == SHORT_TIME:
            raise ValueError("a time of no ticks")
        return TimeRecord(first - SHORT_TIME), at + 1
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
            return SnapshotRecord(data[after : after + size]), after + size
        case 0x76:
            return End(), at + 1
        case 0x78:
            return RestoreRecord(), at + 1
        case _:
            raise ValueError(f"no record starts with {first:02X}")


def _simple(first: int, value: int) -> Record:
    """Return a record that is a number."""
    match first:
        case 0x70:
            return TimeRecord(value)
        case 0x71:
            return Lost(value)
        case 0x72 if value <= 0xFFFF:
            return Instance(value)
        case 0x77:
            return Note(value)
        case _:
            raise ValueError(f"no machine has the number {value}")


def read_sync(data: bytes, at: int) -> tuple[Sync, int]:
    """Return the sync at an offset, without comparing its numbers with a chart."""
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


def is_sync_of(numbering: Numbering, sync: Sync) -> bool:
    """Return whether a sync is of the chart of `numbering`."""
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
        return TransitionRecord(*numbering.transitions[number]), at
    if number < numbering.first_event:
        return StartRecord(number - numbering.first_start), at
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
        return EventRecord(event, values, is_dispatched), at
    if number < numbering.first_result:
        return InputRecord(number - numbering.first_input, values[0]), at
    of, operation = numbering.results[number - numbering.first_result]
    return ResultRecord(of, operation.name, values[0]), at
