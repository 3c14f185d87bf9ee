"""The variables of an FMU: one per scalar of a machine, in the order of their references."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import fsmkit.language as lang
from fsmkit.chart.analysis.host_events import posted_events, sent_events
from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.expressions.types import interval
from fsmkit.codegen.c.storage import integer_storage
from fsmkit.plan.image import flat, scalars_by_path
from fsmkit.plan.plan import Plan

INT32 = range(-(2**31), 2**31)
INACTIVE = "(inactive)"


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable of an FMU and its origin in the table of the machine."""

    name: str
    source: str
    """The source, a member of ``fmu_source``."""
    type: lang.Type | None = None
    number: int = 0
    field: int = 0
    scalar: int = 0
    part: int = 0
    """The machine of the system that contains it."""
    causality: str = "output"
    start: object = 0
    clock: int | None = None
    """The reference of its event or operation."""
    items: tuple[tuple[str, int], ...] = ()
    """The names and values of an enumeration."""
    doc: str = ""

    @property
    def kind(self) -> str:
        """The type in FMI 3.0."""
        match self.type:
            case _ if self.items:
                return "Enumeration"
            case None:
                return "Float64" if self.source == "TIME" else "Clock"
            case lang.BoolType():
                return "Boolean"
            case lang.FloatType(bits):
                return f"Float{bits}"
            case _:
                of = interval(self.type)
                text = integer_storage(of.lo, of.hi)[0].removesuffix("_t")
                return text.replace("uint", "UInt").replace("int", "Int")

    @property
    def kind2(self) -> str:
        """The type in FMI 2.0."""
        if self.kind in ("Boolean", "Enumeration"):
            return self.kind
        if self.kind == "Clock":
            return "Integer"
        if self.kind.startswith("Float"):
            return "Real"
        of = interval(self.type)
        return "Integer" if of.lo in INT32 and of.hi in INT32 else "Real"

    @property
    def bounds(self) -> tuple[int, int] | None:
        """The bounds of an integer variable; None for others."""
        if not self.kind.startswith(("Int", "UInt")):
            return None
        of = interval(self.type)
        return of.lo, of.hi


def variables_of(chart: Chart, plan: Plan, *, with_clocks: bool) -> list[Variable]:
    """Return the variables of a chart; their references are their positions."""
    return _whole(_of_machine(chart, plan, Joined(), 1), with_clocks=with_clocks)


@dataclass(frozen=True, slots=True)
class Joined:
    """The connected ports of a machine, which the importer does not access."""

    inputs: frozenset[int] = frozenset()
    events: frozenset[int] = frozenset()
    """The events that other machines send to it."""
    ports: frozenset[int] = frozenset()
    """The numbers of outgoing events and, counted after all events, of operations."""


def variables_of_all(
    machines: Sequence[tuple[str, Chart, Plan, Joined]], *, with_clocks: bool
) -> list[Variable]:
    """Return the variables of the machines of a system; each name starts with its machine's."""
    found: list[Variable] = []
    for part, (name, chart, plan, joined) in enumerate(machines):
        own = _of_machine(chart, plan, joined, 1 + len(found))
        found += [replace(each, name=f"{name}.{each.name}", part=part) for each in own]
    return _whole(found, with_clocks=with_clocks)


def _whole(inner: list[Variable], *, with_clocks: bool) -> list[Variable]:
    """Return variables, preceded by the time and followed by the next timer's deadline."""
    found = [Variable("time", "TIME", causality="independent", start=None), *inner]
    if with_clocks:
        found.append(Variable("deadline", "DEADLINE", causality="input"))
    names = _distinct([(v.name, 0) for v in found])
    return [replace(v, name=name) for v, (name, _) in zip(found, names, strict=True)]


def _of_machine(chart: Chart, plan: Plan, joined: Joined, first: int) -> list[Variable]:
    """Return the variables of a machine; ``first``: the reference of its first variable."""
    found: list[Variable] = []
    kinds = (("local", chart.data), ("output", chart.outputs), ("input", chart.inputs))
    numbered = ((cause, v) for cause, variables in kinds for v in variables)
    before = len(chart.data) + len(chart.outputs)
    for number, (given, v) in enumerate(numbered):
        causality = "local" if number - before in joined.inputs else given
        values = list(flat(v.init.value))
        for scalar, (path, type_) in enumerate(scalars_by_path(v.type)):
            if isinstance(type_, lang.SymbolType):
                continue
            found.append(
                _typed(
                    f"{v.name}{path}",
                    "VARIABLE",
                    type_,
                    number,
                    0,
                    scalar,
                    causality,
                    values[scalar],
                )
            )
    for region in plan.regions:
        inside = [
            state
            for state in chart.states[1:]
            if not state.is_history and plan.region_of[state.index] == region.index
        ]
        items = [(INACTIVE, 0), *((state.id, state.index) for state in inside)]
        name = "state" if region.index == 0 else f"state.{inside[0].id}"
        found.append(
            Variable(
                name,
                "REGION",
                number=region.index,
                items=tuple(_distinct(items)),
                causality="output",
            )
        )
    for index in posted_events(chart):
        event = chart.events[index]
        if index not in joined.events:
            _add(found, first, "IN", f"post.{event.name}", index, event.fields, "input")
    for index in sent_events(chart):
        event = chart.events[index]
        if index not in joined.ports:
            _add(found, first, "OUT", f"send.{event.name}", index, event.fields, "output")
    for number, operation in enumerate(chart.operations):
        if len(chart.events) + number not in joined.ports:
            name = f"call.{operation.name}"
            _add(found, first, "CALL", name, number, operation.parameters, "output")
    for number, operation in enumerate(chart.operations):
        if operation.result is not None:
            for scalar, (path, type_) in enumerate(scalars_by_path(operation.result)):
                name = f"result.{operation.name}{path}"
                found.append(_typed(name, "RESULT", type_, number, 0, scalar, "input"))
    return found


def _add(
    found: list[Variable],
    first: int,
    source: str,
    name: str,
    number: int,
    fields: Sequence[lang.Field],
    causality: str,
) -> None:
    """Add an event or an operation, and then the scalars of its payload."""
    clock = first + len(found)
    found.append(Variable(name, source, number=number, causality=causality))
    inner = "PARAMETER" if source == "CALL" else "FIELD"
    for place, part in enumerate(fields):
        for scalar, (path, type_) in enumerate(scalars_by_path(part.type)):
            if isinstance(type_, lang.SymbolType):
                continue
            text = f"{name}.{part.name}{path}"
            variable = _typed(text, inner, type_, number, place, scalar, causality)
            found.append(replace(variable, clock=clock))


def _typed(
    name: str, source: str, type_: lang.Type, number: int, field: int, scalar: int, causality: str,
    start: object = None,
) -> Variable:  # fmt: skip
    items: tuple[tuple[str, int], ...] = ()
    if isinstance(type_, lang.EnumType):
        items = tuple(_distinct(list(zip(type_.members, type_.numbers, strict=True))))
    if start is None:
        start = type_.numbers[0] if isinstance(type_, lang.EnumType) else 0
        if not isinstance(type_, lang.FloatType | lang.BoolType | lang.EnumType):
            of = interval(type_)
            start = max(of.lo, min(0, of.hi))
    return Variable(
        name, source, type_, number, field, scalar, causality=causality, start=start, items=items
    )


def _distinct(named: list[tuple[str, int]]) -> list[tuple[str, int]]:
    """Return distinct texts that are valid in an XML attribute."""
    taken: set[str] = set()
    result = []
    for name, value in named:
        clean = "".join(c if c.isprintable() and c not in "\ufffe\uffff" else "_" for c in name)
        clean = clean.strip() or "_"
        text, number = clean, 1
        while text in taken:
            number += 1
            text = f"{clean}_{number}"
        taken.add(text)
        result.append((text, value))
    return result
