"""The reduction by dead variables: data that nothing can read any more have their start values.

It preserves all verdicts. Data that a property, a monitor or another machine may read are never
reset, nor are outputs. An external step that only changes a variable still counts as a step.
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

    ``data``: its index in the data. ``live``: the atomic states in which it may be live. In all
    other configurations, and while the machine does not run, it is reset to ``init``.
    """

    data: int
    live: frozenset[int]
    init: Value


def resettable_variables(
    system: System, charts: Sequence[Chart], possible: Collection[Possible]
) -> tuple[tuple[ResettableVariable, ...], ...]:
    """Return for each machine of a system the variables that are dead somewhere.

    ``charts``: those of the machines as explored; ``possible``: their external events.
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
    """Return for each machine the data that wires and properties read."""
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
    """Return the transitions whose changes of data count as effects.

    An external event without effect is no step. In a system a possible step prevents a deadlock; a
    chart alone is never in one.
    """
    if system.is_open:
        return frozenset()
    return frozenset(
        t.index for t in chart.transitions if t.least is not None or not events.isdisjoint(t.events)
    )


def with_dead_reset(snapshot: Snapshot, mortal: tuple[ResettableVariable, ...]) -> Snapshot:
    """Return a machine with its dead data at their start values."""
    active = snapshot.configuration if snapshot.running else frozenset[int]()
    dead = {m.data: m.init for m in mortal if m.live.isdisjoint(active)}
    if not dead:
        return snapshot
    data = tuple(dead.get(place, value) for place, value in enumerate(snapshot.data))
    return replace(snapshot, data=data)
