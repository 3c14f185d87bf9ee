"""What a header declares, as far as a binding can use it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Sort(Enum):
    """The sorts of types whose values a binding hands over."""

    INTEGER = "integer"
    FLOAT = "float"
    BOOL = "bool"
    ENUM = "enum"
    NOTHING = "void"
    OTHER = "other"
    """A pointer, a union, a struct: nothing that one number is."""


@dataclass(frozen=True, slots=True)
class CType:
    """A type: its spelling, and the bounds of an integer's values."""

    spelling: str
    sort: Sort
    lo: int = 0
    hi: int = 0

    @property
    def is_number(self) -> bool:
        """Whether a value is one number."""
        return self.sort not in (Sort.NOTHING, Sort.OTHER)


@dataclass(frozen=True, slots=True)
class Constant:
    """A macro or an enumerator that is a whole number. ``type``: as C has it."""

    name: str
    value: int
    type: str
    is_own: bool
    """Whether the header itself has it, not one that it includes."""


@dataclass(frozen=True, slots=True)
class Enumeration:
    """An enumeration: how it is called in C, and its constants."""

    name: str
    constants: tuple[Constant, ...]
    is_own: bool


@dataclass(frozen=True, slots=True)
class Member:
    """A member of a struct: ``count`` elements if it is an array, 0 if it is none."""

    name: str
    type: CType
    count: int = 0


@dataclass(frozen=True, slots=True)
class Struct:
    """A struct. ``refused``: why it is not offered, "" if it is."""

    name: str
    members: tuple[Member, ...]
    refused: str
    is_own: bool


@dataclass(frozen=True, slots=True)
class Function:
    """A function, or a variable that is read and written by its name."""

    name: str
    result: CType
    parameters: tuple[CType, ...]
    is_variable: bool
    is_own: bool
    is_constant: bool = False


@dataclass(frozen=True, slots=True)
class Header:
    """A header with all that it includes."""

    name: str
    constants: tuple[Constant, ...]
    enumerations: tuple[Enumeration, ...]
    structs: tuple[Struct, ...]
    functions: tuple[Function, ...]
    macros: int
    """How many macros there are, whether they are numbers or not."""
