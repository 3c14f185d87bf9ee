"""The layout of values in the payload of a frame, in C: offsets, writing, reading, checks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from struct import calcsize

from fsmkit.codegen.c.storage import storage
from fsmkit.language import BoolType, EnumType, FloatType, Type
from fsmkit.runtime.links.codec import INTEGERS, bounds, code_of

RANGES = {code: (lo, hi) for code, lo, hi in INTEGERS}


def _size(type_: Type) -> int:
    return calcsize("<" + code_of(type_))


def size_of(types: Iterable[Type]) -> int:
    """Return the size in bytes of values of these types."""
    return sum(map(_size, types))


def places(types: Sequence[Type]) -> list[int]:
    """Return the offset of each value."""
    return [size_of(types[:place]) for place in range(len(types))]


def putter(type_: Type, at: int, value: str) -> str:
    """Return the statement that writes a value."""
    if isinstance(type_, FloatType):
        return f"fsm_link_put_{_c_float(type_)}(p + {at}, {value});"
    return f"fsm_link_put_bytes(p + {at}, (uint64_t){value}, {_size(type_)}u);"


def getter(sent: Type, stored: Type, at: int) -> str:
    """Return the expression that reads a value in the receiver's stored type."""
    into = storage(stored, {}).text
    if isinstance(sent, FloatType):
        return f"({into})fsm_link_get_{_c_float(sent)}(p + {at})"
    if isinstance(stored, BoolType):
        return f"p[{at}] != 0u"
    return f"({into}){_read(sent, at)}"


def checks(types: Sequence[Type]) -> list[str]:
    """Return the conditions that all values are within their types."""
    found = []
    for type_, at in zip(types, places(types), strict=True):
        span = bounds(type_)
        if span is None:
            continue
        lo, hi = RANGES[code_of(type_)]
        read = _read(type_, at)
        if isinstance(type_, EnumType) and not type_.is_counted:
            found.append(f"({' || '.join(f'{read} == {_number(n, lo)}' for n in type_.numbers)})")
            continue
        if span[0] > lo:
            found.append(f"{read} >= {_number(span[0], lo)}")
        if span[1] < hi:
            found.append(f"{read} <= {_number(span[1], lo)}")
    return found


def _read(type_: Type, at: int) -> str:
    is_signed = RANGES[code_of(type_)][0] < 0
    return f"fsm_link_get_{'signed' if is_signed else 'bytes'}(p + {at}, {_size(type_)}u)"


def _number(value: int, lo: int) -> str:
    """Return a bound in C notation; the least integer has no literal (C99 6.4.4.1)."""
    if lo == 0:
        return f"UINT64_C({value})"
    return f"INT64_C({value})" if value > -(2**63) else "INT64_MIN"


def _c_float(type_: FloatType) -> str:
    return "float" if type_.bits == 32 else "double"
