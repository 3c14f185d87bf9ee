"""Foreign nodes on a CAN bus: the messages of connections, and their latencies.

A machine of such a node represents the node of the file that has the name of its chart. Its events,
inputs and outputs have the names and types that ``fsmkit convert`` writes into the chart.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fsmkit.carriers.can.chart_of_dbc import names_of_levels, names_of_silence
from fsmkit.carriers.can.dbc import Dbc, Message, Signal, read_dbc, word
from fsmkit.carriers.can.response_times import (
    BITRATE,
    ERROR_EVERY,
    TimedFrame,
    frames_of,
    load_of,
    microseconds,
    response_times,
)
from fsmkit.chart.loading import read_bytes
from fsmkit.diagnostics import Findings, Text
from fsmkit.language import BoolType, EnumType, FloatType, IntType, Scope, Type, read_duration
from fsmkit.system.deployment.delays import Connection, connection_of
from fsmkit.system.indices import integer
from fsmkit.system.machine import EventLink, port_fields, port_name
from fsmkit.system.system import System


@dataclass(frozen=True, slots=True)
class CanTimes:
    """The response times of a bus. ``responses``: for each message, in microseconds."""

    node: str
    load: float
    responses: tuple[tuple[Message, int | None], ...]


@dataclass(frozen=True)
class CanNode:
    """A foreign node on a bus: its file, and the worst-case response times there."""

    dbc: Dbc
    times: CanTimes


def can_node(
    name: str,
    options: Mapping[str, Text],
    folder: Path,
    others: Iterable[TimedFrame],
    findings: Findings,
) -> CanNode | None:
    """Return a foreign node on a bus; None without a file, or after an error.

    ``others``: the frames of nodes of fsmkit on the same bus.
    """
    if "bus" in options:
        report_bus(options["bus"], findings)
    if "dbc" not in options:
        return None
    path = folder / options["dbc"].value
    dbc = read_dbc(path, read_bytes(path, options["dbc"]), findings)
    if dbc is None:
        return None
    bitrate = bitrate_of(options.get("bitrate"), findings)
    errors = error_bits_of(options.get("error_every"), bitrate, findings)
    frames = {(frame.frame, frame.is_extended): frame for frame in frames_of(dbc, bitrate)}
    own = [(message, frames[message.frame, message.is_extended]) for message in dbc.messages]
    node = CanNode(dbc, times_of(name, own, others, bitrate, errors))
    _report_late(node, options["dbc"], findings)
    return node


def report_bus(text: Text, findings: Findings) -> None:
    """Report a name that is neither an interface of a CAN bus nor a multicast group."""
    name = text.value
    group = _GROUP.fullmatch(name)
    if name.lower().startswith("udp") and ":" in name:
        octets = [] if group is None else [int(part) for part in group[1].split(".")]
        port = 0 if group is None else int(group[2])
        if octets and 224 <= octets[0] <= 239 and max(octets) < 256 and 1 <= port < 65536:
            return
        why, fix = "is not a multicast group", "write for instance `udp:239.74.163.2:43113`"
    elif not name or any(each.isspace() or not each.isprintable() for each in name):
        why, fix = "is not an interface of a bus", "name an interface, such as `can0`"
    elif "://" in name:
        why, fix = "is an endpoint, not a bus", "name an interface, such as `can0`"
    else:
        return
    findings.add("broken-deployment", f"`{text}` {why}", text, help=fix)


_GROUP = re.compile(r"udp:((?:\d{1,3}\.){3}\d{1,3}):(\d{1,5})", re.ASCII)


def bitrate_of(text: Text | None, findings: Findings) -> int:
    """Return the bits of a bus per second."""
    if text is None:
        return BITRATE
    number = integer(text, findings)
    if number is not None and not 1000 <= number <= 1_000_000:
        findings.add("unexpected-value", "a bus has 1,000 to 1,000,000 bits per second", text)
        return BITRATE
    return number or BITRATE


def error_bits_of(text: Text | None, bitrate: int, findings: Findings) -> int:
    """Return the minimum number of bits between two errors of a bus."""
    errors = ERROR_EVERY
    if text is not None:
        errors = read_duration(text, Scope(tick=1), findings) or ERROR_EVERY
    return max(1, errors * bitrate // 1_000_000)


def times_of(
    name: str,
    messages: Sequence[tuple[Message, TimedFrame]],
    others: Iterable[TimedFrame],
    bitrate: int,
    error_bits: int,
) -> CanTimes:
    """Return the response times of messages on a bus that also carries ``others``."""
    every = {(frame.frame, frame.is_extended): frame for frame in others}
    every |= {(frame.frame, frame.is_extended): frame for _, frame in messages}
    frames = tuple(every.values())
    responses = response_times(frames, error_bits)
    found: list[tuple[Message, int | None]] = []
    for message, _ in messages:
        bits = responses[message.frame, message.is_extended]
        found.append((message, None if bits is None else microseconds(bits, bitrate)))
    return CanTimes(name, load_of(frames), tuple(found))


def _report_late(node: CanNode, at: Text, findings: Findings) -> None:
    seen = set()
    for message, response in node.times.responses:
        if message.frame in seen:
            continue
        seen.add(message.frame)
        if message.is_fd:
            findings.add(
                "late-message",
                f"`{message.name}` is a frame of CAN FD, whose response times are not computed",
                message.span,
                secondary=[(at, "the file is named here")],
                help="send it as a classical frame",
            )
        elif response is None or (message.cycle and response > message.cycle * 1000):
            late = "has no bound" if response is None else f"is {response} us"
            cycle = f"its cycle is {message.cycle} ms" if message.cycle else "it has no cycle"
            findings.add(
                "late-message",
                f"the response time of `{message.name}` {late}, and {cycle}; the load of the bus "
                f"is {node.times.load:.0%}",
                message.span,
                secondary=[(at, "the file is named here")],
                help="give it a lower identifier, or send less on this bus",
            )


def report_missing_messages(
    system: System, machines: tuple[int, ...], node: CanNode, at: Text, findings: Findings
) -> None:
    """Report each connection with machines of a node for which the file has no message."""
    for number in machines:
        machine = system.machines[number]
        name = next((n for n in node.dbc.nodes if word(n) == word(machine.chart.name)), None)
        if name is None:
            findings.add(
                "unfit-message",
                f"`{at}` has no node with the name of the chart `{machine.chart.name}`",
                at,
                help=f"name the chart like one of {', '.join(node.dbc.nodes)}",
            )
            continue
        for what, wanted, types in _ports(system, machines, number):
            error = _mismatch(node.dbc, name, what, wanted, types)
            if error:
                findings.add(
                    "unfit-message",
                    f"`{machine.name}.{wanted}` is connected, but {error}",
                    at,
                    secondary=[] if machine.span is None else [(machine.span, "the machine")],
                    help="write the chart again with `fsmkit convert`, or connect less of it",
                )


def _ports(
    system: System, machines: tuple[int, ...], number: int
) -> Iterator[tuple[str, str, dict[str, Type]]]:
    """Yield the connected ports of a machine: kind, name, and types."""
    machine = system.machines[number]
    chart = machine.chart
    for link in system.event_links:
        if link.source == number and link.target not in machines:
            fields = {field.name: field.type for field in port_fields(chart, link.port)}
            yield "sent", port_name(chart, link.port), fields
        elif link.target == number and link.source not in machines:
            event = chart.events[link.event]
            fields = {field.name: field.type for field in event.fields}
            yield "taken", event.name, fields
    for level in system.input_links:
        if level.source == number and level.target not in machines:
            output = chart.outputs[level.output]
            yield "level", output.name, {output.name: output.type}
        elif level.target == number and level.source not in machines:
            variable = chart.inputs[level.input]
            yield "level", variable.name, {variable.name: variable.type}


def _mismatch(dbc: Dbc, node: str, what: str, name: str, types: dict[str, Type]) -> str | None:
    """Return why the file has no match for a connection; None if it has one."""
    if what == "level":
        signal = level_signals(dbc, node).get(name)
        signals = {} if signal is None else {name: signal[1]}
    elif name in names_of_silence(dbc).values() and what == "sent":
        return None if not types else "timeout events have no fields"
    else:
        message = event_message(dbc, node, name)
        signals = {} if message is None else {part.name: part for part in message.signals}
        if message is not None and not types and not signals:
            return None
    if not signals:
        return "no message of the file has this name"
    if signals.keys() != types.keys():
        return f"its message has the signals {', '.join(signals)}"
    for field, type_ in types.items():
        if not is_same(signals[field], type_):
            return f"`{field}` is `{type_}`, and its signal `{signals[field].type}`"
    return None


def level_signals(dbc: Dbc, node: str) -> dict[str, tuple[Message, Signal]]:
    """Return the signals of a node's levels, by level."""
    names = names_of_levels(dbc, node)
    return {
        names[message.name, signal.name]: (message, signal)
        for message in dbc.messages
        for signal in message.signals
        if (message.name, signal.name) in names
    }


def event_message(dbc: Dbc, node: str, name: str) -> Message | None:
    """Return the message of a node's event, by name."""
    for message in dbc.messages:
        if message.name == name and node in message.senders | message.receivers:
            return None if message.is_levels else message
    return None


def is_same(signal: Signal, type_: Type) -> bool:
    """Whether a type and a signal have the same values."""
    match signal.type, type_:
        case BoolType(), BoolType():
            return True
        case IntType(lo, hi), IntType(least, most):
            return (lo, hi) == (least, most)
        case FloatType(bits), FloatType(others):
            return bits == others
        case EnumType(_, members), EnumType(_, others):
            is_same_names = tuple(map(str, members)) == tuple(map(str, others))
            return is_same_names and type_.is_counted
        case _:
            return False


def late_of_node(system: System, machines: tuple[int, ...], node: CanNode) -> dict[Connection, int]:
    """Return the maximum latency of events of connections with a node, in microseconds."""
    responses = {message.name: late for message, late in node.times.responses}
    found = {}
    for link in system.event_links:
        name = _message_name(system, machines, link)
        late = None if name is None else responses.get(name)
        if late is not None:
            found[connection_of(system, link)] = late
    return found


def _message_name(system: System, machines: tuple[int, ...], link: EventLink) -> str | None:
    """Return the name of the message of a connection with the node."""
    if link.source in machines and link.target not in machines:
        return port_name(system.machines[link.source].chart, link.port)
    if link.target in machines and link.source not in machines:
        return system.machines[link.target].chart.events[link.event].name
    return None
