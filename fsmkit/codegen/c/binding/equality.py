"""Declarations that compile only if the host's headers have the values of the chart."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.codegen.c.names import Names
from fsmkit.codegen.existing_c.model import Bound
from fsmkit.emit import legal, plain
from fsmkit.language import EnumType, Literal

GREATEST_SIGNED = 2**63 - 1


def equalities(names: Names) -> Iterator[str]:
    """Yield a declaration for each bound constant and each member of a bound enumeration."""
    binding = names.options.binding
    if binding is None:
        return
    literals = {plain(name): literal for name, literal in names.chart.constants}
    for name, bound in binding.constants.items():
        yield _equality(f"{names.prefix}_{legal(name)}", bound, _number(literals[name]))
    for type_ in names.chart.types:
        if not isinstance(type_, EnumType):
            continue
        bound_type = binding.types.get(plain(type_.name))
        if bound_type is None:
            continue
        for number, member in zip(type_.numbers, map(plain, type_.members), strict=True):
            name = f"{names.prefix}_{legal(type_.name)}_{legal(member)}"
            yield _equality(name, bound_type.members[member], number)


def _number(literal: Literal) -> int:
    assert isinstance(literal.value, int)  # noqa: S101  (checked with the binding)
    return int(literal.value)


def _equality(name: str, bound: Bound, value: int) -> str:
    """Return an array type whose length is negative if an expression has another value.

    The sign is compared separately: 4294967295u and -1 are equal in C (C99 6.3.1.8).
    """
    text = f"({bound.expression.replaced({})})"
    test = f"{text} == ({literal(value)})"
    if value > 0:
        test = f"{test} && {text} > 0"
    elif value < 0:
        test = f"{test} && !({text} > 0)"
    called = f"{name}_is_{'minus_' if value < 0 else ''}{abs(value)}"
    return f"typedef char {called}[{test} ? 1 : -1];"


def literal(value: int) -> str:
    """Format an integer constant of the narrowest type that holds it (C99 6.4.4.1)."""
    if value == -GREATEST_SIGNED - 1:
        return f"-{GREATEST_SIGNED} - 1"
    return f"{value}u" if value > GREATEST_SIGNED else str(value)
