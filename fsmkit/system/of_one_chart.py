"""Properties and environment of a chart: those of the system with this chart as its only machine.

In another system each property that is about one machine (`Kind.is_local`) is evaluated again for
each machine that runs the chart, as ``door.safe``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings, FsmkitError, Text
from fsmkit.document.document import Direction, DocEnvironment, DocProperty
from fsmkit.system.connections import names_of_events, report_unconnected
from fsmkit.system.environment import read_environment, with_environment
from fsmkit.system.machine import Machine, Monitor
from fsmkit.system.properties.kinds import kinds
from fsmkit.system.properties.kinds.invariant import invariants_of
from fsmkit.system.properties.kinds.monitor import require_few
from fsmkit.system.properties.property import Property
from fsmkit.system.properties.reading import Reading
from fsmkit.system.qualified_names import in_environment
from fsmkit.system.system import System
from fsmkit.yaml.nodes import Mapping, Node, Scalar, Sequence


def system_of(chart: Chart) -> System:
    """Return the system of one chart alone, with the invariants of its states as properties."""
    properties = tuple(invariants_of(chart, 0, prefix=""))
    machines = (Machine(chart.name, chart),)
    return System(chart.name, machines, properties=properties, is_open=True, of_chart=True)


def system_of_chart(chart: Chart, findings: Findings | None = None) -> System:
    """Return the system to explore for a chart: one machine, with its properties and environment.

    Without ``environment`` the environment is unrestricted, and the system is open; with one it is
    closed. Monitors are further machines: with them it is closed, with an unrestricted environment.

    Args:
        chart: The chart.
        findings: Receives the warnings.

    Raises:
        FsmkitError: With all findings, if a property or the environment cannot be read.

    """
    findings = Findings() if findings is None else findings
    if not chart.properties and chart.environment is None:
        return system_of(chart)
    word = chart.name if chart.name.isidentifier() else re.sub(r"\W", "_", f"_{chart.name}")
    machines = (Machine(word, chart, span=chart.states[0].span),)
    monitors: list[Monitor] = []
    properties = tuple(own_properties(machines, 0, monitors, findings, prefix=""))
    require_few(tuple(monitors), 1, findings)
    system = replace(
        system_of(chart),
        properties=(*properties, *invariants_of(chart, 0, prefix="")),
        monitors=tuple(monitors),
        source=chart.sources[0] if chart.sources else None,
    )
    environment = chart.environment
    if environment is None and monitors:
        environment = _unrestricted_environment(chart)
    if environment is not None and not findings.has_errors:
        system = _with_environment(system, machines, environment, findings)
    if findings.has_errors:
        raise FsmkitError(findings)
    return system


def _unrestricted_environment(chart: Chart) -> DocEnvironment:
    """Return the unrestricted environment: all events occur, and all inputs change, at any time."""
    span = chart.states[0].span
    names = [declared.name for declared in chart.inputs]
    names += names_of_events(chart, Direction.IN)
    return DocEnvironment(may=tuple(Text(name, span, ()) for name in names), span=span)


def _with_environment(
    system: System, machines: tuple[Machine, ...], given: DocEnvironment, findings: Findings
) -> System:
    """Return a system whose external events and free inputs are those that the chart names."""
    span = given.span or machines[0].chart.states[0].span
    parts: list[tuple[Text, Node]] = [
        (
            Text(key, span, ()),
            Sequence(tuple(Scalar(in_environment(text, machines[0])) for text in texts), span),
        )
        for key, texts in (("may", given.may), ("will", given.will))
    ]
    environment = read_environment(Mapping(tuple(parts), span), machines, findings)
    possible = [(named.machine, named.event) for named in environment.named]
    alone = (replace(machines[0], span=span),)
    report_unconnected(alone, (), environment.inputs, possible, findings, is_alone=True)
    if findings.has_errors:
        return system
    named = replace(system, machines=machines, is_open=False)
    closed = with_environment(named, environment, findings)
    return replace(closed, machines=system.machines)


def own_properties(
    machines: tuple[Machine, ...],
    number: int,
    monitors: list[Monitor],
    findings: Findings,
    *,
    prefix: str | None = None,
    strict: bool = False,
) -> Iterator[Property]:
    """Yield the properties of the chart of a machine.

    Args:
        machines: All machines of the system.
        number: The machine.
        monitors: Receives the machines that monitor them.
        findings: Receives the errors.
        prefix: The start of their names, if the machine is alone. Otherwise only properties about
            one machine are read, prefixed by its name.
        strict: As for `Reading`.

    """
    machine = machines[number]
    for one in machine.chart.properties:
        kind = kinds().get(one.kind.value)
        if prefix is None and (kind is None or not kind.is_local):
            continue
        folder = Path(one.name.span.source.name).parent
        reading = Reading(machines, folder, findings, strict, own=number)
        name = f"{machine.name}.{one.name}" if prefix is None else f"{prefix}{one.name}"
        key = one.name.with_value(name)
        found = tuple(reading.properties(Mapping(((key, _node(one)),), one.name.span)))
        monitors += reading.monitors
        for property_ in found:
            given = [text.value for text in (one.first, one.time, one.then) if text is not None]
            text = given[0] if len(given) == 1 else f"[{', '.join(given)}]"
            is_written = given and kind is not None and kind.read is None and kind.form
            found_text = text if is_written else property_.text
            yield replace(property_, text=found_text, req=one.req)


def _node(one: DocProperty) -> Node:
    """Return a property in the form of a node of a system file."""
    parts = tuple(Scalar(part) for part in (one.first, one.time, one.then) if part is not None)
    if not parts and not one.watch:
        return Scalar(one.kind)
    value: Node = parts[0] if len(parts) == 1 else Sequence(parts, one.kind.span)
    entries: list[tuple[Text, Node]] = [(one.kind, value)]
    if one.watch:
        watched = Sequence(tuple(Scalar(text) for text in one.watch), one.kind.span)
        entries.append((Text("watch", one.kind.span, ()), watched))
    return Mapping(tuple(entries), one.kind.span)


def properties_of_machines(
    machines: tuple[Machine, ...],
    monitors: list[Monitor],
    known: Iterable[Property],
    findings: Findings,
    *,
    strict: bool = False,
) -> Iterator[Property]:
    """Yield the properties in the charts of machines, evaluated for each machine.

    Findings are reported once for each chart, at its own lines. ``known``: properties of the
    system, whose names are reserved.
    """
    names = {one.name: one for one in known}
    sound: dict[int, bool] = {}
    for number, machine in enumerate(machines):
        chart = machine.chart
        if not chart.properties:
            continue
        if id(chart) not in sound:
            own = Findings()
            try:
                system_of_chart(replace(chart, environment=None), own)
            except FsmkitError:
                findings.extend(own)
            sound[id(chart)] = not own.has_errors
        if not sound[id(chart)]:
            continue
        for found in own_properties(machines, number, monitors, findings, strict=strict):
            if found.name in names:
                findings.add(
                    "duplicate-name",
                    f"there are two properties `{found.name}`",
                    names[found.name].span or found.span,
                    secondary=[(found.span, "that of the chart")] if found.span else [],
                    help="rename the one of the system",
                )
            yield found
