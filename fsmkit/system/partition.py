"""Partition the values that the environment of a system can choose, by `analysis.partition`."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.chart.analysis.partition import Condition, Partition, Place
from fsmkit.chart.chart import Data
from fsmkit.chart.content import samples_inputs
from fsmkit.system.freezes import with_freezers
from fsmkit.system.machine import OBSERVED, Machine
from fsmkit.system.properties.kinds.monitor import with_monitors
from fsmkit.system.properties.property import evaluated
from fsmkit.system.system import System


def partition_of(system: System, *, observed: bool = False, enumerated: int = 0) -> Partition:
    """Return the partition of values by their uses in machines, monitors and properties.

    ``observed``, ``enumerated``: as for `Partition`.
    """
    system = with_monitors(with_freezers(system))
    return Partition(
        [machine.chart for machine in system.machines],
        _copies(system),
        _conditions(system),
        observed=observed,
        enumerated=enumerated,
        looking=[
            number
            for number, machine in enumerate(system.machines)
            if machine.is_monitor and samples_inputs(machine.chart)
        ],
    )


def field_of(machine: int, event: int, part: int) -> Place:
    """Return the variable of a field of an event."""
    return Place(machine, "field", event, part)


def _copies(system: System) -> Iterator[tuple[Place, Place]]:
    """Yield the assignments of the wires."""
    machines = system.machines
    for event_link in system.event_links:
        for part, sent in enumerate(event_link.arguments):
            chart = machines[event_link.source].chart
            port = event_link.port - (OBSERVED if event_link.port >= OBSERVED else 0)
            called = port - len(chart.events)
            source = field_of(event_link.source, port, sent)
            if called >= 0:
                name = chart.operations[called].name
                source = Place(event_link.source, "parameter", name, sent)
            yield source, field_of(event_link.target, event_link.event, part)
    for link in system.input_links:
        source_, target = machines[link.source], machines[link.target]
        yield (
            Place(
                link.source, "variable", _variable_at(source_, source_.chart.outputs, link.output)
            ),
            Place(link.target, "variable", _variable_at(target, target.chart.inputs, link.input)),
        )


def _variable_at(machine: Machine, declared: tuple[Data, ...], number: int) -> str:
    """Return the variable at an end of a wire: after these the shared data, then all data."""
    if number < len(declared):
        return declared[number].name
    number -= len(declared)
    data, shared = machine.chart.data, machine.shared
    return data[shared[number].data if number < len(shared) else number - len(shared)].name


def _conditions(system: System) -> Iterator[Condition]:
    """Yield the conditions of properties; invariants of states are in their charts."""
    for asked in evaluated(system.properties):
        if asked.condition is not None and asked.owner is None:
            places = {
                name: Place(atom.machine, "variable", atom.variable) for name, atom in asked.atoms
            }
            yield Condition(asked.condition, places)
