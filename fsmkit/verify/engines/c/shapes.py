"""Share one C file among charts of a system that differ in constants only.

A constant in which they differ becomes an input of the common chart, after its own inputs. Only the
explorer sets it, once for each machine. So it is not part of the data, which traces show, and the
numbers of the other inputs remain the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.chart.chart import Chart, Data, Event, State, Transition
from fsmkit.language.walk import EXPRESSIONS


@dataclass(frozen=True, slots=True)
class Shape:
    """A chart for several machines, by number, with the values of its last inputs for each."""

    chart: Chart
    machines: tuple[int, ...]
    values: tuple[tuple[int, ...], ...]


def shapes_of(charts: Sequence[Chart]) -> Iterator[Shape]:
    """Yield the shapes of all charts, in the order of their first machines."""
    groups: dict[object, list[int]] = {}
    holes: dict[int, list[_Hole]] = {}
    by_chart: dict[int, object] = {}
    for number, chart in enumerate(charts):
        if id(chart) not in by_chart:
            own: list[_Hole] = []
            shared = not chart.invocations and not chart.copies
            by_chart[id(chart)] = _shape(chart, own) if shared else number
            holes[id(chart)] = own
        groups.setdefault(by_chart[id(chart)], []).append(number)
    for group in groups.values():
        yield _join(charts, tuple(group), [holes[id(charts[number])] for number in group])


# --- one chart ------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Hole:
    """A location where charts may differ: a literal, or the type of a result (without a value)."""

    type: lang.IntType
    value: int | None = None


WALKED = EXPRESSIONS | {Chart, State, Transition, Event, stmt.Send, stmt.Cancel}
WALKED |= {
    stmt.Assign,
    stmt.Branch,
    stmt.CallOperation,
    stmt.ForEach,
    stmt.If,
    stmt.Local,
    stmt.Log,
    stmt.Raise,
    stmt.Reply,
}
"""The parts that may hold such locations. Functions do not, as they list their reads."""
EXACT = frozenset({lang.Apply, lang.Binary, lang.Conditional, lang.Unary})
"""Expressions whose type is only the range of their values."""


@cache
def _compared(kind: Any) -> tuple[str, ...]:
    """Return the fields that distinguish two nodes of a class; None for a leaf."""
    if kind not in WALKED:
        return ()
    names = (field.name for field in fields(kind) if field.compare)
    return tuple(name for name in names if kind is not Chart or name != "constants")


def _shape(node: Any, holes: list[_Hole]) -> object:
    """Return the common structure of charts of one shape, and record where they may differ."""
    kind = node.__class__
    if kind is tuple:
        return tuple([_shape(part, holes) for part in node])
    if kind is lang.Literal and node.value.__class__ is int and node.type.__class__ is lang.IntType:
        holes.append(_Hole(node.type, node.value))
        return lang.Literal, node.type.overflow
    names = _compared(kind)
    if not names:
        return kind, node
    found: list[object] = [kind]
    for name in names:
        part = getattr(node, name)
        if name == "type" and kind in EXACT and _may_differ(part):
            holes.append(_Hole(part))
            found.append(lang.IntType)
        else:
            found.append(_shape(part, holes))
    return tuple(found)


def _may_differ(type_: lang.Type) -> bool:
    return isinstance(type_, lang.IntType) and type_.overflow is not lang.Overflow.WRAP


# --- several --------------------------------------------------------------------------------------


def _join(
    charts: Sequence[Chart], group: tuple[int, ...], holes: Sequence[Sequence[_Hole]]
) -> Shape:
    first = charts[group[0]]
    if all(own is holes[0] for own in holes):
        return Shape(first, group, ((),) * len(group))
    inputs: list[Data] = []
    values: list[tuple[int, ...]] = []
    known: dict[tuple[lang.IntType, tuple[int, ...]], lang.Variable] = {}

    def filled(each: tuple[_Hole, ...]) -> lang.IntType | lang.Variable | None:
        type_ = _hull([hole.type for hole in each])
        if each[0].value is None:
            return type_
        found = tuple(hole.value for hole in each if hole.value is not None)
        if min(found) == max(found):
            return None
        if (type_, found) not in known:
            span = first.states[0].span
            name = f"constant.{len(inputs)}"
            least = lang.Literal(found[0], type_, span)
            inputs.append(Data(name, type_, least, span))
            values.append(found)
            known[type_, found] = lang.Variable(name, type_, lang.Storage.INPUT, span)
        return known[type_, found]

    fillings = iter([filled(each) for each in zip(*holes, strict=True)])
    chart = _fill(first, fillings)
    chart = replace(chart, inputs=(*first.inputs, *inputs))
    by_machine = tuple(zip(*values, strict=True)) if values else ((),) * len(group)
    return Shape(chart, group, by_machine)


def _hull(types: Sequence[lang.IntType]) -> lang.IntType:
    lo, hi = min(type_.lo for type_ in types), max(type_.hi for type_ in types)
    return replace(types[0], lo=lo, hi=hi)


def _fill(node: Any, fillings: Iterator[lang.IntType | lang.Variable | None]) -> Any:
    """Return a node with its holes filled, in the order of `_shape`."""
    kind = node.__class__
    if kind is tuple:
        return tuple([_fill(part, fillings) for part in node])
    if kind is lang.Literal and node.value.__class__ is int and node.type.__class__ is lang.IntType:
        return next(fillings) or node
    changed = {}
    for name in _compared(kind):
        part = getattr(node, name)
        if name == "type" and kind in EXACT and _may_differ(part):
            changed[name] = next(fillings)
        else:
            changed[name] = _fill(part, fillings)
    return replace(node, **changed) if changed else node
