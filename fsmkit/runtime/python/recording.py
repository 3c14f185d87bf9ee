"""Record the steps of a machine in the format of generated C (`runtime.tracing.records`).

Invoked machines record through the outermost one, whose numbers include theirs.
"""

# ruff: noqa: SLF001  (machines of one family know each other)

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import Any, ClassVar

from fsmkit.runtime.python.saving import Saving
from fsmkit.runtime.python.trace import CLOCK


class Recording(Saving):
    """A machine that is recorded; a generated class that is to be holds a copy of this."""

    _INPUTS: ClassVar[tuple[tuple[str, Any], ...]]
    _RESULTS: ClassVar[tuple[Any, ...]]
    _RECORD_HASH: ClassVar[bytes]
    _RECORD_FIRST: ClassVar[tuple[int, int, int]]
    _RECORD_PLACES: ClassVar[tuple[tuple[int, int, int], ...]]
    _RECORD_PERIOD: ClassVar[int]

    records: bytearray
    _record_first: int
    _record_inputs: list[bytes]
    _record_is_open: bool
    _record_now: int
    _record_result: int
    _record_root: Any
    _record_start: int
    _record_synced: int
    _record_told: int

    # --- copied from here on into each generated class --------------------------------------------

    # --- records ----------------------------------------------------------------------------------

    def _record_prepare(self) -> None:
        """Start without records, as outermost machine; an invoking machine replaces that."""
        self.records = bytearray()
        self._record_told = 0
        self._record_synced = 0
        self._record_now = 0
        self._record_is_open = False
        self._record_inputs = [b""] * len(self._INPUTS)
        self._record_join(self, 0)

    def _record_join(self, root: Any, number: int) -> int:
        """Take the numbers of a machine of a family; return the next number."""
        self._record_root = root
        places = root._RECORD_PLACES[number]
        self._record_first = places[0]
        self._record_start = places[1]
        self._record_result = places[2]
        number += 1
        # if SLOTS
        for slot, _ in enumerate(self._SLOT_BYTES):
            number = self._children[slot]._record_join(root, number)
        # endif
        return number

    # --- calls of the host ------------------------------------------------------------------------

    def _record_starting(self, now: int) -> None:
        """Record the state before the start, and all inputs."""
        self._record_open(now)
        self._record_sync(now)
        self._record_read(is_start=True)

    def _record_calling(self, now: int) -> None:
        """Record the state before a call: changed inputs, and once a second the whole state."""
        self._record_open(now)
        if (now - self._record_synced) & CLOCK >= self._RECORD_PERIOD:
            self._record_whole(now)
        self._record_read(is_start=False)

    def _record_dispatched(self, event: int) -> None:
        """Record an event that is processed immediately, with the current payload."""
        self._record_put(
            self._record_now,
            self._RECORD_FIRST[1] + event,
            self._record_bytes(self._EVENT_TYPES[event], self._fields),
        )

    def _record_posted(self, event: int, payload: Any) -> None:
        """Record an event that the host posts, whether it finds room or not."""
        told = self._record_bytes(self._EVENT_TYPES[event], payload)
        self._record_put(self._record_told, self._RECORD_FIRST[0] + event, told)

    def _record_end(self) -> None:
        """Record the end of a call that did something."""
        if self._record_is_open:
            self._record_time(self._record_now)
            self.records.append(0x76)

    def _record_broken(self) -> None:
        """Record the state after an exception of the host, which no interpreter can compute."""
        self._record_sync(self._record_now)

    def _record_restored(self, now: int) -> None:
        """Record that the machine is another now."""
        self._record_time(now)
        self.records.append(0x78)
        self._record_whole(now)

    # --- within a step ----------------------------------------------------------------------------

    def _record_started(self) -> None:
        """Record that this machine starts."""
        root = self._record_root
        root._record_is_open = True
        root._record_put(root._record_now, self._record_start, b"")

    def _record_taken(self, transition: int) -> None:
        """Record a transition."""
        root = self._record_root
        root._record_is_open = True
        root._record_put(root._record_now, self._record_first + transition, b"")

    def _record_returned(self, place: int, value: Any) -> None:
        """Record the result of an operation, by its place among those that have one."""
        root = self._record_root
        root._record_is_open = True
        told = self._record_bytes((self._RESULTS[place],), (value,))
        root._record_put(root._record_now, self._record_result + place, told)

    # --- bytes ------------------------------------------------------------------------------------

    def _record_open(self, now: int) -> None:
        self._record_now = now
        self._record_is_open = False

    def _record_read(self, *, is_start: bool) -> None:
        """Record the inputs that have changed, all of them at a start."""
        for place, (name, type_) in enumerate(self._INPUTS):
            told = self._record_bytes((type_,), (getattr(self, name),))
            if is_start or told != self._record_inputs[place]:
                self._record_inputs[place] = told
                self._record_is_open = True
                self._record_put(self._record_now, self._RECORD_FIRST[2] + place, told)

    def _record_bytes(self, types: tuple[Any, ...], values: Any) -> bytes:
        """Return values as they are saved; a text of the host's own is a number that none has."""
        data = bytearray()
        for place, type_ in enumerate(types):
            value = values[place]
            if type_[0] == "[":
                data += self._record_bytes(type_[1:], value)
            elif type_[0] == "text" and value not in self._TEXTS:
                data += struct.pack("<I", 0x10000 | zlib.crc32(value.encode()) & 0xFFFF)
            else:
                self._put_value(data, type_, value)
        return bytes(data)

    def _record_put(self, now: int, number: int, payload: bytes) -> None:
        """Put a record of the chart's numbering, at a time."""
        self._record_time(now)
        if number < 0x70:
            self.records.append(number)
        else:
            self.records.append(0x74)
            self._record_varint(number - 0x70)
        self.records += payload

    def _record_time(self, now: int) -> None:
        """Write the ticks since the last recorded time."""
        passed = (now - self._record_told) & CLOCK
        self._record_told = now
        if passed > 0x7F:
            self.records.append(0x70)
            self._record_varint(passed)
        elif passed:
            self.records.append(0x80 + passed)

    def _record_varint(self, value: int) -> None:
        while value > 0x7F:
            self.records.append(value & 0x7F | 0x80)
            value >>= 7
        self.records.append(value)

    def _record_whole(self, now: int) -> None:
        """Put the states, and the saved machine where there is one."""
        self._record_sync(now)
        # if RECORD_SAVES
        try:
            image = self._image(now)
        except ValueError:
            return  # it holds a text that no saved machine can
        self.records.append(0x75)
        self._record_varint(len(image))
        self.records += image
        # endif

    def _record_sync(self, now: int) -> None:
        """Put the states of the machine and of those in its slots."""
        outer, self.records = self.records, bytearray()
        self.records += self._RECORD_HASH + struct.pack("<I", now) + b"\0"
        self.records.append(self._running | self._finished << 1 | 4)
        self.records.append(6 if self._fault == "exception" else self._fault_number())
        for number in self._record_numbers():
            self._record_varint(number)
        size = len(self.records)
        outer += bytes((0x73, size & 0x7F | 0x80, size >> 7)) + self.records
        self.records = outer
        self._record_told = self._record_synced = now

    def _record_numbers(self) -> Iterator[int]:
        """Yield the numbers of the states of this machine, then of those in its slots."""
        yield from self._state_numbers()
        # if SLOTS
        for slot, _ in enumerate(self._SLOT_BYTES):
            child = self._children[slot]
            numbers = child._record_numbers()
            yield from numbers if child._running else (0 for _ in numbers)
        # endif
