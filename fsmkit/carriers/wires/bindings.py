"""Read the bindings of a board's signals to its machines: inputs, events, operations, outputs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from fsmkit.carriers.wires import keys as wire_keys
from fsmkit.carriers.wires.board import (
    Bit,
    BoundEvent,
    BoundInput,
    BoundPort,
    BoundSignal,
    Device,
    Edge,
    Formula,
    Notice,
    Query,
    Signal,
)
from fsmkit.carriers.wires.formulas import CALLED, FormulaReader
from fsmkit.chart.analysis.host_events import sent_events
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings, Severity, Span, Text
from fsmkit.diagnostics.fixes import remove_entry
from fsmkit.diagnostics.split_text import split_outside
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.document import Direction
from fsmkit.language import BOOL, Type
from fsmkit.system.deployment.deployment import Deployment
from fsmkit.system.machine import operation_port, port_fields, port_name
from fsmkit.yaml.nodes import Mapping as Entries
from fsmkit.yaml.nodes import Node, check_keys, entries_of, require_text
from fsmkit.yaml.nodes import Sequence as Items

EVENT = re.compile(r"\s*([A-Za-z_][\w.]*)\s*(?:\((.*)\))?\s*", re.DOTALL)
FIELD = re.compile(r"\s*([A-Za-z_]\w*)\s*=(?!=)")
EDGES = {"rising": Edge.RISING, "falling": Edge.FALLING, "changed": Edge.CHANGED}
EXAMPLE = "write `{rising: signal}`, `{falling: signal}`, `{changed: signal}` or `{while: signal}`"


@dataclass(frozen=True)
class Needs:
    """The unconnected ports of a machine. ``fed``: events that other machines send."""

    inputs: frozenset[int]
    events: frozenset[int]
    ports: frozenset[int]
    fed: frozenset[int]


def needs_of(deployment: Deployment, machine: int) -> Needs:
    """Return the ports of a machine that a board must bind."""
    whole, placed = deployment.system, deployment.placed
    chart = whole.machines[machine].chart
    driven = {
        link.input
        for link in whole.input_links
        if link.target == machine and placed[link.source] is not None
    }
    fed = {
        link.event
        for link in whole.event_links
        if link.target == machine and placed[link.source] is not None
    }
    beyond: dict[int, set[bool]] = {}
    for link in whole.event_links:
        if link.source == machine:
            beyond.setdefault(link.port, set()).add(placed[link.target] is not None)
    leaving = set(sent_events(chart))
    leaving |= {operation_port(chart, operation.name) for operation in chart.operations}
    return Needs(
        frozenset(range(len(chart.inputs))) - driven,
        frozenset(e.index for e in chart.events if Direction.IN in e.directions) - fed,
        frozenset(port for port in leaving if beyond.get(port) != {True}),
        frozenset(fed),
    )


@dataclass
class BindingReader:
    """Reads bindings; mind the findings."""

    reader: FormulaReader
    inputs: list[BoundInput] = field(default_factory=list)
    events: list[BoundEvent] = field(default_factory=list)
    ports: list[BoundPort] = field(default_factory=list)
    following: list[BoundSignal] = field(default_factory=list)
    driven: dict[int, tuple[object, Span]] = field(default_factory=dict)
    """By output or flag: who drives it, and where that is written."""

    @property
    def findings(self) -> Findings:
        """The findings so far."""
        return self.reader.findings

    @property
    def deployment(self) -> Deployment:
        """The deployment of the board."""
        return self.reader.deployment

    @property
    def signals(self) -> tuple[Signal, ...]:
        """The signals of the board."""
        return self.reader.signals

    # --- who drives an output ---------------------------------------------------------------------

    def drives(self, number: int, driver: object, at: Span) -> bool:
        """Record the driver of an output or a flag; False after a finding."""
        signal = self.signals[number]
        if signal.is_input:
            self.findings.add(
                "unfit-wire",
                f"`{signal.name}` is an input: the board does not write it",
                at,
                secondary=[] if signal.span is None else [(signal.span, "declared here")],
                help="name an output or a flag",
            )
            return False
        first, place = self.driven.setdefault(number, (driver, at))
        if first != driver or signal.is_of_host:
            self.findings.add(
                "wire-used-twice",
                f"`{signal.name}` has two drivers",
                at,
                secondary=[(place, "here")] if first != driver else [],
                help="let one of them drive it, or combine both in one expression under `set`",
            )
            return False
        return True

    # --- machines ---------------------------------------------------------------------------------

    def machines(self, node: Node | None) -> None:
        """Read all bindings of machines."""
        system = self.deployment.system
        own = {
            str(machine.name): number
            for number, machine in enumerate(system.machines)
            if self.deployment.placed[number] == self.reader.node
        }
        found: dict[int, tuple[Text, tuple[tuple[Text, Node], ...]]] = {}
        for name, value in entries_of(node, "`bind`", self.findings):
            if name.value not in own:
                self.findings.add(
                    "unknown-name",
                    f"no machine `{name}` runs on this board",
                    name,
                    help=suggest(name.value, own, "name a machine of the node"),
                )
                continue
            what = f"the bindings of `{name}`"
            found[own[name.value]] = name, entries_of(value, what, self.findings)
        for number in own.values():
            name_, entries = found.get(number, (None, ()))
            self._machine(number, name_, entries)

    def _machine(
        self, number: int, name: Text | None, entries: tuple[tuple[Text, Node], ...]
    ) -> None:
        machine = self.deployment.system.machines[number]
        needs = needs_of(self.deployment, number)
        self.reader.chart = machine.chart
        bound: dict[str, set[int]] = {"input": set(), "event": set(), "port": set()}
        for key, value in entries:
            kind, index = self._binding(number, key, value, needs)
            if kind:
                bound[kind].add(index)
        self.reader.chart = None
        at = machine.span if name is None else name.span
        self._report_unbound(machine.chart, needs, bound, str(machine.name), at)

    def _report_unbound(
        self, chart: Chart, needs: Needs, bound: Mapping[str, set[int]], name: str, at: Span | None
    ) -> None:
        inputs = [chart.inputs[n].name for n in sorted(needs.inputs - bound["input"])]
        events = [chart.events[n].name for n in sorted(needs.events - bound["event"])]
        ports = [port_name(chart, n) for n in sorted(needs.ports - bound["port"])]
        for names, why, severity in (
            (inputs, "keep their start value", Severity.WARNING),
            (events, "never come", Severity.WARNING),
            (ports, "are defined nowhere", Severity.ERROR),
        ):
            if names:
                self.findings.add(
                    "unbound-wire",
                    f"nothing binds {', '.join(f'`{each}`' for each in names)} of `{name}`: they "
                    f"{why}",
                    at,
                    help="bind them; write `nothing` if intended, or `host` if the program of "
                    "the board does it",
                    severity=severity,
                )

    def _binding(self, machine: int, key: Text, node: Node, needs: Needs) -> tuple[str, int]:
        """Read a line; return the kind and the number of the bound port."""
        chart = self.deployment.system.machines[machine].chart
        match = EVENT.fullmatch(key.value)
        name = "" if match is None else match[1]
        inputs = [variable.name for variable in chart.inputs]
        outputs = [variable.name for variable in chart.outputs]
        operations = [operation.name for operation in chart.operations]
        event = chart.event_index.get(name)
        if match is not None and match[2] is None:
            if name in inputs:
                number = inputs.index(name)
                if self._is_free(number in needs.inputs, key):
                    self._input(machine, number, key, node)
                return "input", number
            if name in outputs:
                self._output(machine, name, key, node)
                return "", 0
            if name in operations:
                port = operation_port(chart, name)
                if self._is_free(port in needs.ports, key):
                    self._port(machine, port, key, node)
                return "port", port
        if event is not None and match is not None:
            directions = chart.events[event].directions
            if Direction.IN in directions:
                for each in node.items if isinstance(node, Items) else (node,):
                    self._event(machine, event, match, key, each)
                return "event", event
            if Direction.OUT in directions and match[2] is None:
                is_sent = event in sent_events(chart)  # otherwise C has no function for it
                if is_sent and self._is_free(event in needs.ports, key):
                    self._port(machine, event, key, node)
                return "port", event
        known = [*inputs, *outputs, *operations, *(e.name for e in chart.events if e.directions)]
        self.findings.add(
            "unknown-name",
            f"`{self.deployment.system.machines[machine].name}` has nothing to bind named `{key}`",
            key,
            help=suggest(name, known, "name an input, an output, an event or an operation"),
        )
        return "", 0

    def _is_free(self, is_needed: bool, key: Text) -> bool:
        """Report a binding of a connected port."""
        if not is_needed:
            self.findings.add(
                "wire-used-twice",
                f"`{key}` is connected to another machine already",
                key,
                help="remove one of them",
            )
        return is_needed

    def _word(self, node: Node) -> str:
        """Return ``nothing`` or ``host`` if it is written."""
        text = None if isinstance(node, (Entries, Items)) else require_text(node, "", self.findings)
        return text.value if text is not None and text.value in ("nothing", "host") else ""

    # --- inputs, outputs --------------------------------------------------------------------------

    def _input(self, machine: int, number: int, key: Text, node: Node) -> None:
        if self._word(node):
            return
        variable = self.deployment.system.machines[machine].chart.inputs[number]
        origin = self.reader.origin(node, variable.type, f"`{key}`", variable.span)
        if origin is not None:
            self.inputs.append(BoundInput(machine, number, origin))

    def _output(self, machine: int, name: str, key: Text, node: Node) -> None:
        """Read ``output: signal``: the signal follows the output."""
        text = require_text(node, f"`{key}`", self.findings)
        number = None if text is None else self.reader.signal(text)
        if text is None or number is None:
            return
        written = key.part(0, len(key.value)).with_value(
            f"{self.deployment.system.machines[machine].name}.{name}"
        )
        signal = self.signals[number]
        formula = self.reader.formula(written, signal.type, f"`{signal.name}` is", signal.span)
        if formula is not None and self.drives(number, key.span, key.span):
            self.following.append(BoundSignal(number, formula))

    # --- events -----------------------------------------------------------------------------------

    def _event(self, machine: int, event: int, match: re.Match[str], key: Text, node: Node) -> None:
        if self._word(node):
            return
        values = self._values(machine, event, match, key)
        if not isinstance(node, Entries):
            text = require_text(node, f"`{key}`", self.findings)
            watched = None if text is None else self.reader.formula(text, BOOL, f"`{key}` is")
            if watched is None or values is None:
                return
            if not all(isinstance(meaning, Notice) for meaning in watched.meanings.values()):
                self.findings.add(
                    "unexpected-shape", f"when is `{key}` posted?", text, help=EXAMPLE
                )
                return
            self.events.append(BoundEvent(machine, event, Edge.ALWAYS, watched, None, values))
            return
        parts = {each.value: value for each, value in node.entries}
        condition = None
        if "while" in parts:
            text = require_text(parts["while"], "`while`", self.findings)
            condition = None if text is None else self.reader.formula(text, BOOL, "`while` is")
            if condition is None:
                return
        found = self._watched(node, parts, key, condition)
        if found is None or values is None:
            return
        edge, watched_bit = found
        rest = None if watched_bit is condition else condition
        self.events.append(BoundEvent(machine, event, edge, watched_bit, rest, values))

    def _watched(
        self, node: Entries, parts: Mapping[str, Node], key: Text, condition: Formula | None
    ) -> tuple[Edge, Bit] | None:
        """Return the watched value, and its edge."""
        given = [name for name in EDGES if name in parts]
        if given:
            check_keys(node, wire_keys.TRIGGERS, f"`{key}`", self.findings)
            if len(given) > 1:
                self.findings.add(
                    "unexpected-shape", f"`{key}` has two edges", node.span,
                    help="make a list of two: `[{rising: a}, {falling: b}]`",
                )  # fmt: skip
                return None
            text = require_text(parts[given[0]], f"`{given[0]}`", self.findings)
            edge = EDGES[given[0]]
            wanted: Type | None = BOOL
            if text is not None and edge is Edge.CHANGED:
                number = self.reader.signal(text)
                if number is None:
                    return None
                wanted = self.signals[number].type
            what = f"`{given[0]}` is"
            found = None if text is None else self.reader.formula(text, wanted, what)
            return None if found is None else (edge, found)
        rest = tuple((name, value) for name, value in node.entries if name.value != "while")
        if not rest:
            if condition is None:
                self.findings.add(
                    "unexpected-shape", f"when is `{key}` posted?", node.span, help=EXAMPLE
                )
                return None
            return Edge.ALWAYS, condition
        bit = self.reader.bit(Entries(rest, node.span), f"`{key}`")
        if bit is None:
            return None
        return (Edge.ALWAYS if isinstance(bit, Formula | Query) else Edge.RISING), bit

    def _values(
        self, machine: int, event: int, match: re.Match[str], key: Text
    ) -> tuple[Formula, ...] | None:
        """Return the fields that an event is posted with: ``fault(code = Fault.sensor)``."""
        declared = self.deployment.system.machines[machine].chart.events[event]
        given: dict[str, Text] = {}
        if match[2] is not None and match[2].strip():
            for part in split_outside(key.part(*match.span(2)), ","):
                name = FIELD.match(part.value)
                if name is None:
                    self.findings.add(
                        "unexpected-shape", f"`{part}` gives no field a value", part,
                        help="write `name = value`",
                    )  # fmt: skip
                    return None
                given[name[1]] = part.part(name.end(), len(part.value)).strip()
        names = [field_.name for field_ in declared.fields]
        missing = [str(name) for name in names if name not in given]
        unknown = [name for name in given if name not in names]
        if missing or unknown:
            which = missing[0] if missing else unknown[0]
            self.findings.add(
                "wrong-arguments",
                f"`{declared.name}` has {'' if missing else 'no '}a field `{which}`"
                if missing
                else f"`{declared.name}` has no field `{which}`",
                key,
                help=f"write `{declared.name}({', '.join(f'{n} = value' for n in names)})`"
                if names
                else f"write `{declared.name}`",
            )
            return None
        found = [
            self.reader.formula(given[each.name], each.type, f"`{each.name}` is", declared.span)
            for each in declared.fields
        ]
        values = tuple(value for value in found if value is not None)
        return values if len(values) == len(found) else None

    # --- outgoing events and operations ----------------------------------------------------------

    def _port(self, machine: int, port: int, key: Text, node: Node) -> None:
        word = self._word(node)
        if word:
            if word == "nothing":
                self._nothing(machine, port, key)
            return
        chart = self.deployment.system.machines[machine].chart
        self.reader.parameters = port_fields(chart, port)
        try:
            bound = self._leaving(machine, port, key, node)
        finally:
            self.reader.parameters = ()
        if bound is not None:
            self.ports.append(bound)

    def _nothing(self, machine: int, port: int, key: Text) -> None:
        if self._result(machine, port) is not None:
            self.findings.add(
                "unfit-wire", f"`{key}` returns a value: `nothing` has none", key,
                help="name a signal, or a function of a device",
            )  # fmt: skip
            return
        self.ports.append(BoundPort(machine, port))

    def _result(self, machine: int, port: int) -> Type | None:
        chart = self.deployment.system.machines[machine].chart
        if port < len(chart.events):
            return None
        return chart.operations[port - len(chart.events)].result

    def _leaving(self, machine: int, port: int, key: Text, node: Node) -> BoundPort | None:
        result = self._result(machine, port)
        fields = self.reader.parameters
        if not isinstance(node, Entries):
            text = require_text(node, f"`{key}`", self.findings)
            if text is None:
                return None
            if self.reader.is_call(text):
                match = CALLED.fullmatch(text.value)
                assert match is not None  # noqa: S101  (it is a call)
                device = self.reader.device(text.part(*match.span(1)))
                values = tuple(self._parameter(place) for place in range(len(fields)))
                if device is None:
                    return None
                return BoundPort(machine, port, call=Query(device, match[2], values))
            if result is not None:
                formula = self.reader.formula(text, result, f"`{key}` returns")
                return None if formula is None else BoundPort(machine, port, result=formula)
            return self._assigned(machine, port, key, text)
        check_keys(node, wire_keys.ACTIONS, f"`{key}`", self.findings)
        parts = {each.value: value for each, value in node.entries}
        call = self.reader.query(parts) if "call" in parts else None
        if "call" in parts and call is None:
            return None
        if result is not None and call is None:
            self.findings.add(
                "unfit-wire", f"`{key}` returns a value, and nothing gives it", node.span,
                help="name a signal, or a function of a device",
            )  # fmt: skip
            return None
        sets: list[tuple[int, Formula]] = []
        for name, value in entries_of(parts.get("set"), "`set`", self.findings):
            written = require_text(value, f"`{name}`", self.findings)
            number = self.reader.signal(name)
            if written is None or number is None:
                return None
            signal = self.signals[number]
            formula = self.reader.formula(written, signal.type, f"`{signal.name}` is", signal.span)
            if formula is None or not self.drives(number, machine, name.span):
                return None
            sets.append((number, formula))
        return BoundPort(machine, port, tuple(sets), call)

    def _parameter(self, place: int) -> Formula:
        """Return the value of a parameter as an expression."""
        parameter = self.reader.parameters[place]
        return self.reader.of_parameter(place, parameter)

    def _assigned(self, machine: int, port: int, key: Text, text: Text) -> BoundPort | None:
        """Return ``operation: signal``: the signal becomes the only parameter."""
        number = self.reader.signal(text)
        if number is None:
            return None
        fields = self.reader.parameters
        if len(fields) != 1:
            self.findings.add(
                "unfit-wire",
                f"`{key}` has {len(fields) or 'no'} parameters: which is `{text}`?",
                text,
                help="write `{set: {signal: expression}}`",
            )
            return None
        signal = self.signals[number]
        written = text.with_value(str(fields[0].name))
        formula = self.reader.formula(written, signal.type, f"`{signal.name}` is", signal.span)
        if formula is None or not self.drives(number, machine, text.span):
            return None
        return BoundPort(machine, port, ((number, formula),))

    # --- derived signals -------------------------------------------------------------------------

    def follow(self, node: Node | None) -> None:
        """Read ``set``."""
        for name, value in entries_of(node, "`set`", self.findings):
            number = self.reader.signal(name)
            if number is None:
                continue
            signal = self.signals[number]
            origin: Bit | None
            if signal.type == BOOL:
                origin = self.reader.bit(value, f"`{name}`", signal.span)
            else:
                text = require_text(value, f"`{name}`", self.findings)
                what = f"`{name}` is"
                origin = (
                    None
                    if text is None
                    else self.reader.formula(text, signal.type, what, signal.span)
                )
            if origin is not None and self.drives(number, name.span, name.span):
                self.following.append(BoundSignal(number, origin))

    def devices(self, devices: tuple[Device, ...]) -> None:
        """Record the signals that devices read and write."""
        for number, device in enumerate(devices):
            self.reader.read |= set(device.reads)
            for signal in device.writes:
                self.drives(signal, f"device {number}", device.span)

    def report_unused(self) -> None:
        """Report signals that nothing reads, or nothing drives."""
        for number, signal in enumerate(self.signals):
            is_read = signal.is_output or number in self.reader.read
            is_read |= signal.is_input and signal.is_of_host
            is_driven = signal.is_input or signal.is_of_host or number in self.driven
            if is_read and is_driven:
                continue
            what = "reads" if not is_read else "drives"
            self.findings.add(
                "unused-wire",
                f"nothing {what} `{signal.name}`",
                signal.span,
                help="bind it, or remove it",
                fixes=() if signal.span is None else remove_entry(signal.span),
            )
