"""The machines of one module: a chart, and a class for each slot that it invokes others in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from fsmkit.chart.chart import Chart
from fsmkit.chart.content import all_statements
from fsmkit.chart.statements import Destination, Send
from fsmkit.codegen.python.names import Names, distinct, identifier, names_of, timers_of
from fsmkit.codegen.python.template import BASES


@dataclass(frozen=True, slots=True)
class Member:
    """A chart with its names in the module, and those of its slots, in order."""

    chart: Chart
    names: Names
    invoked: tuple[Member, ...] = ()

    @property
    def everyone(self) -> Iterator[Member]:
        """All machines of the module: those that are invoked before what invokes them."""
        for member in self.invoked:
            yield from member.everyone
        yield self


def is_alone(chart: Chart) -> bool:
    """Whether a machine neither invokes nor is invoked, nor tries to send where that would lead."""
    if chart.invocations or chart.done is not None or any(s.invokes for s in chart.states):
        return False
    return not any(
        isinstance(statement, Send)
        and statement.destination in (Destination.INVOKER, Destination.INVOKED)
        for statement in all_statements(chart)
    )


def family_of(chart: Chart, prefix: str | None = None) -> Member:
    """Return a chart with all that it invokes. The class of a slot is called after its id.

    ``prefix`` takes the place of the name of the chart.
    """
    names = names_of(chart, prefix=prefix)
    if is_alone(chart):
        return Member(chart, names)
    (machine,) = distinct([names.machine], BASES)
    names = replace(names, machine=machine)
    taken = {machine, f"{machine}Host", *BASES, *names.states, *names.timers.values()}
    return Member(chart, names, _invoked(chart, names, "S", tuple(names.variables.values()), taken))


def _invoked(
    chart: Chart, names: Names, prefix: str, hidden: tuple[str, ...], taken: set[str]
) -> tuple[Member, ...]:
    found = []
    for invocation in chart.invocations:
        name = identifier(invocation.id)
        own = names_of(invocation.chart, hidden)
        (machine,) = distinct([f"{names.machine}_{name}"], taken)
        taken.add(machine)
        path = f"{prefix}_{name}"
        states = distinct([f"{path}_{bare}".upper() for bare in own.bare[1:]], taken)
        taken.update(states)
        timers = timers_of(invocation.chart, f"T{path[1:]}".upper(), own.bare)
        timers = dict(zip(timers, distinct(timers.values(), taken), strict=True))
        taken.update(timers.values())
        own = replace(own, machine=machine, states=("ROOT", *states), timers=timers)
        found.append(
            Member(invocation.chart, own, _invoked(invocation.chart, own, path, hidden, taken))
        )
    return tuple(found)
