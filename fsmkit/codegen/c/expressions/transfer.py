"""Copies of values between machines, each of which has C types of its own."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.codegen.c.expressions.expressions import Printer
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.storage import storage
from fsmkit.emit import Emitter
from fsmkit.language import ArrayType, RecordType, Type, default_value


@dataclass(frozen=True, slots=True)
class Place:
    """The lvalue of a value of a type, in the names of one machine."""

    names: Names
    type: Type
    text: str


def copy(out: Emitter, source: Place, target: Place, depth: int = 0) -> None:
    """Print a copy of a value, part by part, since the C types of the parts differ."""
    match target.type:
        case ArrayType(element, length):
            assert isinstance(source.type, ArrayType)  # noqa: S101
            at = f"k{depth}"
            out.line(f"for (uint32_t {at} = 0u; {at} < {length}u; {at}++) {{")
            with out.indented():
                copy(
                    out,
                    Place(source.names, source.type.element, f"{source.text}[{at}]"),
                    Place(target.names, element, f"{target.text}[{at}]"),
                    depth + 1,
                )
            out.line("}")
        case RecordType(_, fields):
            assert isinstance(source.type, RecordType)  # noqa: S101
            for part, other in zip(fields, source.type.fields, strict=True):
                copy(
                    out,
                    Place(
                        source.names, other.type, f"{source.text}.{source.names.field(other.name)}"
                    ),
                    Place(
                        target.names, part.type, f"{target.text}.{target.names.field(part.name)}"
                    ),
                    depth,
                )
        case _:
            stored = storage(target.type, target.names.records).text
            is_same = stored == storage(source.type, source.names.records).text
            cast = "" if is_same else f"({stored})"
            out.line(f"{target.text} = {cast}{source.text};")


def put_default(out: Emitter, target: Place, depth: int = 0) -> None:
    """Print the assignment of a type's default value."""
    match target.type:
        case ArrayType(element, length):
            at = f"k{depth}"
            out.line(f"for (uint32_t {at} = 0u; {at} < {length}u; {at}++) {{")
            with out.indented():
                put_default(out, Place(target.names, element, f"{target.text}[{at}]"), depth + 1)
            out.line("}")
        case RecordType(_, fields):
            for part in fields:
                text = f"{target.text}.{target.names.field(part.name)}"
                put_default(out, Place(target.names, part.type, text), depth)
        case type_:
            printer = Printer(target.names)
            literal = printer.constant(default_value(type_), type_)
            out.line(f"{target.text} = {printer.cast(literal, literal.ctype)};")
