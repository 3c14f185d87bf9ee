"""The declarations of a header that a binding can use."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Sort(Enum):
    """The kinds of types whose values a binding can transfer."""

    INTEGER = "integer"
    FLOAT = "float"
    BOOL = "bool"
    ENUM = "enum"
    NOTHING = "void"
    OTHER = "other"
    """Any other type: a pointer, a union, a struct."""


@dataclass(frozen=True, slots=True)
class CType:
    """A type: its name, and the bounds of an integer's values."""

    spelling: str
    sort: Sort
    lo: int = 0
    hi: int = 0

    @property
    def is_number(self) -> bool:
        """Whether a value is a single number."""
        return self.sort not in (Sort.NOTHING, Sort.OTHER)


@dataclass(frozen=True, slots=True)
class Constant:
    """A macro or an enumerator with an integer value. ``type``: its C type."""

    name: str
    value: int
    type: str
    is_own: bool
    """Whether the header itself declares it, not an included one."""


@dataclass(frozen=True, slots=True)
class Enumeration:
    """An enumeration: its name in C, and its constants."""

    name: str
    constants: tuple[Constant, ...]
    is_own: bool


@dataclass(frozen=True, slots=True)
class Member:
    """A member of a struct; ``count``: the elements of an array, 0 for other members."""

    name: str
    type: CType
    count: int = 0


@dataclass(frozen=True, slots=True)
class Struct:
    """A struct. ``rejection``: why it is not offered, or ""."""

    name: str
    members: tuple[Member, ...]
    rejection: str
    is_own: bool


@dataclass(frozen=True, slots=True)
class Function:
    """A function, or a variable that is read and written by name."""

    name: str
    result: CType
    parameters: tuple[CType, ...]
    is_variable: bool
    is_own: bool
    is_constant: bool = False


@dataclass(frozen=True, slots=True)
class Header:
    """A header with all headers that it includes."""

    name: str
    constants: tuple[Constant, ...]
    enumerations: tuple[Enumeration, ...]
    structs: tuple[Struct, ...]
    functions: tuple[Function, ...]
    macros: int
    """The number of macros, including those without a number."""
