"""Values of the data language in scripts, in Python and in output.

An enumeration is a number inside and the name of its member outside; a duration is ticks inside.
Every function raises `ValueError` for an invalid value, with a message that fits after a name.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from typing import assert_never

from fsmkit.emit import telling
from fsmkit.language import (
    LONGEST_DURATION,
    ArrayType,
    BoolType,
    DurationType,
    EnumType,
    FloatType,
    IntType,
    RecordType,
    SymbolType,
    Type,
    Value,
)
from fsmkit.language.units import duration_text, read_microseconds

BOOLS = {"0": False, "1": True, "false": False, "true": True, "False": False, "True": True}
TOKENS = re.compile(r'"[^"]*"|[\[\],]|[^\s\[\],"]+')


def tokens(text: str) -> list[str]:
    """Split a text into words, quoted symbols and brackets; commas are white space."""
    return [word for word in TOKENS.findall(text) if word != ","]


def read_value(words: Iterator[str], type_: Type, tick: int) -> Value:
    """Consume one value of a type from words (see `tokens`); ``tick`` is in microseconds."""
    word = next(words, None)
    if word is None:
        raise ValueError(f"needs a value of type `{type_}`")
    if isinstance(type_, ArrayType | RecordType):
        if word != "[":
            raise ValueError(f"is `{type_}`: write its values as `[ ... ]`")
        parts = tuple(read_value(words, part, tick) for part in part_types(type_))
        if next(words, None) != "]":
            raise ValueError(f"is `{type_}`, which holds {len(parts)} values between `[` and `]`")
        return parts
    return _read_scalar(word, type_, tick)


def _read_scalar(word: str, type_: Type, tick: int) -> Value:
    match type_:
        case BoolType():
            if word not in BOOLS:
                raise ValueError(f"is a bool: `{word}` is neither `true` nor `false`")
            return BOOLS[word]
        case IntType() | FloatType():
            try:
                return from_python(
                    int(word, 0) if isinstance(type_, IntType) else float(word), type_
                )
            except ValueError as error:
                if "invalid literal" in str(error) or "could not convert" in str(error):
                    raise ValueError(f"is `{type_}`: `{word}` is not a valid number") from error
                raise
        case EnumType(name):
            if word.removeprefix("-").isdecimal():
                return from_python(int(word), type_)
            return from_python(word.removeprefix(f"{name}."), type_)
        case DurationType():
            if word.isdecimal():
                return int(word)
            return from_python(_ticks(word, tick), type_)
        case SymbolType():
            return word.strip('"')
        case ArrayType() | RecordType():
            raise ValueError(f"is `{type_}`")
        case _:
            assert_never(type_)


def _ticks(word: str, tick: int) -> int:
    microseconds = read_microseconds(word)
    if microseconds % tick:
        raise ValueError(f"is not a whole number of ticks of {duration_text(tick)}: `{word}`")
    return microseconds // tick


def from_python(value: object, type_: Type) -> Value:
    """Return the value that a Python object represents."""
    match type_:
        case BoolType():
            if isinstance(value, bool) or (isinstance(value, int) and value in (0, 1)):
                return bool(value)
        case IntType():
            if isinstance(value, int):
                if value not in type_:
                    raise ValueError(f"is outside `{type_.lo}..{type_.hi}`: {int(value)}")
                return int(value)
        case FloatType():
            if isinstance(value, int | float):
                return float(value)
        case EnumType(_, members):
            name = value.name if isinstance(value, Enum) else value
            if name in members:
                return type_.number(str(name))
            if isinstance(value, int) and value in type_.numbers:
                return int(value)
            raise ValueError(f"is not a member of `{type_}` ({', '.join(members)}): {value!r}")
        case SymbolType():
            if isinstance(value, str):
                return value
        case DurationType():
            if isinstance(value, int) and 0 <= value <= LONGEST_DURATION:
                return int(value)
        case ArrayType() | RecordType():
            return _composite(value, type_)
        case _:
            assert_never(type_)
    raise ValueError(f"is not a value of `{type_}`: {value!r}")


def _composite(value: object, type_: ArrayType | RecordType) -> Value:
    types = part_types(type_)
    if isinstance(type_, RecordType) and isinstance(value, Mapping):
        names = [field.name for field in type_.fields]
        if set(names) != set(value):
            raise ValueError(f"is `{type_}`, whose fields are {', '.join(names)}")
        value = [value[name] for name in names]
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != len(types):
        raise ValueError(f"is `{type_}`, a sequence of {len(types)} values: {value!r}")
    return tuple(from_python(part, of) for part, of in zip(value, types, strict=True))


def to_python(value: Value, type_: Type) -> object:
    """Return a value as a Python object: enumerations by name, arrays as lists, records as dict."""
    match type_, value:
        case EnumType(), int():
            return type_.member(value)
        case ArrayType(element), tuple():
            return [to_python(part, element) for part in value]
        case RecordType(_, fields), tuple():
            return {
                field.name: to_python(part, field.type)
                for field, part in zip(fields, value, strict=True)
            }
        case _:
            return value


@telling
def show(value: Value, type_: Type, tick: int = 1000) -> str:
    """Format a value for display."""
    match type_, value:
        case EnumType(), int():
            return type_.member(value)
        case BoolType(), _:
            return "true" if value else "false"
        case DurationType(), int():
            return duration_text(value * tick)
        case ((ArrayType() | RecordType()), tuple()):
            parts = zip(value, part_types(type_), strict=True)
            return f"[{' '.join(show(part, of, tick) for part, of in parts)}]"
        case SymbolType(), _:
            return f'"{value}"'
        case _:
            return str(value)


def part_types(type_: ArrayType | RecordType) -> tuple[Type, ...]:
    """Return the types of the parts of a composite type, in order."""
    match type_:
        case ArrayType(element, length):
            return (element,) * length
        case RecordType(_, fields):
            return tuple(field.type for field in fields)
        case _:
            assert_never(type_)
