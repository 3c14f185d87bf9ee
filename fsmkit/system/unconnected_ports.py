"""Propose connections for inputs and events that nothing drives or sends."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Fix
from fsmkit.diagnostics.fixes import add_list_item
from fsmkit.document.document import Direction
from fsmkit.language import Field
from fsmkit.system.machine import EventLink, Machine, operation_port

MOST = 3
"""So many ports are offered."""


def connecting(
    machines: tuple[Machine, ...],
    links: Iterable[EventLink],
    target: int,
    names: Iterable[str],
    *,
    are_inputs: bool,
) -> tuple[Fix, ...]:
    """Return fixes that connect a port of another machine to an input, or to an event.

    Args:
        machines: All machines of a system.
        links: Its connections of events.
        target: The machine with unconnected inputs or events.
        names: Its unconnected inputs or events.
        are_inputs: Whether the names are inputs.

    """
    machine, fixes = machines[target], []
    if machine.span is None or machine.place is not None:
        return ()
    taken = {(link.source, link.port) for link in links}
    for name in names:
        for number, other in enumerate(machines):
            if number == target or other.place is not None:
                continue
            for port in (
                _outputs(other.chart, machine.chart, name)
                if are_inputs
                else _senders(other.chart, machine.chart, name, number, taken)
            ):
                wire = f"{other.name}.{port} -> {machine.name}.{name}"
                edits = add_list_item(machine.span.source, "connect", wire)
                fixes.append(Fix(f"Connect `{wire}`", edits))
    return tuple(fixes[:MOST])


def _outputs(chart: Chart, reader: Chart, name: str) -> Iterator[str]:
    wanted = next(one.type for one in reader.inputs if one.name == name)
    return (output.name for output in chart.outputs if output.type == wanted)


def _senders(
    chart: Chart, receiver: Chart, name: str, number: int, taken: set[tuple[int, int]]
) -> Iterator[str]:
    wanted = receiver.events[receiver.event_index[name]].fields
    for event in chart.events:
        is_free = Direction.OUT in event.directions and (number, event.index) not in taken
        if is_free and _fit(event.fields, wanted):
            yield event.name
    for operation in chart.operations:
        port = operation_port(chart, operation.name)
        is_command = operation.result is None and (number, port) not in taken
        if is_command and wanted and _fit(operation.parameters, wanted):
            yield operation.name


def _fit(sent: tuple[Field, ...], wanted: tuple[Field, ...]) -> bool:
    return [one.type for one in sent] == [one.type for one in wanted]
