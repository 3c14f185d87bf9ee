"""Types of messages of ROS as structs of Cyclone DDS."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from cyclonedds.idl import IdlStruct, make_idl_struct, types

from fsmkit.carriers.ros.definitions import EMPTY
from fsmkit.carriers.ros.messages import DURATION, DURATION_TYPE, RosType

PRIMITIVES: dict[str, Any] = {
    "bool": bool,
    "uint8": types.uint8,
    "int8": types.int8,
    "uint16": types.uint16,
    "int16": types.int16,
    "uint32": types.uint32,
    "int32": types.int32,
    "uint64": types.uint64,
    "int64": types.int64,
    "float32": types.float32,
    "float64": types.float64,
    "string": str,
}
"""The type by which Cyclone DDS packs a primitive type."""
ZERO: dict[str, Any] = {"bool": False, "float32": 0.0, "float64": 0.0, "string": ""}
"""The value of a field that carries nothing, if it is not 0."""


def _fill(message: Any, **values: Any) -> None:
    """Build a message; unlike in a dataclass, fields may have names that are words of Python."""
    message.__dict__.update(values)


@cache
def struct_of(type_: RosType) -> type[IdlStruct]:
    """Return the struct with the name that ROS gives to a type in DDS."""
    members: dict[str, Any] = {
        field.name: struct_of(DURATION_TYPE) if field.type == DURATION else PRIMITIVES[field.type]
        for field in type_.fields
    }
    name = f"{type_.name}_"
    full = f"{type_.package}.msg.dds_.{name}"
    made: type[IdlStruct] = make_idl_struct(
        name, full, members or {EMPTY: types.uint8}, dataclassify=False
    )
    type.__setattr__(made, "__init__", _fill)
    return made


def message_of(type_: RosType, values: Mapping[str, Any]) -> Any:
    """Return a message with values for all of its fields."""
    made: Any = struct_of(type_)
    return made(**values)


def zeros_of(type_: RosType) -> dict[str, Any]:
    """Return a value for each member: 0, false, an empty text."""
    if not type_.fields:
        return {EMPTY: 0}
    return {
        field.name: duration_of(0, 1) if field.type == DURATION else ZERO.get(field.type, 0)
        for field in type_.fields
    }


def duration_of(ticks: int, tick: int) -> Any:
    """Return a ``builtin_interfaces/Duration``; ``tick``: in microseconds."""
    seconds, rest = divmod(ticks * tick, 1_000_000)
    return message_of(DURATION_TYPE, {"sec": seconds, "nanosec": rest * 1000})


def ticks_of(duration: Any, tick: int) -> int:
    """Return the whole ticks in a ``builtin_interfaces/Duration``."""
    ns: int = duration.sec * 1_000_000_000 + duration.nanosec
    return ns // (tick * 1000)
