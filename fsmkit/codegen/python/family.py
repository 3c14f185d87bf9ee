"""The machines of one module: a chart, and a class for each slot of an invoked machine."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fsmkit.chart.chart import Chart
from fsmkit.chart.content import all_statements
from fsmkit.chart.statements import Destination, Send
from fsmkit.codegen.python.names import (
    Module,
    Names,
    distinct,
    identifier,
    name_of_class,
    names_of,
)
from fsmkit.codegen.python.template import BASES


@dataclass(frozen=True, slots=True)
class Member:
    """A chart with its names in the module, and those of its slots, in order."""

    chart: Chart
    names: Names
    invoked: tuple[Member, ...] = ()

    @property
    def everyone(self) -> Iterator[Member]:
        """All machines of the module, invoked ones before their invokers."""
        for member in self.invoked:
            yield from member.everyone
        yield self


def is_alone(chart: Chart) -> bool:
    """Whether a machine neither invokes, nor is invoked, nor contains a send to such machines."""
    if chart.invocations or chart.done is not None or any(s.invokes for s in chart.states):
        return False
    return not any(
        isinstance(statement, Send)
        and statement.destination in (Destination.INVOKER, Destination.INVOKED)
        for statement in all_statements(chart)
    )


def family_of(chart: Chart, prefix: str | None = None) -> Member:
    """Return a chart with all machines it invokes. The class of a slot is named after its id.

    ``prefix`` replaces the name of the chart.
    """
    machine = name_of_class(prefix or chart.name)
    if is_alone(chart):
        return Member(chart, names_of(chart, Module([machine, f"{machine}Host"]), machine))
    (machine,) = distinct([machine], BASES)
    module = Module([machine, f"{machine}Host", *BASES])
    names = names_of(chart, module, machine)
    return Member(chart, names, _invoked(chart, names, module, ""))


def _invoked(chart: Chart, names: Names, module: Module, path: str) -> tuple[Member, ...]:
    found = []
    for invocation in chart.invocations:
        name = identifier(invocation.id)
        within = f"{path}{name}_"
        machine = module.name(f"{names.machine}_{name}")
        own = names_of(invocation.chart, module, machine, within, names.variables.values())
        inner = _invoked(invocation.chart, own, module, within)
        found.append(Member(invocation.chart, own, inner))
    return tuple(found)
