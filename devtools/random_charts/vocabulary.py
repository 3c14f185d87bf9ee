"""The parts of random expressions: names, types, constants, terms with their intervals."""

from __future__ import annotations

from dataclasses import dataclass

import fsmkit.language as lang
from devtools.random_charts.choices import Choices

RESULTS = tuple(lang.MACHINE_INTEGERS[name] for name in ("int32", "uint32", "int64", "uint64"))
FAR = 2**40
"""Bound of exact intervals."""
SPANS = ("5ms", "1ms", "12ms", "1s")
"""Durations; none is 0, because an event resent without delay would keep `run` busy."""
SYMBOLS = ("idle", "busy", "late", "")
COMPARE, SUM, PRODUCT, UNARY, ATOM = range(1, 6)


@dataclass(frozen=True, slots=True)
class Named:
    """A variable, as far as a random expression needs to know it."""

    name: str
    type: lang.Type
    writable: bool = True
    is_exact: bool = True
    """Whether that is its type, and not only as wide as that."""


@dataclass(frozen=True, slots=True)
class Operation:
    """An operation of the host, declared by the random chart."""

    name: str
    parameters: tuple[lang.Field, ...]
    result: lang.Type | None


@dataclass(frozen=True, slots=True)
class Names:
    """The names that an expression can use."""

    variables: tuple[Named, ...] = ()
    states: tuple[str, ...] = ()
    operations: tuple[Operation, ...] = ()
    constants: tuple[tuple[str, int], ...] = ()
    functions: tuple[Operation, ...] = ()
    """Functions of the chart; where there are some, expressions convert, too."""
    fields: tuple[lang.Field, ...] = ()
    """Fields of the current event, if any."""

    def of(self, kind: type[lang.Type], *, writable: bool = False) -> tuple[Named, ...]:
        """Return the variables of a kind of type."""
        return tuple(
            v for v in self.variables if isinstance(v.type, kind) and (v.writable or not writable)
        )


@dataclass(frozen=True, slots=True)
class Term:
    """Text of an integer expression, how tightly it binds, and an enclosing interval."""

    text: str
    type: lang.IntType
    binds: int = ATOM

    def at(self, binds: int) -> str:
        """Return the text, in parentheses unless it binds that tightly."""
        return self.text if self.binds >= binds else f"({self.text})"


def literal(choices: Choices, type_: lang.Type) -> str:
    """Return a constant that lies within the type."""
    match type_:
        case lang.BoolType():
            return choices.pick(("false", "true"))
        case lang.IntType(lo, hi):
            near = 0 if lo <= 0 <= hi else lo
            kind = choices.integer(0, 9)
            if kind == 8:
                return str(hi)
            if kind == 9:
                return str(lo)
            return str(choices.integer(near, min(hi, near + 9)))
        case lang.FloatType():
            return choices.pick(("0.0", "1.0", "0.5", "2.25", "-1.5", "100.125"))
        case lang.EnumType(name, members):
            return f"{name}.{choices.pick(members)}"
        case lang.SymbolType():
            return f'"{choices.pick(SYMBOLS)}"'
        case lang.DurationType():
            return choices.pick(SPANS)
        case lang.ArrayType() | lang.RecordType():
            raise AssertionError(type_)


def literal_array(choices: Choices, type_: lang.ArrayType) -> str:
    """Return the start value of an array: one constant for all its elements."""
    return literal(choices, type_.element)


def exact(lo: int, hi: int) -> lang.IntType:
    """Return an exact interval."""
    return lang.IntType(lo, hi)


def hull(a: lang.IntType, b: lang.IntType) -> lang.IntType:
    """Return the least interval around two."""
    return exact(min(a.lo, b.lo), max(a.hi, b.hi))


def is_machine(term: Term) -> bool:
    """Whether arithmetic on a term wraps around."""
    return term.type.overflow is lang.Overflow.WRAP and term.type.is_machine


def common(a: lang.IntType, b: lang.IntType) -> lang.IntType | None:
    """Return the type for arithmetic on two machine integers, or None."""
    whole = hull(a, b)
    return next((t for t in RESULTS if t.lo <= whole.lo and whole.hi <= t.hi), None)


def near(type_: lang.IntType) -> bool:
    """Whether an exact interval stays far from the bounds of int64."""
    return type_.lo >= -FAR and type_.hi <= FAR
