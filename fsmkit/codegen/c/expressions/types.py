"""C types for storing values and for computing with them."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import fsmkit.language as lang
from fsmkit.codegen.c.storage import storage
from fsmkit.language.conversion import integer_bounds

if TYPE_CHECKING:
    from fsmkit.codegen.c.names import Names

COMPUTED = {
    "int32_t": lang.INT32,
    "int64_t": lang.INT64,
    "uint32_t": lang.UINT32,
    "uint64_t": lang.UINT64,
}
SMALL = lang.IntType(-32767, 32767)
"""The range of an ``int`` with every compiler (C99 5.2.4.2.1)."""


def parameter_type(type_: lang.Type, names: Names) -> str:
    """Return the C type of a parameter or result; an enumeration has its own type."""
    if isinstance(type_, lang.EnumType):
        return names.enumerations[type_.name]
    return storage(type_, names.records).text


def enumeration_of(type_: lang.Type, names: Names) -> str:
    """Return the enumeration whose members are stored, or "" for other values."""
    while isinstance(type_, lang.ArrayType):
        type_ = type_.element
    return names.enumerations[type_.name] if isinstance(type_, lang.EnumType) else ""


def loaded(type_: lang.Type, stored: str, names: Names) -> str:
    """Return a stored value as an argument of a function."""
    cast = f"({names.enumerations[type_.name]})" if isinstance(type_, lang.EnumType) else ""
    return f"{cast}{stored}"


def computed(*types: lang.IntType) -> str | None:
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


def wrapping(type_: lang.IntType) -> str:
    """Return the C type of wrapping arithmetic: exactly as wide as its results."""
    return next(text for text, t in COMPUTED.items() if (t.lo, t.hi) == (type_.lo, type_.hi))


def interval(type_: lang.Type | None) -> lang.IntType:
    """Return the range of the integers that represent a discrete type."""
    found = (0, 65535) if isinstance(type_, lang.SymbolType) else integer_bounds(type_)
    assert found is not None  # noqa: S101  (discrete)
    return lang.IntType(*found)


SUFFIX = {"int": "i32", "int32_t": "i32", "int64_t": "i64", "uint32_t": "u32", "uint64_t": "u64"}
UNSIGNED = {
    "int": "uint32_t",
    "int32_t": "uint32_t",
    "uint32_t": "uint32_t",
    "int64_t": "uint64_t",
    "uint64_t": "uint64_t",
}


def integer(value: int, ctype: str) -> str:
    """Format an integer constant in a C type for computations."""
    match ctype:
        case "int":
            return str(value)
        case "int32_t":
            return "INT32_MIN" if value == lang.INT32.lo else str(value)
        case "uint32_t":  # where int has 16 bits, `-3u` is 65533
            return f"{value}u" if value >= 0 else f"(uint32_t){value}"
        case "int64_t":
            if value == lang.INT64.lo:
                return "INT64_MIN"
            return f"INT64_C({value})" if value >= 0 else f"-INT64_C({-value})"
        case _:
            return f"UINT64_C({value})"
