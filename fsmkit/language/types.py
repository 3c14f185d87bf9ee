"""The types of the data language. Every type is bounded, so that a machine never allocates."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.emit import guard


class Overflow(Enum):
    """The effect of storing a value outside the bounds of an integer type."""

    SATURATE = "saturate"
    """The nearest bound is stored and ``error.range`` is raised."""
    WRAP = "wrap"
    """The value is taken modulo the size of the range; nothing is raised."""
    FAULT = "fault"
    """The machine stops with a reported fault."""
    NEAREST = "nearest"
    """The nearest bound is the value and nothing is raised. For conversions, not for variables."""


@dataclass(frozen=True, slots=True)
class BoolType:
    """``true`` and ``false``."""

    def __str__(self) -> str:
        return "bool"


@fast_init
@dataclass(frozen=True, slots=True)
class IntType:
    """The integers ``lo..hi``, both included, within the union of int64 and uint64.

    ``int8 ... uint64`` are the ranges of the machine integers with `Overflow.WRAP`. As the type of
    an expression, a wrapping type is one of int32, uint32, int64, uint64, and the result is reduced
    to it. Any other type is the exact interval of the possible results.
    """

    lo: int
    hi: int
    overflow: Overflow = Overflow.SATURATE

    @property
    def is_machine(self) -> bool:
        """Return whether this is one of int8 ... uint64."""
        return self in MACHINE_NAMES

    def __contains__(self, value: int) -> bool:
        return self.lo <= value <= self.hi

    def __str__(self) -> str:
        if self in MACHINE_NAMES:
            return MACHINE_NAMES[self]
        is_plain = self.overflow in (Overflow.SATURATE, Overflow.NEAREST)
        suffix = "" if is_plain else f" {self.overflow.value}"
        return f"{self.lo}..{self.hi}{suffix}"


@dataclass(frozen=True, slots=True)
class FloatType:
    """IEEE 754 binary32 or binary64. Arithmetic is binary64; binary32 rounds when stored."""

    bits: int = 64

    def __str__(self) -> str:
        return f"float{self.bits}"


@dataclass(frozen=True, slots=True)
class EnumType:
    """A declared enumeration. A value is the number of its member.

    Without ``numbers`` the members count from 0, as those of a C enumeration do.
    """

    name: str
    members: tuple[str, ...]
    numbers: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if not self.numbers:
            object.__setattr__(self, "numbers", tuple(range(len(self.members))))
        guard(self, "name", "members")

    @property
    def bounds(self) -> tuple[int, int]:
        """The least and the greatest number; some numbers between them may have no member."""
        return min(self.numbers), max(self.numbers)

    @property
    def is_counted(self) -> bool:
        """Return whether the members count from 0, so that a number is the index of its member."""
        return self.numbers == tuple(range(len(self.members)))

    def number(self, member: str) -> int:
        """Return the number of a member; `ValueError` if it is unknown."""
        return self.numbers[self.members.index(member)]

    def member(self, number: int) -> str:
        """Return the member with a number; `ValueError` if it is unknown."""
        return self.members[self.numbers.index(number)]

    def __str__(self) -> str:
        return self.name

    def __format__(self, spec: str) -> str:
        return format(self.name, spec)


@dataclass(frozen=True, slots=True)
class SymbolType:
    """A string known at compile time. Only equality and assignment apply."""

    def __str__(self) -> str:
        return "symbol"


@dataclass(frozen=True, slots=True)
class DurationType:
    """A span of time, in whole ticks of the chart, 0 to `LONGEST_DURATION`."""

    def __str__(self) -> str:
        return "duration"


@dataclass(frozen=True, slots=True)
class ArrayType:
    """``length`` elements of one scalar type."""

    element: Type
    length: int

    def __str__(self) -> str:
        return f"{self.element}[{self.length}]"


@dataclass(frozen=True, slots=True)
class Field:
    """A named, typed part of a record, a payload or a list of parameters."""

    name: str
    type: Type

    def __post_init__(self) -> None:
        guard(self, "name")


@dataclass(frozen=True, slots=True)
class RecordType:
    """A declared record. A value is the tuple of its fields."""

    name: str
    fields: tuple[Field, ...] = field(default=())

    def __post_init__(self) -> None:
        guard(self, "name")

    def __str__(self) -> str:
        return self.name

    def __format__(self, spec: str) -> str:
        return format(self.name, spec)


Type = (
    BoolType | IntType | FloatType | EnumType | SymbolType | DurationType | ArrayType | RecordType
)

Value = bool | int | float | str | tuple["Value", ...]
"""A value at run time: enumerations are numbers, durations ticks, arrays and records tuples."""

BOOL = BoolType()
INT8, INT16, INT32, INT64 = (
    IntType(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1, Overflow.WRAP) for bits in (8, 16, 32, 64)
)
UINT8, UINT16, UINT32, UINT64 = (IntType(0, 2**bits - 1, Overflow.WRAP) for bits in (8, 16, 32, 64))
FLOAT32, FLOAT64 = FloatType(32), FloatType(64)
SYMBOL = SymbolType()
DURATION = DurationType()
CLOCK_MARGIN = 2**27
"""A 32-bit clock may go back, or a machine may run late, by at least this many ticks."""
LONGEST_DURATION = 2**31 - 1 - CLOCK_MARGIN
"""In ticks. With the margin it is less than half the range of a 32-bit clock."""

MACHINE_INTEGERS = {
    "int8": INT8,
    "int16": INT16,
    "int32": INT32,
    "int64": INT64,
    "uint8": UINT8,
    "uint16": UINT16,
    "uint32": UINT32,
    "uint64": UINT64,
}
MACHINE_NAMES = {type_: name for name, type_ in MACHINE_INTEGERS.items()}
