"""The reduction by dead variables: data that nothing reads any more count as at their start.

It keeps all verdicts. What a property, a monitor or another machine may look at is never reset, nor
are outputs; a step from outside that changes a variable only still counts as a step.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from fsmkit.analysis.accesses import Names
from fsmkit.analysis.live_variables import live_variables
from fsmkit.chart.chart import Chart
from fsmkit.chart.content import variables
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.system.properties.property import evaluated
from fsmkit.system.system import Possible, System


@dataclass(frozen=True, slots=True)
class ResettableVariable:
    """A variable of a chart that is dead somewhere.

    ``data``: its place in the data. ``live``: the atomic states in which it may be live. In all
    other configurations, and where the machine does not run, it is reset to ``init``.
    """

    data: int
    live: frozenset[int]
    init: Value


def mortal_variables(
    system: System, charts: Sequence[Chart], possible: Collection[Possible]
) -> tuple[tuple[ResettableVariable, ...], ...]:
    """Return for each machine of a system the variables that are dead somewhere.

    ``charts`` are those of the machines as they are explored, ``possible`` what can come to them.
    """
    return tuple(
        _of_machine(system, machine, chart, possible) for machine, chart in enumerate(charts)
    )


def _of_machine(
    system: System, machine: int, chart: Chart, possible: Collection[Possible]
) -> tuple[ResettableVariable, ...]:
    names = frozenset(data.name for data in chart.data) - _looked_at(system, machine, chart)
    if not names:
        return ()
    leaves = frozenset(state.index for state in chart.states if state.is_leaf)
    live = live_variables(chart, names, _observed(system, machine, chart, possible))
    return tuple(
        ResettableVariable(place, live[data.name], data.init.value)
        for place, data in enumerate(chart.data)
        if data.name in names and live[data.name] != leaves
    )


def _looked_at(system: System, machine: int, chart: Chart) -> Names:
    """Return the data that something besides the machine's own content may look at."""
    instance = system.machines[machine]
    found = {slot.name for slot in instance.shared}
    first = len(chart.outputs) + len(instance.shared)
    for link in system.input_links:
        if link.source == machine and link.output >= first:
            found.add(chart.data[link.output - first].name)
    for property_ in evaluated(system.properties):
        found |= {atom.variable for _, atom in property_.atoms if atom.machine == machine}
        if property_.owner == machine:
            found |= variables(property_.condition)
    found |= variables(tuple(state.invariant for state in chart.states))
    return frozenset(found) | variables(tuple(event.finalize for event in chart.events))


def _observed(
    system: System, machine: int, chart: Chart, possible: Collection[Possible]
) -> frozenset[int]:
    """Return the transitions of which it counts whether they change anything.

    What comes from outside and changes nothing is no step. In a system a step that can come is a
    reason not to be in a deadlock; a chart alone is never in one.
    """
    if system.is_open:
        return frozenset()
    events = {one.event for one in possible if one.machine == machine}
    return frozenset(
        t.index for t in chart.transitions if t.least is not None or not events.isdisjoint(t.events)
    )


def with_dead_reset(snapshot: Snapshot, mortal: tuple[ResettableVariable, ...]) -> Snapshot:
    """Return a machine in which what is dead is at its start."""
    active = snapshot.configuration if snapshot.running else frozenset[int]()
    dead = {m.data: m.init for m in mortal if m.live.isdisjoint(active)}
    if not dead:
        return snapshot
    data = tuple(dead.get(place, value) for place, value in enumerate(snapshot.data))
    return replace(snapshot, data=data)
