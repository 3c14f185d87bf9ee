"""Read the connections of a system file, ``feeder.pushed -> molder.pushed``, and check types."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from fsmkit.chart.chart import Chart, Event
from fsmkit.chart.statements import Raise, Send
from fsmkit.diagnostics import Findings, Fix, Text
from fsmkit.diagnostics.fixes import add_nested_items, remove_entry, replace_text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.document import Direction
from fsmkit.language import ArrayType, EnumType, Field, IntType, RecordType, SymbolType, Type
from fsmkit.language.walk import nodes
from fsmkit.system.channels import DIRECT, ChannelOptions, channel, read_options
from fsmkit.system.indices import INDEXED, canonical_name, expand_indices
from fsmkit.system.machine import EventLink, InputLink, Machine, operation_port
from fsmkit.system.unconnected_ports import connecting
from fsmkit.yaml.nodes import Mapping, Node, Scalar, items_of

END = re.compile(rf"\s*({INDEXED})\s*\.\s*([A-Za-z_][\w.]*)\s*")
ENDS = re.compile(r"\s*([\w.[\]]+?)\s*([^\w.[\]]+)\s*([\w.[\]]+)\s*")
EXAMPLE = "write `feeder.pushed -> molder.pushed`"


@dataclass(frozen=True, slots=True)
class Links:
    """All wires."""

    events: tuple[EventLink, ...]
    inputs: tuple[InputLink, ...]
    machines: tuple[Machine, ...] = ()
    """The machines that model connections, to follow all others."""


@dataclass(frozen=True, slots=True)
class _End:
    """One end of a connection: a machine and a name in it, each with its location."""

    machine: int
    name: Text


@dataclass(slots=True)
class _Connector:
    machines: tuple[Machine, ...]
    findings: Findings
    events: dict[tuple[int, int, int, int], tuple[EventLink, Text]] = field(default_factory=dict)
    inputs: dict[tuple[int, int], tuple[InputLink, Text]] = field(default_factory=dict)

    options: dict[tuple[int, int, int, int], ChannelOptions] = field(default_factory=dict)

    def connect(self, text: Text, options: ChannelOptions) -> None:
        """Read one connection."""
        left, arrow, _ = text.value.partition("->")
        if not arrow:
            message, wanted = "a connection needs `->`", _with_ascii_arrow(text.value)
            self.findings.add(
                "broken-connection", message, text,
                help=f"write `{wanted}`" if wanted else EXAMPLE,
                fixes=replace_text(text, wanted) if wanted else (),
            )  # fmt: skip
            return
        source = self._end(text.part(0, len(left)))
        target = self._end(text.part(len(left) + 2, len(text.value)))
        if source is None or target is None:
            return
        chart = self.machines[source.machine].chart
        if any(output.name == source.name.value for output in chart.outputs):
            self._value(source, target, text)
            if options != DIRECT:
                self.findings.add(
                    "connection-mismatch",
                    "an output is a level: it cannot be queued, delayed or lost",
                    text,
                    help="send an event, or remove the options",
                )
            return
        port = self._port(source)
        if port is not None:
            self._message(source, target, *port, text, options)

    def _end(self, text: Text) -> _End | None:
        match = END.fullmatch(text.value)
        if match is None:
            self.findings.add(
                "broken-connection",
                "an end of a connection is `machine.name`",
                text.strip(),
                help=f"{EXAMPLE}; write one connection for each pair of ends",
            )
            return None
        machine = find_machine(text.part(*match.span(1)), self.machines, self.findings)
        return None if machine is None else _End(machine, text.part(*match.span(2)))

    def _port(self, end: _End) -> tuple[int, tuple[Field, ...]] | None:
        """Return the port of a source and the fields that it sends."""
        machine = self.machines[end.machine]
        chart = machine.chart
        found = port_of(chart, end.name.value)
        if found is None:
            known = [*names_of_events(chart, Direction.OUT), *(o.name for o in chart.operations)]
            known += [o.name for o in chart.outputs]
            self._report_missing(machine, end.name, "leaves", known)
        return found

    def _report_missing(
        self, machine: Machine, name: Text, verb: str, known: Iterable[str]
    ) -> None:
        chart, what, declare = machine.chart, "", "declare it in the chart"
        if name.value in chart.event_index:
            what = " (it is an event of another direction)"
            declare = "swap the ends, or declare it under the other direction in the chart"
        elif any(d.name == name.value for d in (*chart.data, *chart.inputs, *chart.outputs)):
            what = " (it is a variable of another kind)"
            declare = "connect an output to an input, an event or an operation to an event"
        self.findings.add(
            "unknown-name",
            f"no `{name}` {verb} `{machine.name}`{what}",
            name,
            help=suggest(name.value, known, declare),
        )

    def _message(
        self,
        source: _End,
        target: _End,
        port: int,
        sent: tuple[Field, ...],
        text: Text,
        options: ChannelOptions,
    ) -> None:
        machine = self.machines[target.machine]
        chart = machine.chart
        index = chart.event_index.get(target.name.value)
        if index is None or Direction.IN not in chart.events[index].directions:
            known = names_of_events(chart, Direction.IN)
            self._report_missing(machine, target.name, "enters", known)
            return
        wanted = chart.events[index].fields
        arguments = arguments_of(sent, wanted, source.name, target.name, self.findings)
        if arguments is None:
            return
        key = (source.machine, port, target.machine, index)
        if key in self.events:
            report_duplicate("connected", text, self.events[key][1], self.findings)
            return
        rank = options.priority
        link = EventLink(source.machine, port, target.machine, index, arguments, rank)
        self.events[key] = link, text
        fields = chart.events[index].fields
        if not options.is_direct and any(isinstance(part.type, SymbolType) for part in fields):
            self.findings.add(
                "connection-mismatch",
                f"`{target.name}` carries strings, which only direct connections can carry",
                target.name,
                help="declare an enumeration",
            )
            return
        self.options[key] = options

    def _value(self, source: _End, target: _End, text: Text) -> None:
        writer, reader = self.machines[source.machine], self.machines[target.machine]
        output = [o.name for o in writer.chart.outputs].index(source.name.value)
        inputs = [i.name for i in reader.chart.inputs]
        if target.name.value not in inputs:
            self._report_missing(reader, target.name, "is an input of", inputs)
            return
        place = inputs.index(target.name.value)
        reason = type_mismatch(writer.chart.outputs[output].type, reader.chart.inputs[place].type)
        if reason is not None:
            self.findings.add(
                "connection-mismatch",
                f"`{source.name}` does not fit `{target.name}`: {reason}",
                target.name,
                help="give both ends types of which the writer's fits the reader's",
            )
            return
        key = (target.machine, place)
        if key in self.inputs:
            report_duplicate("connected", text, self.inputs[key][1], self.findings)
            return
        self.inputs[key] = InputLink(source.machine, output, target.machine, place), text


def names_of_events(chart: Chart, direction: Direction) -> list[str]:
    """Return the names of the events that go in a direction."""
    return [event.name for event in chart.events if direction in event.directions]


def port_of(chart: Chart, name: str) -> tuple[int, tuple[Field, ...]] | None:
    """Return the port of an operation or of an event, and the fields that it carries."""
    for operation in chart.operations:
        if operation.name == name:
            return operation_port(chart, name), operation.parameters
    index = chart.event_index.get(name)
    if index is None or Direction.OUT not in chart.events[index].directions:
        return None
    return index, chart.events[index].fields


def arguments_of(
    sent: tuple[Field, ...],
    wanted: tuple[Field, ...],
    source: Text,
    target: Text,
    findings: Findings,
) -> tuple[int, ...] | None:
    """Match the fields of the receiver with the fields of the sender: by name, else by position."""
    names = [part.name for part in sent]
    if all(part.name in names for part in wanted):
        places = [names.index(part.name) for part in wanted]
    elif len(sent) == len(wanted):
        places = list(range(len(sent)))
    else:
        findings.add(
            "connection-mismatch",
            f"`{target}` carries {_fields_text(wanted)}, but `{source}` gives {_fields_text(sent)}",
            target,
            help="give both the same fields",
        )
        return None
    for place, part in zip(places, wanted, strict=True):
        reason = type_mismatch(sent[place].type, part.type)
        if reason is not None:
            findings.add(
                "connection-mismatch",
                f"`{sent[place].name}` of `{source}` does not fit `{part.name}` of "
                f"`{target}`: {reason}",
                target,
                help="give both ends types of which the sender's fits the receiver's",
            )
            return None
    return tuple(places)


def connect(
    node: Node | None,
    machines: tuple[Machine, ...],
    possible: Iterable[tuple[int, int]],
    free: Iterable[tuple[int, int]],
    findings: Findings,
) -> Links:
    """Read all connections, and report unconnected ports.

    ``possible``: the external events, by machine and number. ``free``: the inputs that the
    environment sets.
    """
    connector = _Connector(machines, findings)
    for item in items_of(node, "`connect`", findings):
        if (found := _connection(item, machines, findings)) is not None:
            for one in expand_indices(found[0], machines):
                connector.connect(one, found[1])
    channels, events = _with_channels(connector)
    inputs = tuple(link for link, _ in connector.inputs.values())
    report_unconnected(
        machines, events, (*((i.target, i.input) for i in inputs), *free), possible, findings
    )
    return Links(events, inputs, channels)


def _with_channels(connector: _Connector) -> tuple[tuple[Machine, ...], tuple[EventLink, ...]]:
    """Return the machines that model connections, and all wires, including theirs."""
    channels: list[Machine] = []
    events: list[EventLink] = []
    for key, (link, text) in connector.events.items():
        options = connector.options.get(key, DIRECT)
        if options.is_direct:
            events.append(link)
            continue
        number = len(connector.machines) + len(channels)
        machine, *wires = channel(link, options, connector.machines, number, text.span)
        channels.append(machine)
        events += wires
    return tuple(channels), tuple(events)


def _connection(
    item: Node, machines: tuple[Machine, ...], findings: Findings
) -> tuple[Text, ChannelOptions] | None:
    if isinstance(item, Scalar):
        return item.text, DIRECT
    if not isinstance(item, Mapping) or len(item.entries) != 1:
        findings.add("broken-connection", "a connection is one line", item.span, help=EXAMPLE)
        return None
    text, options = item.entries[0]
    if isinstance(options, Scalar) and options.text.value and "->" not in text.value:
        findings.add(
            "broken-connection", "a connection needs `->`, not `:`", text,
            help=f"write `- {text} -> {options.text}`",
        )  # fmt: skip
        return None
    if isinstance(options, Scalar) and not options.text.value and "->" in text.value:
        findings.add(
            "broken-connection",
            "a connection is a text: write it without braces",
            item.span,
            help=f"write `- {text}`; options are `{{{text}: {{kind: queued}}}}`",
            fixes=replace_text(item.span, text.value, sure=True),
        )
        return None
    found = read_options(options, tick_of(machines), findings)
    return None if found is None else (text, found)


def _with_ascii_arrow(text: str) -> str:
    """Replace another arrow sign in a connection by ``->``; return "" if there is no such sign."""
    found = ENDS.fullmatch(text)
    if found is None:
        return ""
    first, sign, second = found.groups()
    return f"{second} -> {first}" if "<" in sign else f"{first} -> {second}"


def report_duplicate(verb: str, text: Text, first: Text, findings: Findings) -> None:
    """Report a repeated connection."""
    findings.add(
        "duplicate-connection",
        f"this is {verb} already",
        text,
        secondary=[(first, "first here")],
        help="remove one of them",
        fixes=remove_entry(text),
    )


def tick_of(machines: tuple[Machine, ...]) -> int:
    """Return the tick of a system in microseconds; it is the same for all machines."""
    return machines[0].chart.capacities.tick


def find_machine(name: Text, machines: tuple[Machine, ...], findings: Findings) -> int | None:
    """Return the number of a machine; None after a finding."""
    names = [machine.name for machine in machines]
    full = canonical_name(name, findings)
    if full in names:
        return names.index(full)
    if full is not None:
        help_ = suggest(full, names, "name it under `machines`")
        if any(machine.place is not None and machine.place[0] == full for machine in machines):
            help_ = f"`{full}` is an array: write `{full}[0]` for one, `{full}[i]` for all"
        findings.add("unknown-name", f"there is no machine `{full}`", name, help=help_)
    return None


def type_mismatch(sent: Type, wanted: Type) -> str | None:
    """Return why a value of one type does not fit another; None if it does."""
    match sent, wanted:
        case ((ArrayType() | RecordType()), _):
            return "arrays and records are not connected yet"
        case IntType(), IntType():
            fits = wanted.lo <= sent.lo and sent.hi <= wanted.hi
        case EnumType(), EnumType():
            fits = (sent.members, sent.numbers) == (wanted.members, wanted.numbers)
        case _:
            fits = sent == wanted
    return None if fits else f"`{sent}` into `{wanted}`"


def _fields_text(fields: tuple[Field, ...]) -> str:
    return "(" + ", ".join(f"{part.name} {part.type}" for part in fields) + ")"


def report_unconnected(
    machines: tuple[Machine, ...],
    events: tuple[EventLink, ...],
    inputs: Iterable[tuple[int, int]],
    possible: Iterable[tuple[int, int]],
    findings: Findings,
    *,
    is_alone: bool = False,
) -> None:
    """Report unconnected inputs and events; targets are indices of ``machines``.

    ``inputs``: the connected or free inputs. ``possible``: the external events. ``is_alone``: the
    only machine is a chart with an environment of its own.
    """
    fed = set(inputs)
    come = {(link.target, link.event) for link in events}
    come |= set(possible)
    for index, machine in enumerate(machines):
        dry = [v.name for n, v in enumerate(machine.chart.inputs) if (index, n) not in fed]
        if dry:
            findings.add(
                "unconnected-input",
                f"nothing drives {format_names(dry)} of `{machine.name}`: the start value stays",
                machine.span,
                help=f"name it: `may: [{dry[0]}]`"
                if is_alone
                else f"connect an output to it, or name it: `may: [{machine.name}.{dry[0]}]`",
                fixes=(
                    *_fix_allowing(machine, dry, is_alone=is_alone),
                    *connecting(machines, events, index, dry, are_inputs=True),
                ),
            )
        awaited = _awaited_events(machine.chart)
        silent = [event.name for event in awaited if (index, event.index) not in come]
        if silent:
            findings.add(
                "unconnected-event",
                f"nothing sends {format_names(silent)} to `{machine.name}`: it never comes",
                machine.span,
                help="name it under `environment`"
                if is_alone
                else "connect it, or name it under `environment`",
                fixes=(
                    *_fix_allowing(machine, silent, is_alone=is_alone),
                    *connecting(machines, events, index, silent, are_inputs=False),
                ),
            )


def _fix_allowing(machine: Machine, names: Iterable[str], *, is_alone: bool) -> tuple[Fix, ...]:
    """Return the fix that lets inputs change, or events occur, at any time."""
    if machine.span is None or machine.place is not None:
        return ()
    items = [name if is_alone else f"{machine.name}.{name}" for name in names]
    edits = add_nested_items(machine.span.source, "environment", "may", items)
    return (Fix(f"Name {format_names(items)} under `may`", edits),) if edits else ()


def _awaited_events(chart: Chart) -> Iterator[Event]:
    used = {event for transition in chart.transitions for event in transition.events}
    raised = {
        n.event
        for n in nodes((chart.states, chart.transitions, chart.script))
        if isinstance(n, Raise | Send)
    }
    for event in chart.events:
        if Direction.IN in event.directions and event.index in used - raised:
            yield event


def format_names(names: Iterable[str]) -> str:
    """Return names in backticks, separated by commas."""
    return ", ".join(f"`{name}`" for name in names)
