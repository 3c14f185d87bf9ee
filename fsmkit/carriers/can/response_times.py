"""Worst-case response times on a bus: fixed priorities, non-preemptive, with blocking and errors.

The analysis of R. I. Davis, A. Burns, R. J. Bril, J. J. Lukkien: Controller Area Network (CAN)
schedulability analysis: refuted, revisited and revised, Real-Time Systems 35 (2007), 239-272:
equations 6 to 12 for the busy period and its instances, 13 for errors. Times are in bits.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from fsmkit.carriers.can.chart_of_dbc import LEAST_PAUSE
from fsmkit.carriers.can.dbc import Dbc

ERROR_BITS = 31
"""Bits that an error frame and what follows it take, before the frame is sent again."""
BITRATE = 500_000
ERROR_EVERY = 10_000
"""Microseconds from one error to the next, at least, unless a deployment says otherwise."""


@dataclass(frozen=True, slots=True)
class TimedFrame:
    """Frames of one identifier. ``period``, ``jitter``: in bits of the bus."""

    frame: int
    is_extended: bool
    bits: int
    """The bits of the longest such frame, with all stuff bits and the pause after it."""
    period: int
    jitter: int = 0

    @property
    def priority(self) -> tuple[int, bool, int]:
        """The order of arbitration: a lower one wins (ISO 11898-1, 10.4.2, 10.5.4)."""
        if not self.is_extended:
            return self.frame, False, 0
        return self.frame >> 18, True, self.frame & 0x3FFFF


def frame_bits(length: int, *, is_extended: bool) -> int:
    """Return the bits of the longest frame with so many bytes, with the pause of three bits.

    34 bits of a frame beside its data are stuffed, 54 of an extended one: five equal bits are
    followed by another, which starts the next five (Davis et al., equations 1 and 2).
    """
    stuffed = (54 if is_extended else 34) + 8 * length
    return stuffed + 13 + (stuffed - 1) // 4


def fd_frame_bits(length: int) -> int:
    """Return the bits of the longest CAN FD frame with so many bytes, all at one bitrate.

    ISO 11898-1:2015, 10.4.2: 22 bits before the data of a frame with a short identifier; these
    and the data are stuffed as in classical frames. Then four bits that count stuff bits, and 17
    bits of checksum, 21 beyond 16 bytes; one fixed stuff bit before each four of them. The
    delimiter of the checksum and the acknowledgement may take two bits each, the delimiter of that
    one, the end seven, the pause three.
    """
    stuffed = 22 + 8 * length
    checksum = 27 if length <= 16 else 32
    return stuffed + (stuffed - 1) // 4 + checksum + 2 + 2 + 1 + 7 + 3


def load_of(frames: Iterable[TimedFrame]) -> float:
    """Return the share of time in which the bus is busy, without errors; over 1: overloaded."""
    return sum(frame.bits / frame.period for frame in frames)


def response_times(
    frames: Sequence[TimedFrame], error_every: int | None = None
) -> dict[tuple[int, bool], int | None]:
    """Return the longest time from the queuing of a frame to its end, in bits.

    Args:
        frames: All frames on the bus.
        error_every: The minimum number of bits between two errors; None: no errors.

    Returns:
        By identifier and whether it is extended; None without a bound, because the bus is
        overloaded at this priority.

    """
    in_order = sorted(frames, key=lambda frame: frame.priority)
    return {
        (frame.frame, frame.is_extended): _response(in_order, place, error_every)
        for place, frame in enumerate(in_order)
    }


def _response(frames: list[TimedFrame], place: int, error_every: int | None) -> int | None:
    own, higher = frames[place], frames[:place]
    blocking = max((frame.bits for frame in frames[place + 1 :]), default=0)
    again = max(frame.bits for frame in frames[: place + 1])

    def errors(time: int) -> int:
        return 0 if error_every is None else _ceil(time, error_every) * (ERROR_BITS + again)

    per_error = 0.0 if error_every is None else (ERROR_BITS + again) / error_every
    if load_of([*higher, own]) + per_error >= 1:
        return None
    busy = own.bits
    while True:  # it ends, since the load is below 1
        total = errors(busy) + blocking
        total += sum(_ceil(busy + f.jitter, f.period) * f.bits for f in (*higher, own))
        if total == busy:
            break
        busy = total
    worst = 0
    for instance in range(_ceil(busy + own.jitter, own.period)):
        wait = blocking + instance * own.bits
        while True:
            total = errors(wait + own.bits) + blocking + instance * own.bits
            total += sum(_ceil(wait + f.jitter + 1, f.period) * f.bits for f in higher)
            if total == wait:
                break
            wait = total
        worst = max(worst, own.jitter + wait - instance * own.period + own.bits)
    return worst


def _ceil(number: int, divisor: int) -> int:
    return -(-number // divisor)


def frames_of(dbc: Dbc, bitrate: int) -> tuple[TimedFrame, ...]:
    """Return the frames on the bus of a file.

    A message without a cycle is sent at most every `LEAST_PAUSE` milliseconds, as in its chart.
    """
    found = {}
    for message in dbc.messages:
        milliseconds = message.cycle or LEAST_PAUSE
        found[message.frame, message.is_extended] = TimedFrame(
            message.frame,
            message.is_extended,
            frame_bits(message.length, is_extended=message.is_extended),
            max(1, milliseconds * bitrate // 1000),
        )
    return tuple(found.values())


def microseconds(bits: int, bitrate: int) -> int:
    """Return a time in microseconds, rounded up."""
    return _ceil(bits * 1_000_000, bitrate)
