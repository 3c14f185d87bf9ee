"""Save a machine to bytes and restore it; `fsmkit.plan.image` describes the format."""

# ruff: noqa: SLF001  (machines of one family know each other)

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from itertools import islice
from typing import Any, ClassVar

from fsmkit.runtime.python.imaging import Imaging
from fsmkit.runtime.python.trace import CLOCK


class Saving(Imaging):
    """A machine that can be saved; a generated class that is to be able to holds a copy of this."""

    SAVED_BYTES: ClassVar[int]
    _VARIABLES: ClassVar[tuple[tuple[str, Any], ...]]
    _PAYLOAD: ClassVar[int]
    _DEFERRABLE: ClassVar[int]
    _ARMED: ClassVar[int]
    _LATER: ClassVar[int]
    _TIMED: ClassVar[dict[int, int]]
    _OWNERS: ClassVar[tuple[tuple[int, int], ...]]
    _RESTING: ClassVar[int]
    _RECORDABLE: ClassVar[tuple[int, ...]]
    _RECORDED_BELOW: ClassVar[tuple[tuple[int, int, int], ...]]
    _ENDINGS: ClassVar[int]
    _CAN_STOP: ClassVar[bool]
    _ROUTES: ClassVar[tuple[int, ...]]
    _IDS: ClassVar[tuple[int, ...]]
    _PEERS: ClassVar[tuple[str | None, ...]]

    # --- copied from here on into each generated class --------------------------------------------

    # --- saving -----------------------------------------------------------------------------------

    def save(self, now: int | None = None) -> bytes:
        """Return the machine as bytes, with the remaining time of each timer.

        `now` is a time in ticks; by default, that of the last call. Raises ValueError for a string
        that the chart does not contain, and after an exception of the host within a step.
        """
        self._claim()
        try:
            if self._fault == "exception":
                raise ValueError(f"{self.NAME} was broken off in the midst of a step")
            return self._image(self._now if now is None else now & CLOCK)
        finally:
            self._busy = False

    def restore(self, saved: bytes, now: int = 0) -> None:
        """Continue from saved bytes at a time in ticks.

        Raises ValueError for damaged bytes, which leave the machine unstarted, and for bytes of
        another chart.
        """
        self._claim()
        try:
            crc = struct.pack("<I", zlib.crc32(saved[:-4]))
            if saved[:4] != self._HEAD[:4] or saved[-4:] != crc:
                raise ValueError(f"this is no saved {self.NAME}, or damaged")
            if not saved.startswith(self._HEAD):
                raise ValueError(f"this was saved by another chart than {self.NAME}")
            if len(saved) != self.SAVED_BYTES:
                raise ValueError(f"a saved {self.NAME} has another length than {len(saved)}")
            try:
                self._get_machine(iter(saved[len(self._HEAD) : -4]), now & CLOCK)
                if self._image(now & CLOCK) != saved:
                    raise ValueError(f"no {self.NAME} is saved like that")
            except ValueError:
                self._forget(0)
                raise
            # if RECORDED
            self._record_restored(now & CLOCK)
            # endif
        finally:
            self._busy = False

    def _image(self, now: int) -> bytes:
        """Return the machine as bytes; ValueError for a text that the chart nowhere mentions."""
        data = bytearray(self._HEAD)
        self._put_machine(data, now)
        return bytes(data) + struct.pack("<I", zlib.crc32(data))

    def _forget(self, now: int) -> None:
        """Reset to a machine that has not been started."""
        self._reset_data()
        self._clear(now)
        self._running = False

    def _remember(self, place: int, states: int) -> None:
        """Let the history of an entry of `_RECORDED` remember some states more."""

    def _put_machine(self, data: bytearray, now: int) -> None:
        status = self._running | self._finished << 1
        data += struct.pack("<BB", status, self._fault_number())
        for state in self._state_numbers():
            data += struct.pack("<H", state)
        for name, type_ in self._VARIABLES:
            self._put_value(data, type_, getattr(self, name))
        if not self._running:
            data += bytes(self._rest_bytes())
            # if SLOTS
            data += bytes(sum(self._SLOT_BYTES))
            # endif
            return
        full = len(data) + self._rest_bytes()
        data.append(self._queue_count)
        for i in range(self._queue_count):
            at = (self._queue_head + i) % self.QUEUE
            self._put_event(data, self._queue_event[at], self._queue_fields, at * self.WIDTH)
        data += bytes((self.QUEUE - self._queue_count) * (2 + self._PAYLOAD))
        # if DEFERRABLE
        if self._DEFERRABLE:
            data.append(self._deferred_count)
            for i in range(self._deferred_count):
                at = i * self.WIDTH
                self._put_event(data, self._deferred_event[i], self._deferred_fields, at)
            data += bytes((self._DEFERRABLE - self._deferred_count) * (2 + self._PAYLOAD))
        # endif
        # if ARMED
        if self._ARMED:
            self._put_timers(data, now)
        # endif
        data += bytes(full - len(data))
        # if SLOTS
        for slot, size in enumerate(self._SLOT_BYTES):
            if self._children[slot].running:
                self._children[slot]._put_machine(data, now)
            else:
                data += bytes(size)
        # endif

    def _put_timers(self, data: bytearray, now: int) -> None:
        data.append(self._timer_count)
        for i in range(self._timer_count):
            left = (self._timer_due[i] - now) & CLOCK
            what = self._timer_what[i]
            data += struct.pack("<IH", left, what if what >= 0 else 0x8000)
        data += bytes((self._ARMED - self._timer_count) * 6)
        for i in range(self._timer_count):
            if self._timer_what[i] < 0:
                route = self._ROUTES.index(self._timer_route[i])
                name = self._IDS.index(self._timer_mark[i])
                data += struct.pack("<HHH", route, name, self._PEERS.index(self._timer_peer[i]))
                self._put_event(data, ~self._timer_what[i], self._timer_fields, i * self.WIDTH)

    def _rest_bytes(self) -> int:
        """Return the size of all events and timers."""
        size = 1 + self.QUEUE * (2 + self._PAYLOAD)
        # if DEFERRABLE
        if self._DEFERRABLE:
            size += 1 + self._DEFERRABLE * (2 + self._PAYLOAD)
        # endif
        # if ARMED
        if self._ARMED:
            size += 1 + self._ARMED * 6
        # endif
        return size + self._LATER * (8 + self._PAYLOAD)

    def _put_event(self, data: bytearray, event: int, fields: list[Any], at: int) -> None:
        data += struct.pack("<H", event + 1)
        end = len(data) + self._PAYLOAD
        for place, type_ in enumerate(self._EVENT_TYPES[event]):
            self._put_value(data, type_, fields[at + place])
        data += bytes(end - len(data))

    def _get_machine(self, read: Iterator[int], now: int) -> None:
        self._forget(now)
        status, fault = self._take(read, "B", 0, 2), self._take(read, "B", 0, 5)
        if fault and (status or not self._CAN_STOP):
            raise ValueError(f"{self.NAME} has stopped, and yet runs or is finished")
        numbers = [self._take_state(read, states) for states in self._REGIONS]
        recorded = [self._take_state(read, self._REGIONS[each[0]]) for each in self._RECORDED]
        is_ended = status == 2 and not self._ENDINGS >> numbers[0] & 1
        if is_ended or (status != 0 or fault != 0) is not any((*numbers, *recorded)):
            raise ValueError(f"{self.NAME} is in no such state when it has that status")
        if status or fault:
            self._require_legal(numbers, is_running=status == 1)
        active = 1
        for state in numbers:
            active |= self._ABOVE[state]
        self._active = active
        self._require_recorded(recorded)
        for place, (_, _, kept, is_whole) in enumerate(self._RECORDED):
            if state := recorded[place]:
                if not self._RECORDABLE[place] >> state & 1:
                    raise ValueError(f"no history of {self.NAME} can hold {state}")
                found = kept if is_whole else 1 << state & kept
                self._remember(place, found)
        for name, type_ in self._VARIABLES:
            setattr(self, name, self._get_value(read, type_, list))
        for i in range(self._get_count(read, self.QUEUE, "queue")):
            self._queue_event[i] = self._get_event(read, self._queue_fields, i * self.WIDTH)
            self._queue_count = i + 1
        self._skip(read, (self.QUEUE - self._queue_count) * (2 + self._PAYLOAD))
        # if DEFERRABLE
        if self._DEFERRABLE:
            for i in range(self._get_count(read, self._DEFERRABLE, "deferred events")):
                at = i * self.WIDTH
                self._deferred_event[i] = self._get_event(read, self._deferred_fields, at)
                self._deferred_count = i + 1
            self._skip(read, (self._DEFERRABLE - self._deferred_count) * (2 + self._PAYLOAD))
        # endif
        # if ARMED
        if self._ARMED:
            self._get_timers(read, now)
        # endif
        # if SLOTS
        for slot, size in enumerate(self._SLOT_BYTES):
            within = bytes(islice(read, size))
            if within[:2] != b"\0\0":
                self._children[slot]._get_machine(iter(within), now)
            else:
                self._children[slot]._forget(now)
        # endif
        self._running, self._finished = status == 1, status == 2
        self._fault = self._FAULTS[fault] or None

    def _require_legal(self, numbers: list[int], *, is_running: bool) -> None:
        """Raise ValueError for states in which no started machine is after a macrostep."""
        resting = self._RESTING if is_running else self._RESTING | self._ENDINGS
        for (region, owner), state in zip(self._OWNERS, numbers, strict=True):
            is_active = self._ABOVE[numbers[region]] & owner != 0
            if is_active is (state == 0) or (state and not resting >> state & 1):
                raise ValueError(f"{self.NAME} is never in such states")

    def _require_recorded(self, recorded: list[int]) -> None:
        """Raise ValueError where a history recorded a part of a state."""
        held = {self._RECORDED_BELOW[place][1] for place, state in enumerate(recorded) if state}
        for (entry, low, high), state in zip(self._RECORDED_BELOW, recorded, strict=True):
            is_held = low in held if entry < 0 else low <= recorded[entry] <= high
            if is_held is not (state != 0):
                raise ValueError(f"a history of {self.NAME} recorded half of a state")

    def _get_timers(self, read: Iterator[int], now: int) -> None:
        count = self._get_count(read, self._ARMED, "timers")
        earlier = None
        for i in range(count):
            left = self._take(read, "i", None, None)
            self._timer_due[i] = (left + now) & CLOCK
            self._timer_what[i] = what = self._take(read, "H", 0, 0x8000)
            self._timer_mark[i], self._timer_route[i], self._timer_peer[i] = -1, 0, None
            if what != 0x8000 and not self._TIMED.get(what, 0) & self._active:
                raise ValueError(f"{self.NAME} has no timer {what} in these states")
            if what != 0x8000 and what in self._timer_what[:i]:
                raise ValueError(f"{self.NAME} has two timers {what}")
            if earlier is not None and not 0 <= left - earlier <= CLOCK // 2:
                raise ValueError(f"{self.NAME} has timers in another order")
            earlier = left
        self._timer_count = count
        self._skip(read, (self._ARMED - count) * 6)
        for i in range(count):
            if self._timer_what[i] == 0x8000:
                route = self._take(read, "H", 0, len(self._ROUTES) - 1)
                self._timer_route[i] = self._ROUTES[route]
                self._timer_mark[i] = self._IDS[self._take(read, "H", 0, len(self._IDS) - 1)]
                self._timer_peer[i] = self._PEERS[self._take(read, "H", 0, len(self._PEERS) - 1)]
                self._timer_what[i] = ~self._get_event(read, self._timer_fields, i * self.WIDTH)
                self._sends += 1
        self._skip(read, (self._LATER - self._sends) * (8 + self._PAYLOAD))

    def _get_count(self, read: Iterator[int], most: int, what: str) -> int:
        count: int = self._take(read, "B", 0, 255)
        if count > most:
            raise ValueError(f"{self.NAME} holds {most} {what}, not {count}")
        return count

    def _get_event(self, read: Iterator[int], fields: list[Any], at: int) -> int:
        event: int = self._take(read, "H", 1, len(self._EVENT_TYPES)) - 1
        within = islice(read, self._PAYLOAD)
        for place, type_ in enumerate(self._EVENT_TYPES[event]):
            fields[at + place] = self._get_value(within, type_, tuple)
        self._skip(within, self._PAYLOAD)
        return event

    def _get_value(self, read: Iterator[int], type_: Any, make: type[Any]) -> Any:
        if type_[0] == "[":
            return make([self._get_value(read, part, make) for part in type_[1:]])
        if type_[0] == "text":
            return self._TEXTS[self._take(read, "I", 0, len(self._TEXTS) - 1)]
        if type_[0] == "?":
            return self._take(read, "B", 0, 1) == 1
        value = self._take(read, type_[0], type_[1], type_[2])
        if len(type_) > 3 and value not in type_[3]:
            raise ValueError(f"{value} is no member of its enumeration")
        return value

    def _take(self, read: Iterator[int], code: str, lo: Any, hi: Any) -> Any:
        """Take a number; it must lie between bounds, if there are any."""
        size = struct.calcsize("<" + code)
        data = bytes(islice(read, size))
        if len(data) < size:
            raise ValueError(f"this ends before it is a whole {self.NAME}")
        (value,) = struct.unpack("<" + code, data)
        if lo is not None and not lo <= value <= hi:
            raise ValueError(f"{value} is not within {lo}..{hi}")
        return value

    def _take_state(self, read: Iterator[int], states: tuple[int, ...]) -> int:
        """Take one of some states, or 0 for none."""
        state = int(self._take(read, "H", None, None))
        if state and state not in states:
            raise ValueError(f"{state} is no state of its region")
        return state

    def _skip(self, read: Iterator[int], size: int) -> None:
        for _ in islice(read, size):
            pass
