"""Frames for a line that loses and changes bytes: COBS of sequence, records and CRC, then zero.

COBS (Cheshire, Baker: Consistent Overhead Byte Stuffing, 1999) removes zeros from a frame, so that
a reader finds the next frame after any damage. The CRC is CRC-16/CCITT-FALSE (ITU-T V.41:
polynomial 0x1021, initial value 0xFFFF, not reflected) of sequence and records, high byte first.
The sequence counts frames modulo 128. Its bit 7 marks a frame that may start within a record.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fsmkit.runtime.tracing.records import Gap

MOST = 240
"""Bytes of records in a frame."""
LONGEST = 1 + MOST + 2 + 1
"""Bytes of a frame after COBS, without its zero: one code byte per 254 others."""
SEQUENCE = 0x7F
WITHIN = 0x80
"""The frame may start within a record."""


def crc16(data: bytes) -> int:
    """Return the CRC-16/CCITT-FALSE: 0x29B1 of ``123456789``."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


def cobs_encode(data: bytes) -> bytes:
    """Return bytes without a zero, by COBS; one more in each 254."""
    out = bytearray()
    block = bytearray()
    is_open = True
    for byte in data:
        is_open = True
        if byte:
            block.append(byte)
        if not byte or len(block) == 0xFE:
            out += bytes((len(block) + 1, *block))
            is_open = not byte
            block.clear()
    if is_open:
        out += bytes((len(block) + 1, *block))
    return bytes(out)


def cobs_decode(data: bytes) -> bytes | None:
    """Return the decoded bytes, or None if `data` is not COBS."""
    out = bytearray()
    at = 0
    while at < len(data):
        code = data[at]
        block = data[at + 1 : at + code]
        if code == 0 or len(block) != code - 1 or 0 in block:
            return None
        out += block
        at += code
        if code < 0xFF and at < len(data):
            out.append(0)
    return bytes(out)


def encode_frame(sequence: int, data: bytes, *, is_within: bool = False) -> bytes:
    """Return the frame of at most `MOST` bytes of records, with its zero."""
    if len(data) > MOST:
        raise ValueError(f"a frame holds {MOST} bytes, not {len(data)}")
    head = sequence & SEQUENCE | (WITHIN if is_within else 0)
    content = bytes((head, *data))
    return cobs_encode(content + crc16(content).to_bytes(2, "big")) + b"\0"


def encode_frames(data: bytes, sequence: int = 0) -> bytes:
    """Return the frames of a stream, cut as by the writer in C."""
    parts = [data[at : at + MOST] for at in range(0, len(data), MOST)]
    return b"".join(
        encode_frame(sequence + n, part, is_within=n > 0) for n, part in enumerate(parts)
    )


def decode_frame(frame: bytes) -> tuple[int, bool, bytes] | None:
    """Return sequence, whether it may start within a record, and records; None if damaged."""
    content = cobs_decode(frame) if len(frame) <= LONGEST else None
    if content is None or len(content) < 3:
        return None
    if crc16(content[:-2]) != int.from_bytes(content[-2:], "big"):
        return None
    return content[0] & SEQUENCE, bool(content[0] & WITHIN), content[1:-2]


@dataclass(slots=True)
class Unframer:
    """Decodes the frames in the bytes of a line.

    ``frames`` and ``spoilt`` count complete and damaged frames. ``lost`` counts the frames that
    the sequence misses (modulo 128: a loss of 128 frames in a row is not counted).
    """

    frames: int = 0
    spoilt: int = 0
    lost: int = 0
    _rest: bytes = b""
    _next: int | None = None
    _is_flood: bool = False

    def feed(self, data: bytes) -> Iterator[bytes | Gap]:
        """Yield the bytes of complete frames, and a `Gap` after each loss."""
        *whole, self._rest = (self._rest + data).split(b"\0")
        for frame in whole:
            if self._is_flood:  # the end of the discarded bytes
                self._is_flood = False
            elif frame:
                yield from self._frame(frame)
        if len(self._rest) > LONGEST:  # no frame is so long: forget it, and count it once
            self.spoilt += not self._is_flood
            self._rest, self._is_flood = b"", True

    def _frame(self, frame: bytes) -> Iterator[bytes | Gap]:
        found = decode_frame(frame)
        if found is None:
            self.spoilt += 1
            return
        sequence, is_within, records = found
        self.frames += 1
        missing = 0 if self._next is None else (sequence - self._next) & SEQUENCE
        is_first = self._next is None
        self._next = (sequence + 1) & SEQUENCE
        self.lost += missing
        if missing or (is_first and is_within):
            yield Gap(missing, is_within)
        yield records


def looks_framed(data: bytes) -> bool:
    """Return whether the bytes contain a complete frame."""
    return any(decode_frame(part) is not None for part in data.split(b"\0")[:-1])
