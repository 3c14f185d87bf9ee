"""The reduction by dead variables: data that nothing reads any more count as at their start.

It keeps all verdicts. What a property, a monitor or another machine may look at is never reset, nor
are outputs; a step from outside that changes a variable only still counts as a step.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from fsmkit.chart.analysis.live_variables import live_variables
from fsmkit.chart.chart import Chart
from fsmkit.chart.content import variables
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.system.machine import Possible
from fsmkit.system.properties.property import evaluated
from fsmkit.system.system import System


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
    events: list[set[int]] = [set() for _ in charts]
    for one in possible:
        events[one.machine].add(one.event)
    watched = _watched(system, charts)
    return tuple(
        _of_machine(system, machine, chart, watched[machine], events[machine])
        for machine, chart in enumerate(charts)
    )


def _of_machine(
    system: System, machine: int, chart: Chart, watched: set[str], events: set[int]
) -> tuple[ResettableVariable, ...]:
    instance = system.machines[machine]
    looked_at = watched | {slot.name for slot in instance.shared}
    looked_at |= variables(tuple(state.invariant for state in chart.states))
    looked_at |= variables(tuple(event.finalize for event in chart.events))
    names = frozenset(data.name for data in chart.data) - looked_at
    if not names:
        return ()
    leaves = frozenset(state.index for state in chart.states if state.is_leaf)
    live = live_variables(chart, names, _observed(system, chart, events))
    return tuple(
        ResettableVariable(place, live[data.name], data.init.value)
        for place, data in enumerate(chart.data)
        if data.name in names and live[data.name] != leaves
    )


def _watched(system: System, charts: Sequence[Chart]) -> tuple[set[str], ...]:
    """Return for each machine the data at which wires and properties look."""
    found: tuple[set[str], ...] = tuple(set() for _ in charts)
    for link in system.input_links:
        chart = charts[link.source]
        first = len(chart.outputs) + len(system.machines[link.source].shared)
        if link.output >= first:
            found[link.source].add(chart.data[link.output - first].name)
    for property_ in evaluated(system.properties):
        for _, atom in property_.atoms:
            found[atom.machine].add(atom.variable)
        if property_.owner is not None:
            found[property_.owner].update(variables(property_.condition))
    return found


def _observed(system: System, chart: Chart, events: set[int]) -> frozenset[int]:
    """Return the transitions of which it counts whether they change anything.

    What comes from outside and changes nothing is no step. In a system a step that can come is a
    reason not to be in a deadlock; a chart alone is never in one.
    """
    if system.is_open:
        return frozenset()
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
