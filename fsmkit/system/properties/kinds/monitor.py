"""``monitor: CHART``: a chart that observes the machines never enters its state ``error``.

::

    Answered:
      monitor: answered.yaml
      watch:
        - occurs(lamp.press) -> press   # an event that the lamp takes, with its fields
        - lamp.lit -> lit               # an event or operation that it sends
        - lamp.level -> level           # an output, or data: an input of the monitor

A monitor is a machine of the environment that moves before all others: after an observed event,
nothing else moves until the monitor has handled it. Its own events are discarded, so it does not
change the behaviour of the others.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

from fsmkit.chart.chart import Chart, Event
from fsmkit.diagnostics import Findings, Text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.document import Direction, Trigger
from fsmkit.document.keys import MONITOR
from fsmkit.language import BOOL, Field, Storage, Type, Variable
from fsmkit.system.connections import (
    arguments_of,
    find_machine,
    names_of_events,
    port_of,
    report_duplicate,
    report_unconnected,
    type_mismatch,
)
from fsmkit.system.indices import INDEXED, MOST_ELEMENTS, expand_indices
from fsmkit.system.machine import OBSERVED, EventLink, InputLink, Machine, Monitor
from fsmkit.system.machines import read_machine
from fsmkit.system.properties.condition import Atom
from fsmkit.system.properties.property import AtStates, Kind, Property, PropertyContext
from fsmkit.system.qualified_names import in_watch
from fsmkit.system.system import System
from fsmkit.yaml.nodes import Node, require_record, texts_of

ERROR = "error"
"""The state that a monitor must not reach."""
CHANGED = "inputs.changed"
"""The event that lets a monitor look at its inputs, where eventless transitions read them."""
EXAMPLE = "for instance `occurs(lamp.press) -> press`, or `lamp.level -> level`"

NAME = r"[A-Za-z_][\w.]*"
SOURCE = re.compile(
    rf"\s*(?:occurs\s*\(\s*(?P<taking>{INDEXED})\s*\.\s*(?P<event>{NAME})\s*\)"
    rf"|(?P<machine>{INDEXED})\s*\.\s*(?P<name>{NAME}))\s*"
)


@dataclass(slots=True)
class _Watch:
    """Reads the observed events and values of a monitor."""

    machines: tuple[Machine, ...]
    monitor: Machine
    findings: Findings
    events: dict[tuple[int, int, int], tuple[EventLink, Text]] = field(default_factory=dict)
    inputs: dict[int, tuple[tuple[InputLink, ...], Text]] = field(default_factory=dict)

    def read(self, text: Text) -> None:
        """Read one line."""
        left, arrow, right = text.value.partition("->")
        match = SOURCE.fullmatch(left)
        target = text.part(len(left) + 2, len(text.value)).strip() if arrow else text
        if match is None or not right.strip():
            self.findings.add(
                "broken-connection", "a monitor watches `source -> name`", text, help=EXAMPLE
            )
            return
        group = "taking" if match["taking"] is not None else "machine"
        machine = find_machine(text.part(*match.span(group)), self.machines, self.findings)
        if machine is None:
            return
        if group == "taking":
            self._observed(machine, text.part(*match.span("event")), target, text)
        else:
            self._leaving(machine, text.part(*match.span("name")), target, text)

    def _observed(self, machine: int, name: Text, target: Text, text: Text) -> None:
        chart = self.machines[machine].chart
        number = chart.event_index.get(name.value)
        if number is None:
            self._unknown(f"`{self.machines[machine].name}` has no event", name, chart.event_index)
            return
        self._event(machine, OBSERVED + number, chart.events[number].fields, name, target, text)

    def _leaving(self, machine: int, name: Text, target: Text, text: Text) -> None:
        chart, instance = self.machines[machine].chart, self.machines[machine].name
        values = {v.name: v.type for v in (*chart.outputs, *chart.data)}
        if name.value in values:
            self._value(machine, name, values[name.value], target, text)
        elif (port := port_of(chart, name.value)) is not None:
            self._event(machine, *port, name, target, text)
        elif name.value in chart.event_index:
            self.findings.add(
                "wrong-direction",
                f"`{name}` does not leave `{instance}`",
                name,
                help=f"write `occurs({instance}.{name})` to observe that it takes the event",
            )
        else:
            known = [*values, *(o.name for o in chart.operations)]
            known += names_of_events(chart, Direction.OUT)
            self._unknown(f"`{instance}` has nothing to watch called", name, known)

    def _event(
        self,
        machine: int,
        port: int,
        sent: tuple[Field, ...],
        source: Text,
        target: Text,
        text: Text,
    ) -> None:
        chart = self.monitor.chart
        number = chart.event_index.get(target.value)
        if number is None or Direction.IN not in chart.events[number].directions:
            known = names_of_events(chart, Direction.IN)
            self._unknown(f"`{chart.name}` waits for no event", target, known)
            return
        wanted = chart.events[number].fields
        arguments = arguments_of(sent, wanted, source, target, self.findings)
        key = machine, port, number
        if arguments is None or self._is_repeated(text, self.events.get(key)):
            return
        self.events[key] = EventLink(machine, port, 0, number, arguments), text

    def _value(self, machine: int, name: Text, type_: Type, target: Text, text: Text) -> None:
        chart = self.monitor.chart
        inputs = [declared.name for declared in chart.inputs]
        if target.value not in inputs:
            self._unknown(f"`{chart.name}` has no input", target, inputs)
            return
        number = inputs.index(target.value)
        reason = type_mismatch(type_, chart.inputs[number].type)
        if reason is not None:
            message = f"`{name}` does not fit `{target}`: {reason}"
            self.findings.add("connection-mismatch", message, target)
            return
        if not self._is_repeated(text, self.inputs.get(number)):
            links = tuple(self._wires(machine, name.value, number))
            self.inputs[number] = links, text

    def _wires(self, machine: int, name: str, number: int) -> Iterator[InputLink]:
        """Yield the wires of a variable; a shared one has a wire from each machine with a copy."""
        watched = self.machines[machine]
        if any(slot.name == name for slot in watched.shared):
            for source, other in enumerate(self.machines):
                for place, slot in enumerate(other.shared):
                    if slot.name == name:
                        yield InputLink(source, len(other.chart.outputs) + place, 0, number)
            return
        chart = watched.chart
        outputs = [output.name for output in chart.outputs]
        if name in outputs:
            yield InputLink(machine, outputs.index(name), 0, number)
            return
        place = [data.name for data in chart.data].index(name)
        yield InputLink(machine, len(outputs) + len(watched.shared) + place, 0, number)

    def _is_repeated(self, text: Text, first: tuple[object, Text] | None) -> bool:
        if first is not None:
            report_duplicate("watched", text, first[1], self.findings)
        return first is not None

    def _unknown(self, what: str, name: Text, known: Iterable[str]) -> None:
        names = list(known)
        some = f"use one of {', '.join(f'`{n}`' for n in names[:8])}" if names else None
        help_ = suggest(name.value, names, some)
        self.findings.add("unknown-name", f"{what} `{name}`", name, help=help_)


def read(name: Text, node: Node, reading: PropertyContext) -> Property | None:
    """Read a property that is a monitor, and add the monitor; None after a finding."""
    machines, findings = reading.machines, reading.findings
    parts = require_record(node, MONITOR, f"the property `{name}`", findings)
    if parts is None:
        return None
    machine = read_machine(name, parts["monitor"], reading.folder, findings, strict=reading.strict)
    if machine is None:
        return None
    if any(machine.name == other.name for other in machines):
        findings.add(
            "duplicate-name", f"there is a machine `{name}`", name, help="rename the property"
        )
    _require_fit(machine, name, findings)
    watch = _Watch(machines, machine, findings)
    for text in texts_of(parts.get("watch"), "`watch`", "what is watched", findings):
        named = text if reading.own is None else in_watch(text, machines[reading.own])
        for one in expand_indices(named, machines):
            watch.read(one)
    events = tuple(link for link, _ in watch.events.values())
    inputs = tuple(link for links, _ in watch.inputs.values() for link in links)
    fed = [(link.target, link.input) for link in inputs]
    report_unconnected((machine,), events, fed, (), findings)
    watching = replace(machine, environment=True, is_monitor=True)
    reading.monitors.append(Monitor(name.value, watching, events, inputs))
    text_of = f"`{machine.chart.name}` never comes to `{ERROR}`"
    return Property(name.value, KIND, text_of, span=name.span)


KIND = Kind("monitor", AtStates(), read=read, is_local=True)


def _require_fit(machine: Machine, name: Text, findings: Findings) -> None:
    """Report a chart that is not a monitor: without an error state, or with choices of its own."""
    chart = machine.chart
    if ERROR not in chart.state_index:
        findings.add(
            "monitor-without-error",
            f"`{chart.name}` has no state `{ERROR}`, which a monitor must not reach",
            name,
            help=f"call the state that means a violation `{ERROR}`",
        )
    chosen = [f"the result of `{o.name}`" for o in chart.operations if o.result is not None]
    chosen += ["a delay" for t in chart.transitions if t.least is not None]
    chosen += ["a transition" for t in chart.transitions if t.trigger is Trigger.SOMETIMES]
    if chosen:
        findings.add(
            "monitor-that-chooses",
            f"{chosen[0]} of the monitor `{name}` is nondeterministic",
            name,
            help="make its reaction to each observed event unique",
        )


def require_few(monitors: tuple[Monitor, ...], machines: int, findings: Findings) -> None:
    """Report more machines, monitors included, than can be explored."""
    if monitors and machines + len(monitors) > MOST_ELEMENTS:
        findings.add(
            "not-explored-yet",
            f"{machines} machines and {len(monitors)} monitors are too many to explore",
            monitors[0].machine.span,
            help=f"keep to {MOST_ELEMENTS}",
        )


# --- in an exploration ----------------------------------------------------------------------------


def with_monitors(system: System) -> System:
    """Return a system in which the monitors are machines, after all others."""
    first = len(system.machines)
    numbers = {monitor.property: first + n for n, monitor in enumerate(system.monitors)}
    watching = [(first + n, monitor) for n, monitor in enumerate(system.monitors)]
    return replace(
        system,
        machines=(*system.machines, *(monitor.machine for monitor in system.monitors)),
        event_links=(
            *system.event_links,
            *(replace(link, target=n) for n, m in watching for link in m.event_links),
        ),
        input_links=(
            *system.input_links,
            *(replace(link, target=n) for n, m in watching for link in m.input_links),
        ),
        properties=tuple(
            _monitored_property(
                p, system.monitors[numbers[p.name] - first].machine.chart, numbers[p.name]
            )
            if p.kind is KIND and p.name in numbers
            else p
            for p in system.properties
        ),
        monitors=(),
    )


def _monitored_property(property_: Property, chart: Chart, number: int) -> Property:
    """Return a property that is violated in the error states of its monitor, by number."""
    state = chart.states[chart.state_index[ERROR]]
    condition = Variable(ERROR, BOOL, Storage.DATA, state.span)
    atoms = ((ERROR, Atom(number, state.index)),)
    return replace(property_, condition=condition, atoms=atoms)


def error_states(machine: Machine) -> frozenset[int]:
    """Return the error states of a monitor; an empty set for another machine."""
    number = machine.chart.state_index.get(ERROR)
    if number is None or not machine.is_monitor:
        return frozenset()
    chart = machine.chart
    below = (s.index for s in chart.states if number in chart.ancestors(s.index))
    return frozenset((number, *below))


def sampling_event(chart: Chart) -> int | None:
    """Return the number of the event on which a monitor samples its inputs, if it has one."""
    last = chart.events[-1] if chart.events else None
    return last.index if last is not None and last.name == CHANGED else None


def observer_chart(chart: Chart) -> Chart:
    """Return a monitor's chart with one more event, on which it samples its inputs."""
    event = Event(len(chart.events), CHANGED, (), frozenset({Direction.IN}))
    return replace(chart, events=(*chart.events, event))
