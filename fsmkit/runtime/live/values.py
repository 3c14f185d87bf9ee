"""Values as the protocol writes them in JSON, and as a client gives them."""

from __future__ import annotations

import math
from typing import Any

from fsmkit.language import ArrayType, EnumType, IntType, RecordType, Type, Value
from fsmkit.language.values import from_python, part_types

SAFE = 2**53
"""Beyond, a number of JavaScript is not exact: such an integer is written as ``{"int": "..."}``."""


def to_json(value: Value, type_: Type | None = None) -> Any:
    """Return a value for JSON: members of enumerations by name, records as objects.

    Durations are ticks. Integers from 2^53 on and floats that are no numbers, which JSON cannot
    hold, are written in words. Without a type members are numbers and records lists.
    """
    match type_, value:
        case EnumType(), int():
            return type_.member(value)
        case RecordType(_, fields), tuple():
            parts = zip(fields, value, strict=True)
            return {field.name: to_json(part, field.type) for field, part in parts}
        case ArrayType(element), tuple():
            return [to_json(part, element) for part in value]
        case _, tuple():
            return [to_json(part) for part in value]
        case _, bool():
            return value
        case _, int() if not -SAFE < value < SAFE:
            return {"int": str(value)}
        case _, float() if not math.isfinite(value):
            return {"float": str(value)}
        case _:
            return value


def from_json(found: Any, type_: Type) -> Value:
    """Return the value of type `type_`; raises `ValueError` with the reason if there is none."""
    match type_, found:
        case IntType(), {"int": str(digits)} if len(found) == 1 and len(digits) < 30:
            return from_python(int(digits), type_)
        case RecordType(_, fields), dict():
            names = {field.name for field in fields}
            if set(found) != names:
                raise ValueError(f"is `{type_}`, whose fields are {', '.join(sorted(names))}")
            return tuple(from_json(found[field.name], field.type) for field in fields)
        case ((ArrayType() | RecordType()), list()):
            types = part_types(type_)
            if len(found) != len(types):
                raise ValueError(f"is `{type_}`, a sequence of {len(types)} values")
            return tuple(from_json(part, of) for part, of in zip(found, types, strict=True))
        case _, {"float": "nan" | "inf" | "-inf" as word} if len(found) == 1:
            return from_python(float(word), type_)
        case _:
            return from_python(found, type_)
