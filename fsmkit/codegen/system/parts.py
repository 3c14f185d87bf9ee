"""The machines of a system as C sees them: names, members, and the order in which they run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, replace

from fsmkit.chart.chart import Chart
from fsmkit.chart.content import reads_input
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.naming import name_everything
from fsmkit.codegen.c.reserved import KEYWORDS
from fsmkit.document.document import Trigger
from fsmkit.emit import Namer, legal, snake
from fsmkit.plan import lower
from fsmkit.system.system import System

MEMBERS = {"now", "steps", "lost", "starting", "working"}
"""Members of a system's struct, beside its machines."""


@dataclass(frozen=True, slots=True)
class Part:
    """A machine of a system: its names, its member in the struct, and what it needs there."""

    index: int
    names: Names
    member: str
    samples: bool
    """Whether a change of its inputs alone can trigger a step."""
    is_fed: bool
    """Whether connections lead to its queue."""
    has_queue: bool

    @property
    def chart(self) -> Chart:
        """The chart."""
        return self.names.chart

    @property
    def prefix(self) -> str:
        """The prefix of its functions."""
        return self.names.prefix


def named_charts(system: System, *, is_joined: bool = True) -> tuple[Chart, ...]:
    """Return the chart of each machine with the name for its code.

    Machines share the code of their chart. If connections start at several machines of a chart,
    each of these has its own code, named after the machine, so a call identifies its machine.
    Further charts of equal names are renamed, and charts with the name of the system.
    ``is_joined``: connections join the machines, and their code has the name of the system.
    """
    links = system.event_links if is_joined else ()
    begins = {system.machines[link.source].chart for link in links}
    count = Counter(machine.chart for machine in system.machines)
    once: dict[Chart, Chart] = {}
    taken = {snake(system.name)} if is_joined else set()
    found: list[Chart] = []

    def named(chart: Chart, name: str) -> Chart:
        """Return the chart with a name that differs from all others without regard to case."""
        wanted, number = name, 1
        while snake(name) in taken:
            number += 1
            name = f"{wanted}_{number}"
        taken.add(snake(name))
        return chart if name == chart.name else replace(chart, name=name)

    for machine in system.machines:
        chart, own = machine.chart, legal(machine.name).strip("_")
        if count[chart] > 1 and chart in begins:
            found.append(named(chart, own))
            continue
        if chart not in once:
            is_taken = snake(chart.name) in taken
            once[chart] = named(chart, own if is_taken else chart.name)
        found.append(once[chart])
    return tuple(found)


def parts_of(
    system: System, charts: tuple[Chart, ...], queued: Collection[str]
) -> tuple[Part, ...]:
    """Return the machines, those of the environment first.

    ``charts``: the charts of the machines with the names for their code; ``queued``: the names of
    charts whose code has a queue.
    """
    members = Namer(KEYWORDS | MEMBERS)
    fed = {link.target for link in system.event_links}
    found = []
    for index, (machine, chart) in enumerate(zip(system.machines, charts, strict=True)):
        names = name_everything(lower(chart), None)
        samples = any(
            t.trigger is Trigger.EVENTLESS and t.guard is not None and reads_input(t.guard)
            for t in chart.transitions
        )
        member = members.name(snake(legal(machine.name).strip("_")))
        found.append(Part(index, names, member, samples, index in fed, chart.name in queued))
    return tuple(sorted(found, key=lambda part: not system.machines[part.index].environment))
