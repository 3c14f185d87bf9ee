"""How values are stored in C, and in which types they are computed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, assert_never

from fsmkit.diagnostics.frozen import quick
from fsmkit.language import (
    INT32,
    INT64,
    UINT32,
    UINT64,
    ArrayType,
    BoolType,
    DurationType,
    EnumType,
    FloatType,
    IntType,
    RecordType,
    SymbolType,
    Type,
)
from fsmkit.language.conversion import of_type

if TYPE_CHECKING:
    from fsmkit.codegen.c.names import Names

STORAGE = tuple(
    (f"{prefix}int{bits}_t", lo, hi, bits // 8)
    for bits in (8, 16, 32, 64)
    for prefix, lo, hi in (("u", 0, 2**bits - 1), ("", -(2 ** (bits - 1)), 2 ** (bits - 1) - 1))
)
COMPUTED = {"int32_t": INT32, "int64_t": INT64, "uint32_t": UINT32, "uint64_t": UINT64}
SMALL = IntType(-32767, 32767)
"""What an ``int`` holds on every machine (C99 5.2.4.2.1)."""


@quick
@dataclass(frozen=True, slots=True)
class Storage:
    """A C type, its size and alignment in bytes."""

    text: str
    size: int
    alignment: int


def storage(type_: Type, records: dict[str, str]) -> Storage:
    """Return how a scalar or record is stored; ``records``: C names of record types."""
    match type_:
        case BoolType():
            return Storage("bool", 1, 1)
        case IntType(lo, hi):
            text, size = integer_storage(lo, hi)
            return Storage(text, size, size)
        case FloatType(bits):
            return Storage("float" if bits == 32 else "double", bits // 8, bits // 8)
        case EnumType():
            text, size = integer_storage(*type_.bounds)
            return Storage(text, size, size)
        case SymbolType():
            return Storage("uint16_t", 2, 2)
        case DurationType():
            return Storage("uint32_t", 4, 4)
        case ArrayType(element, length):
            inner = storage(element, records)
            return Storage(inner.text, inner.size * length, inner.alignment)
        case RecordType(name, fields):
            parts = [storage(field.type, records) for field in fields]
            alignment = max((part.alignment for part in parts), default=1)
            return Storage(records[name], padded(parts, alignment), alignment)
        case _:
            assert_never(type_)


def passed_type(type_: Type, names: Names) -> str:
    """Return the C type in which functions take or return a value: an enumeration's is its own."""
    if isinstance(type_, EnumType):
        return names.enumerations[type_.name]
    return storage(type_, names.records).text


def enumeration_of(type_: Type, names: Names) -> str:
    """Return the enumeration whose members are stored, "" for other values."""
    while isinstance(type_, ArrayType):
        type_ = type_.element
    return names.enumerations[type_.name] if isinstance(type_, EnumType) else ""


def loaded(type_: Type, stored: str, names: Names) -> str:
    """Return what is stored as functions take it."""
    cast = f"({names.enumerations[type_.name]})" if isinstance(type_, EnumType) else ""
    return f"{cast}{stored}"


def padded(parts: list[Storage], alignment: int) -> int:
    """Return the size of a struct of parts in this order."""
    size = 0
    for part in parts:
        size += -size % part.alignment + part.size
    return size + -size % alignment


def integer_storage(lo: int, hi: int) -> tuple[str, int]:
    """Return the smallest C type that holds a range, and its size in bytes."""
    return next((text, size) for text, low, high, size in STORAGE if low <= lo and hi <= high)


def computed(*types: IntType) -> str | None:
    """Return the C type to compute in, so that all these fit; None where no type is wide enough."""
    if len(types) == 1:
        return _computing(types[0].lo, types[0].hi)
    return _computing(min([t.lo for t in types]), max([t.hi for t in types]))


@lru_cache(maxsize=1 << 12)
def _computing(lo: int, hi: int) -> str | None:
    if lo in SMALL and hi in SMALL:
        return "int"
    for text, type_ in COMPUTED.items():
        if type_.lo <= lo and hi <= type_.hi:
            return text
    return None


def wrapping(type_: IntType) -> str:
    """Return the C type of arithmetic that wraps around: its results must be of just that width."""
    return next(text for text, t in COMPUTED.items() if (t.lo, t.hi) == (type_.lo, type_.hi))


def interval(type_: Type | None) -> IntType:
    """Return the integers that a value of a discrete type is stored as."""
    found = (0, 65535) if isinstance(type_, SymbolType) else of_type(type_)
    assert found is not None  # noqa: S101  (discrete)
    return IntType(*found)


SUFFIX = {"int": "i32", "int32_t": "i32", "int64_t": "i64", "uint32_t": "u32", "uint64_t": "u64"}
UNSIGNED = {
    "int": "uint32_t",
    "int32_t": "uint32_t",
    "uint32_t": "uint32_t",
    "int64_t": "uint64_t",
    "uint64_t": "uint64_t",
}


def integer(value: int, ctype: str) -> str:
    """Spell an integer constant of a C type that computes."""
    match ctype:
        case "int":
            return str(value)
        case "int32_t":
            return "INT32_MIN" if value == INT32.lo else str(value)
        case "uint32_t":  # where int has 16 bits, `-3u` is 65533
            return f"{value}u" if value >= 0 else f"(uint32_t){value}"
        case "int64_t":
            if value == INT64.lo:
                return "INT64_MIN"
            return f"INT64_C({value})" if value >= 0 else f"-INT64_C({-value})"
        case _:
            return f"UINT64_C({value})"
