"""Types of messages of ROS 2, and the fields that hold a type of the action language.

Names follow the rules of ROS 2 for interfaces (https://docs.ros.org, "About ROS 2 interfaces"): a
package is lower case, a message CamelCase, a field lower case with single underscores, a constant
upper case.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from fsmkit.emit import Identifier, plain
from fsmkit.emit.c import WORDS
from fsmkit.language import BoolType, DurationType, EnumType, FloatType, IntType, Type
from fsmkit.language.conversion import integer_bounds

INTEGERS = {
    "uint8": (0, 2**8 - 1),
    "int8": (-(2**7), 2**7 - 1),
    "uint16": (0, 2**16 - 1),
    "int16": (-(2**15), 2**15 - 1),
    "uint32": (0, 2**32 - 1),
    "int32": (-(2**31), 2**31 - 1),
    "uint64": (0, 2**64 - 1),
    "int64": (-(2**63), 2**63 - 1),
}
"""Their ranges, by size, then without a sign first."""
DURATION = "builtin_interfaces/Duration"
"""The type of a field with a span of time: ``int32 sec``, ``uint32 nanosec``."""
COUNTERS = ("session", "sequence", "events")
"""The first fields of each message that is generated for an event; each is ``uint32``."""


@dataclass(frozen=True, slots=True)
class RosField:
    """A field. ``type``: a primitive one of ROS, or `DURATION`; ``constants``: of the message."""

    name: Identifier
    type: str
    constants: tuple[tuple[Identifier, int], ...] = ()


@dataclass(frozen=True, slots=True)
class RosType:
    """A type of messages."""

    package: str
    name: str
    fields: tuple[RosField, ...]

    def __str__(self) -> str:
        return f"{self.package}/msg/{self.name}"

    @property
    def is_counted(self) -> bool:
        """Whether it starts with `COUNTERS`."""
        return tuple(field.name for field in self.fields[: len(COUNTERS)]) == COUNTERS


def _standard() -> dict[str, RosType]:
    primitives = {"Bool": "bool", "Float32": "float32", "Float64": "float64", "String": "string"}
    primitives |= {name.replace("uint", "UInt").replace("int", "Int"): name for name in INTEGERS}
    data = Identifier("data")
    found = [RosType("std_msgs", name, (RosField(data, p),)) for name, p in primitives.items()]
    times = RosField(Identifier("sec"), "int32"), RosField(Identifier("nanosec"), "uint32")
    found += [RosType("std_msgs", "Empty", ()), RosType("builtin_interfaces", "Duration", times)]
    return {str(each): each for each in found}


STANDARD = _standard()
"""The types of ROS that connections can be bound to, in the notation of ROS."""
STRING = STANDARD["std_msgs/msg/String"]
DURATION_TYPE = STANDARD["builtin_interfaces/msg/Duration"]


def smallest(type_: Type) -> str:
    """Return the smallest primitive type of ROS that holds a type, or `DURATION`."""
    match type_:
        case BoolType():
            return "bool"
        case FloatType(bits):
            return f"float{bits}"
        case DurationType():
            return DURATION
        case _:
            return next(name for name in INTEGERS if holds(name, type_))


def holds(primitive: str, type_: Type) -> bool:
    """Whether a field of a primitive type represents all values of a type unchanged."""
    match type_:
        case BoolType():
            return primitive == "bool"
        case FloatType(bits):
            return primitive in ("float64", f"float{bits}")
        case DurationType():
            return primitive == DURATION
        case IntType() | EnumType():
            span = integer_bounds(type_)
            lo, hi = INTEGERS.get(primitive, (0, -1))
            return span is not None and lo <= span[0] and span[1] <= hi
        case _:
            return False


def level_type(type_: Type) -> RosType:
    """Return the smallest message of ``std_msgs`` that holds a type, or that of a duration."""
    primitive = smallest(type_)
    if primitive == DURATION:
        return DURATION_TYPE
    return next(
        each
        for each in STANDARD.values()
        if each.package == "std_msgs" and [field.type for field in each.fields] == [primitive]
    )


# --- names -------------------------------------------------------------------------------------


def words_of(name: str) -> list[str]:
    """Return the words of a name, of ASCII letters and digits: ``FeederBelt`` has two."""
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", plain(name))
    return re.findall(r"[A-Za-z0-9]+", spaced)


def package_name(system: str) -> Identifier:
    """Return the name of the package with the messages of a system."""
    return Identifier("_".join(["fsmkit", *words_of(system)]).lower())


def camel(*names: str) -> Identifier:
    """Return the name of a message: the words of some names, each with a capital."""
    found = "".join(word[0].upper() + word[1:] for name in names for word in words_of(name))
    return Identifier(found if found[:1].isalpha() else f"M{found}")


def lower(name: str) -> Identifier:
    """Return the name of a field, or of a part of a topic."""
    found = "_".join(words_of(name)).lower()
    return Identifier(found if found[:1].isalpha() else f"f{found}")


def unique(preferred: str, taken: set[str]) -> Identifier:
    """Return a name, with a number if it is taken, and take it."""
    found, number = preferred, 1
    while found in taken:
        number += 1
        found = f"{preferred}{number}" if preferred[:1].isupper() else f"{preferred}_{number}"
    taken.add(found)
    return Identifier(found)


TAKEN = ("serialize", "serialize_key", "deserialize", "deserialize_key", "sample_info")
"""Attributes of objects of Cyclone DDS beside the fields of a message."""


def event_type(
    package: Identifier, name: Identifier, fields: Iterable[tuple[str, Type]]
) -> tuple[RosType, tuple[Identifier, ...]]:
    """Return the message of an event, and the names that its fields have there."""
    taken = {*COUNTERS, *TAKEN, *WORDS}  # ROS makes members of structs in C and C++ of fields
    constants: set[str] = set()
    found = [RosField(Identifier(counter), "uint32") for counter in COUNTERS]
    names = []
    for preferred, type_ in fields:
        own = unique(lower(preferred), taken)
        members = (
            zip(type_.members, type_.numbers, strict=True) if isinstance(type_, EnumType) else ()
        )
        values = tuple(
            (unique(f"{own}_{'_'.join(words_of(member))}".upper(), constants), value)
            for member, value in members
        )
        found.append(RosField(own, smallest(type_), values))
        names.append(own)
    return RosType(package, name, tuple(found)), tuple(names)
