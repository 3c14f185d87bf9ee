"""The values that can come from outside: of inputs, payloads and results of operations.

A small range is enumerated. A large one is split by the constants it is compared with, which is
exact where comparisons with constants are all that is ever done with it; else samples are taken,
and a verdict cannot be HOLDS.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, fields, is_dataclass
from itertools import product
from typing import assert_never

from fsmkit.chart.chart import Chart
from fsmkit.chart.statements import Send
from fsmkit.chart.walk import charts_within
from fsmkit.diagnostics import Span
from fsmkit.language import (
    LONGEST_DURATION,
    ArrayType,
    Binary,
    BinaryOp,
    BoolType,
    Call,
    DurationType,
    EnumType,
    EventField,
    Expr,
    FloatType,
    IntType,
    Literal,
    RecordType,
    Storage,
    SymbolType,
    Type,
    Value,
    Variable,
)
from fsmkit.language.walk import nodes

ENUMERATED = 32
"""A range of at most so many values is enumerated."""
COMBINED = 4096
"""At most so many combinations are tried at one step."""

COMPARISONS = frozenset(
    {BinaryOp.EQ, BinaryOp.NE, BinaryOp.LT, BinaryOp.LE, BinaryOp.GT, BinaryOp.GE}
)

Origin = tuple[str, str]
"""``("input", name)``, ``("field", name)`` or ``("operation", name)``."""


@dataclass(frozen=True, slots=True)
class Values:
    """Values to try; ``exact``: no other value could make a difference."""

    values: tuple[Value, ...]
    exact: bool = True


@dataclass(slots=True)
class Uses:
    """How a chart uses what comes from outside."""

    constants: dict[Origin, set[int | float | str]] = field(default_factory=dict)
    """The constants each is compared with."""
    kept: set[Origin] = field(default_factory=set)
    """Those used in any other way."""
    strings: set[str] = field(default_factory=set)
    """Every string that the chart compares, assigns or sends."""


def uses_of(chart: Chart) -> Uses:
    """Return how a chart, or one that it invokes, uses inputs, payloads and results."""
    uses = Uses()
    for one in charts_within(chart):
        _walk(_all_of(one), uses)
    return uses


def _all_of(chart: Chart) -> tuple[object, ...]:
    """Return the parts of a chart in which something is evaluated."""
    finalized = tuple(event.finalize for event in chart.events)
    return chart.states, chart.transitions, chart.script, finalized


def _walk(node: object, uses: Uses) -> None:
    match node:
        case Binary(op, left, right) if op in COMPARISONS:
            for side, other in ((left, right), (right, left)):
                origin = _origin(side)
                if origin is not None and isinstance(other, Literal):
                    if not isinstance(other.value, tuple):
                        uses.constants.setdefault(origin, set()).add(other.value)
                    _walk(other, uses)
                    _walk_arguments(side, uses)
                else:
                    _walk(side, uses)
        case Variable() | EventField() | Call():
            origin = _origin(node)
            if origin is not None:
                uses.kept.add(origin)
            _walk_arguments(node, uses)
        case Literal(value=str() as text):
            uses.strings.add(text)
        case tuple():
            for part in node:
                _walk(part, uses)
        case Span() | str() | int() | float() | None:
            pass
        case _ if is_dataclass(node):
            for part in fields(node):
                _walk(getattr(node, part.name), uses)
        case _:
            pass


def _walk_arguments(node: object, uses: Uses) -> None:
    if isinstance(node, Call):
        _walk(node.arguments, uses)


def _origin(node: Expr) -> Origin | None:
    match node:
        case Variable(name, _, Storage.INPUT):
            return ("input", name)
        case EventField(name):
            return ("field", name)
        case Call(name, _, type_) if type_ is not None:
            return ("operation", name)
        case _:
            return None


def values_of(type_: Type, origin: Origin, uses: Uses) -> Values:
    """Return the values to try for something from outside."""
    constants = uses.constants.get(origin, set())
    only_compared = origin not in uses.kept
    if only_compared and not constants:
        return Values(_all_or(type_, uses)[:1])
    match type_:
        case BoolType() | EnumType():
            return Values(_all_or(type_, uses))
        case IntType(lo, hi):
            return _integers(lo, hi, constants, exact=only_compared)
        case DurationType():
            return _integers(0, LONGEST_DURATION, constants, exact=only_compared)
        case FloatType():
            return _floats(constants, exact=only_compared)
        case SymbolType():
            # one that is stored may be compared later, with whatever the chart mentions
            mentioned = uses.strings if not only_compared else {str(c) for c in constants}
            known = sorted(mentioned)
            return Values(("", *(c for c in known if c)), exact=only_compared)
        case ArrayType(element, length):
            return _combined([values_of(element, origin, uses)] * length)
        case RecordType(_, parts):
            return _combined([values_of(part.type, origin, uses) for part in parts])
        case _:
            assert_never(type_)


def payloads_of(types: tuple[tuple[Type, Origin], ...], uses: Uses) -> Values:
    """Return the combinations of values to try for several things that come together."""
    return _combined([values_of(type_, origin, uses) for type_, origin in types])


def _combined(parts: list[Values]) -> Values:
    exact = all(part.exact for part in parts)
    if math.prod(len(part.values) for part in parts) > COMBINED:
        # samples: all at their first value, and each of the others in turn
        first = tuple(part.values[0] for part in parts)
        found = [first]
        for place, part in enumerate(parts):
            found += [(*first[:place], value, *first[place + 1 :]) for value in part.values[1:]]
        return Values(tuple(found[:COMBINED]), exact=False)
    return Values(tuple(product(*(part.values for part in parts))), exact)


def _all_or(type_: Type, uses: Uses) -> tuple[Value, ...]:
    match type_:
        case BoolType():
            return (False, True)
        case EnumType(_, members):
            return tuple(range(len(members)))
        case IntType(lo, hi):
            return (min(max(0, lo), hi),)
        case DurationType():
            return (0,)
        case FloatType():
            return (0.0,)
        case SymbolType():
            return ("",)
        case ArrayType(element, length):
            return ((_all_or(element, uses)[0],) * length,)
        case RecordType(_, parts):
            return (tuple(_all_or(part.type, uses)[0] for part in parts),)
        case _:
            assert_never(type_)


def _integers(lo: int, hi: int, constants: set[int | float | str], *, exact: bool) -> Values:
    if hi - lo < ENUMERATED:
        return Values(tuple(range(lo, hi + 1)))
    found = {lo, hi, min(max(0, lo), hi)}
    for constant in constants:
        if isinstance(constant, int | float) and math.isfinite(constant):
            found |= {math.floor(constant) - 1, math.floor(constant), math.ceil(constant)}
            found.add(math.ceil(constant) + 1)
    return Values(tuple(sorted(v for v in found if lo <= v <= hi)), exact)


def _floats(constants: set[int | float | str], *, exact: bool) -> Values:
    found = {0.0}
    for constant in constants:
        if isinstance(constant, int | float):
            value = float(constant)
            found |= {value, math.nextafter(value, -math.inf), math.nextafter(value, math.inf)}
    return Values(tuple(sorted(v for v in found if math.isfinite(v))), exact)


def delays_of(chart: Chart) -> Iterator[int | None]:
    """Yield every delay of a chart in ticks, None for one that is known only when running.

    With those of the charts that it invokes.
    """
    for one in charts_within(chart):
        for transition in one.transitions:
            if not transition.is_open_ended:
                yield transition.delay
            if transition.least is not None:
                yield transition.least
        for node in nodes(_all_of(one)):
            if isinstance(node, Send) and node.delay is not None:
                is_known = isinstance(node.delay, Literal) and isinstance(node.delay.value, int)
                yield int(node.delay.value) if is_known else None  # type: ignore[union-attr, arg-type]
