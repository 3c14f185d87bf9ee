"""A bus with bit times: arbitration by identifier, real stuff bits, errors."""

from __future__ import annotations

import heapq
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from fsmkit.carriers.can.response_times import ERROR_BITS, TimedFrame


def crc15(bits: Sequence[int]) -> int:
    """Return the checksum of CAN, polynomial 0x4599."""
    crc = 0
    for bit in bits:
        is_next = bit ^ (crc >> 14)
        crc = (crc << 1) & 0x7FFF
        if is_next:
            crc ^= 0x4599
    return crc


def bits_of(frame: int, content: bytes, *, is_extended: bool, is_fd: bool = False) -> int:
    """Return the bits that a frame takes on the wire, with those stuffed and the pause behind."""

    def number(value: int, size: int) -> list[int]:
        return [value >> place & 1 for place in reversed(range(size))]

    if is_fd:
        return _fd_bits([0, *number(frame, 11), 0, 0, 1, 0, 0, 0], content)
    head = [0]
    if is_extended:
        head += [*number(frame >> 18, 11), 1, 1, *number(frame & 0x3FFFF, 18), 0, 0, 0]
    else:
        head += [*number(frame, 11), 0, 0, 0]
    body = [*head, *number(len(content), 4)]
    for byte in content:
        body += number(byte, 8)
    body += number(crc15(body), 15)
    # delimiter, acknowledgement and its, end, pause
    return len(body) + stuffed_in(body) + 1 + 1 + 1 + 7 + 3


def stuffed_in(bits: Sequence[int]) -> int:
    """Return how many bits are stuffed: one after five that are equal, which begins the next."""
    stuffed, run, last = 0, 0, -1
    for bit in bits:
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            stuffed += 1
            last, run = 1 - bit, 1
    return stuffed


def _fd_bits(head: list[int], content: bytes) -> int:
    """Return the bits of a frame of CAN FD without a bitrate switch.

    What follows the data has fixed stuff bits, so its content makes no difference: four bits that
    count the stuffed ones and the checksum, a fixed bit before each four.
    """
    sizes = (*range(9), 12, 16, 20, 24, 32, 48, 64)
    body = [*head, *(sizes.index(len(content)) >> place & 1 for place in (3, 2, 1, 0))]
    for byte in content:
        body += [byte >> place & 1 for place in reversed(range(8))]
    checksum = 4 + (17 if len(content) <= 16 else 21)
    fixed = (checksum + 3) // 4
    return len(body) + stuffed_in(body) + checksum + fixed + 1 + 1 + 1 + 7 + 3


@dataclass(slots=True)
class Sent:
    """A frame that came: when it was queued, and when its end was on the wire."""

    frame: TimedFrame
    queued: int
    ended: int


@dataclass(slots=True)
class Bus:
    """Carries frames of many nodes; time is in bits.

    ``error_every``: one error in each so many bits, at a random bit of the frame that is sent then.
    """

    error_every: int | None = None
    seed: int = 1
    errors: int = 0
    busy: int = 0
    _random: random.Random = field(default_factory=random.Random)

    def run(self, coming: Iterator[tuple[int, TimedFrame, bytes]]) -> Iterator[Sent]:
        """Yield each frame as it ends; ``coming``: when it is queued, in order of time."""
        self._random.seed(self.seed)
        waiting: list[tuple[tuple[int, bool, int], int, int, TimedFrame, bytes]] = []
        now, count, next_error = 0, 0, self._next_error(0)
        ahead = next(coming, None)
        while ahead is not None or waiting:
            if not waiting and ahead is not None:
                now = max(now, ahead[0])
            while ahead is not None and ahead[0] <= now:
                count += 1
                heapq.heappush(waiting, (ahead[1].priority, count, *ahead))
                ahead = next(coming, None)
            _, _, queued, frame, content = waiting[0]
            bits = bits_of(
                frame.frame, content, is_extended=frame.is_extended, is_fd=len(content) > 8
            )
            if next_error is not None and next_error < now + bits:
                at = max(next_error, now) - now
                next_error = self._next_error(now + at)
                now += at + ERROR_BITS
                self.busy += at + ERROR_BITS
                self.errors += 1
                continue  # it is sent again, if it wins again
            heapq.heappop(waiting)
            now += bits
            self.busy += bits
            yield Sent(frame, queued, now)

    def _next_error(self, last: int) -> int | None:
        if self.error_every is None:
            return None
        return last + self.error_every + self._random.randrange(self.error_every // 4)
