"""Definitions of messages: ``.msg`` of ROS, ``.idl`` of DDS with the names of ROS.

In DDS, a message ``a/msg/B`` is the final struct ``a::msg::dds_::B_``. Its members have the names
of the fields: identifiers of types (DDS-XTypes 1.3, 7.3.1.2) are then those of ``rmw_fastrtps``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from fsmkit.carriers.ros.messages import DURATION, DURATION_TYPE, RosField, RosType
from fsmkit.emit import Emitter

EMPTY = "structure_needs_at_least_one_member"
"""The member, of type ``uint8``, of a message without fields: no struct of DDS is empty."""
IDL = {
    "bool": "boolean",
    "uint8": "uint8",
    "int8": "int8",
    "uint16": "unsigned short",
    "int16": "short",
    "uint32": "unsigned long",
    "int32": "long",
    "uint64": "unsigned long long",
    "int64": "long long",
    "float32": "float",
    "float64": "double",
    "string": "string",
    DURATION: "builtin_interfaces::msg::dds_::Duration_",
}


_WORDS = """
    abstract any alias attribute bitfield bitmask bitset boolean case char component
    connector const consumes context custom default double emits enum eventtype exception
    factory finder fixed float getraises home import in inout interface int8 int16 int32
    int64 local long manages map mirrorport module multiple native object octet oneway out
    port porttype primarykey private provides public publishes raises readonly sequence
    setraises short string struct supports switch true false truncatable typedef typeid
    typename typeprefix uint8 uint16 uint32 uint64 union unsigned uses valuebase valuetype
    void wchar wstring
    """
KEYWORDS = frozenset(_WORDS.split())
"""Of IDL 4.2 (7.2.4), in lower case: none differs from an identifier by case alone."""


def escaped(name: str) -> str:
    """Return an identifier of IDL; ``_`` before a keyword is no part of the name (7.2.3.2)."""
    return f"_{name}" if name.lower() in KEYWORDS else name


def msg_of(type_: RosType, notice: str) -> str:
    """Return the text of ``<name>.msg``."""
    out = Emitter()
    out.line(f"# {notice}")
    out.lines(_rows(type_.fields))
    return out.finish()


def srv_of(request: Iterable[RosField], value: RosField, notice: str) -> str:
    """Return the text of ``<name>.srv``: the response is ``handled`` and a value."""
    out = Emitter()
    out.line(f"# {notice}")
    out.lines([*_rows(request), "---", "bool handled", *_rows([value])])
    return out.finish()


def _rows(fields: Iterable[RosField]) -> Iterator[str]:
    for field in fields:
        for name, value in field.constants:
            yield f"{field.type} {name}={value}"
        yield f"{field.type} {field.name}"


def idl_file(type_: RosType) -> str:
    """Return the name of the file with the definition in DDS."""
    return f"{type_.package}_{type_.name}_.idl"


def idl_of(type_: RosType, notice: str) -> str:
    """Return the text of `idl_file`, for compilers of IDL 4.2 such as ``idlc``."""
    out = Emitter()
    out.line(f"// {notice}")
    guard = f"{type_.package}_{type_.name}_IDL".upper()
    out.lines([f"#ifndef {guard}", f"#define {guard}", ""])
    if any(field.type == DURATION for field in type_.fields):
        out.lines([f'#include "{idl_file(DURATION_TYPE)}"', ""])
    with (
        out.block(f"module {type_.package} {{", "};"),
        out.block("module msg {", "};"),
        out.block("module dds_ {", "};"),
    ):
        constants = [(field.type, *each) for field in type_.fields for each in field.constants]
        if constants:
            with out.block(f"module {type_.name}_Constants {{", "};"):
                for primitive, name, value in constants:
                    out.line(f"const {IDL[primitive]} {name} = {value};")
        out.line("@final")
        with out.block(f"struct {type_.name}_ {{", "};"):
            members: list[tuple[str, str]] = [(IDL[f.type], f.name) for f in type_.fields]
            for primitive, member in members or [(IDL["uint8"], EMPTY)]:
                out.line(f"{primitive} {escaped(member)};")
    out.lines(["", "#endif"])
    return out.finish()


def with_nested(types: Iterable[RosType]) -> tuple[RosType, ...]:
    """Return types once, with the types of their fields."""
    found = dict.fromkeys(types)
    if any(field.type == DURATION for each in found for field in each.fields):
        found[DURATION_TYPE] = None
    return tuple(found)
