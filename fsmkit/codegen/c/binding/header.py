"""The bound part of a machine's header: its enumerations are those of the host.

With ``FSM_UNBOUND`` defined, the machine declares its own enumerations. It then compiles without
the host's headers. The source of the machine is the same text in both cases.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from fsmkit.codegen.existing_c.model import BoundType, Exports
from fsmkit.emit import Emitter, plain
from fsmkit.language import EnumType

if TYPE_CHECKING:
    from fsmkit.codegen.c.names import Names

SMALLEST_INT = range(-32767, 32768)
"""The range of an enumerator that every compiler accepts (C99 5.2.4.2.1, 6.7.2.2)."""


def bound_enumeration(names: Names, type_: EnumType) -> BoundType | None:
    """Return the host's type for an enumeration of the chart, or None if it is not bound."""
    binding = names.options.binding
    return None if binding is None else binding.types.get(plain(type_.name))


def print_includes(out: Emitter, names: Names) -> None:
    """Print the includes of the host's headers, if the machine's header needs their declarations.

    They precede the include guard. One of them may embed the machine and therefore include this
    header recursively. The machine is declared in that case, too.
    """
    binding = names.options.binding
    enumerations = [type_ for type_ in names.chart.types if isinstance(type_, EnumType)]
    if binding is None or not any(bound_enumeration(names, each) for each in enumerations):
        return
    out.line("#ifndef FSM_UNBOUND")
    out.lines(f"#include {header}" for header in binding.includes)
    out.lines(["#endif", ""])


@contextmanager
def or_bound(out: Emitter, names: Names, type_: EnumType) -> Iterator[None]:
    """Print the declaration of an unbound enumeration as the alternative to the bound one."""
    bound = bound_enumeration(names, type_)
    if bound is None:
        yield
        return
    out.line("#ifdef FSM_UNBOUND")
    yield
    out.line("#else")
    out.line(f"typedef {bound.type} {names.enumerations[type_.name]};")
    for member, macro in zip(type_.members, names.members[type_.name], strict=True):
        out.line(f"#define {macro} {bound.members[plain(member)].expression.operand({})}")
    out.line("#endif")


def exported(names: Names, macro: str, value: int) -> str:
    """Return the declaration of a constant of the chart in the form that the binding selects."""
    binding = names.options.binding
    text = str(value) if value >= 0 else f"({value})"
    if binding is None or binding.exports is not Exports.ENUM or value not in SMALLEST_INT:
        return f"#define {macro} {text}"
    return f"enum {{ {macro} = {value} }};"
