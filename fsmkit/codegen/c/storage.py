"""The storage of values in C: types of the least width, their sizes and alignments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import assert_never

import fsmkit.language as lang
from fsmkit.diagnostics.fast_init import fast_init

STORAGE = tuple(
    (f"{prefix}int{bits}_t", lo, hi, bits // 8)
    for bits in (8, 16, 32, 64)
    for prefix, lo, hi in (("u", 0, 2**bits - 1), ("", -(2 ** (bits - 1)), 2 ** (bits - 1) - 1))
)


@fast_init
@dataclass(frozen=True, slots=True)
class Storage:
    """A C type, its size and alignment in bytes."""

    text: str
    size: int
    alignment: int


def storage(type_: lang.Type, records: dict[str, str]) -> Storage:
    """Return the C type of a scalar or record; ``records``: C names of record types."""
    match type_:
        case lang.BoolType():
            return Storage("bool", 1, 1)
        case lang.IntType(lo, hi):
            text, size = integer_storage(lo, hi)
            return Storage(text, size, size)
        case lang.FloatType(bits):
            return Storage("float" if bits == 32 else "double", bits // 8, bits // 8)
        case lang.EnumType():
            text, size = integer_storage(*type_.bounds)
            return Storage(text, size, size)
        case lang.SymbolType():
            return Storage("uint16_t", 2, 2)
        case lang.DurationType():
            return Storage("uint32_t", 4, 4)
        case lang.ArrayType(element, length):
            inner = storage(element, records)
            return Storage(inner.text, inner.size * length, inner.alignment)
        case lang.RecordType(name, fields):
            parts = [storage(field.type, records) for field in fields]
            alignment = max((part.alignment for part in parts), default=1)
            return Storage(records[name], padded(parts, alignment), alignment)
        case _:
            assert_never(type_)


def padded(parts: list[Storage], alignment: int) -> int:
    """Return the size of a struct of parts in this order."""
    size = 0
    for part in parts:
        size += -size % part.alignment + part.size
    return size + -size % alignment


def integer_storage(lo: int, hi: int) -> tuple[str, int]:
    """Return the smallest C type that holds a range, and its size in bytes."""
    return next((text, size) for text, low, high, size in STORAGE if low <= lo and hi <= high)
