"""Compute the messages of a CAN bus that nodes of fsmkit share, their identifiers and bit layout.

An identifier is the base plus the rank of a message: first the events, those with a `priority:` by
it, the others in the order of the system file; then the levels of each node; last the `hello` of
each node. Byte 0 of an event or of levels counts the frames of the message, modulo 256; the values
follow, packed by bits from byte 1 on, each as its distance from the minimum of its type. `hello` is
sent at the start and every 100 ms: the hash of map and layout (4 bytes), the session (2) and the
events sent (2), each modulo its size.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from fsmkit.carriers.can.chart_of_dbc import LEAST_PAUSE
from fsmkit.carriers.can.dbc import LARGEST, RESERVED, Message, Signal
from fsmkit.carriers.can.dbc_writing import Entry, dbc_text
from fsmkit.carriers.can.foreign import CanTimes, bitrate_of, error_bits_of, report_bus, times_of
from fsmkit.carriers.can.message import CanWire
from fsmkit.carriers.can.response_times import TimedFrame, fd_frame_bits, frame_bits
from fsmkit.diagnostics import Findings, Span, Text, fail
from fsmkit.emit import Namer
from fsmkit.language import BOOL, BoolType, EnumType, FloatType, IntType, Scope, Type, read_duration
from fsmkit.language.conversion import integer_bounds
from fsmkit.system.deployment.delays import Connection, connection_of
from fsmkit.system.deployment.event_map import LEVELS, EventMap, LevelType
from fsmkit.system.indices import integer
from fsmkit.system.machine import EventLink
from fsmkit.system.system import System

CAN = "can"
"""The name of the carrier."""
BASE = 0x100
HIGHEST = 0x7FF
"""The greatest identifier of 11 bits."""
PERIOD = 10_000
"""Microseconds of a cycle of the nodes."""
HELLO = 100
"""Milliseconds from one `hello` to the next."""
LENGTHS = (*range(9), 12, 16, 20, 24, 32, 48, LARGEST)
"""Bytes that frames have, beyond 8 those of CAN FD."""
LONGEST = 1_000_000
"""Microseconds of a cycle of the nodes, at most."""


@dataclass(frozen=True)
class CanNet:
    """The messages of a bus."""

    bus: str
    hash: int
    """The hash of event map and layout: the same on all compatible nodes."""
    events: tuple[CanWire | None, ...]
    """By number of the event map, from 1; None: one end is a foreign node."""
    levels: Mapping[int, CanWire]
    """By node of fsmkit."""
    hellos: Mapping[int, CanWire]
    """The same."""
    dbc: str
    """The text of a DBC file, for tools."""
    frames: tuple[tuple[CanWire, TimedFrame], ...]
    bitrate: int
    error_bits: int

    @property
    def carrier(self) -> str:
        """The name of the carrier."""
        return CAN

    @property
    def wires(self) -> tuple[CanWire, ...]:
        """All messages, the highest priority first."""
        return tuple(wire for wire, _ in self.frames)

    @property
    def is_fd(self) -> bool:
        """Whether some frame is one of CAN FD."""
        return any(wire.message.is_fd for wire in self.wires)

    def times(self, others: Iterable[TimedFrame]) -> CanTimes:
        """Return the response times, with the ``others`` on the bus."""
        own = [(wire.message, frame) for wire, frame in self.frames]
        return times_of(self.bus, own, others, self.bitrate, self.error_bits)


def can_net(
    map_: EventMap,
    links: Sequence[EventLink],
    options: Mapping[str, Text],
    levels: tuple[int, int],
    findings: Findings,
) -> CanNet | None:
    """Return the messages of a bus between nodes of fsmkit; None after an error.

    Args:
        map_: The event map.
        links: By number of the message, from 1, its connection.
        options: The deployment's options, by the keys of links.
        levels: The default cycle of the nodes in microseconds, and the cycles between levels.
        findings: Receives the errors.

    """
    bus = options["bus"]
    report_bus(bus, findings)
    base = _base(options.get("base"), findings)
    bitrate = bitrate_of(options.get("bitrate"), findings)
    period, every = levels
    if (text := options.get("period")) is not None:
        period = read_duration(text, Scope(tick=1), findings) or PERIOD
        if not 1 <= period <= LONGEST:
            findings.add("unexpected-value", "a cycle of the nodes is 1us to 1s", text)
            return None
    made = _Layout(map_, links, base, period * every, bus.span)
    wires = made.wires()
    for wire in wires:
        if wire.message.length > LARGEST:
            findings.add(
                "long-message",
                f"`{wire.message.name}` has {wire.message.length} bytes on the bus, and a frame of "
                f"CAN FD has {LARGEST}",
                bus.span,
                help="send less in one event, or place its machines on one node",
            )
    last = base + len(wires) - 1
    if last > HIGHEST:
        findings.add(
            "unexpected-value",
            f"the last of {len(wires)} messages has the identifier 0x{last:x}, and the highest is "
            f"0x{HIGHEST:x}",
            options.get("base", bus),
            help="choose a lower `base`",
        )
    if findings.has_errors:
        return None
    frames = tuple((wire, made.timed(wire, bitrate)) for wire in wires)
    text_ = dbc_text([map_.nodes[n] for n in map_.own_nodes], map(made.entry, wires))
    content = f"{map_.hash:08x}\n{text_}".encode()
    events = {wire.number: wire for wire in wires if wire.number not in (None, LEVELS)}
    return CanNet(
        bus.value,
        int.from_bytes(hashlib.sha256(content).digest()[:4], "little"),
        tuple(events.get(part.number) for part in map_.messages),
        {node: wire for (kind, node), wire in made.of_nodes.items() if kind == "levels"},
        {node: wire for (kind, node), wire in made.of_nodes.items() if kind == "hello"},
        text_,
        frames,
        bitrate,
        error_bits_of(options.get("error_every"), bitrate, findings),
    )


def _base(text: Text | None, findings: Findings) -> int:
    if text is None:
        return BASE
    number = integer(text, findings)
    if number is not None and not 0 <= number <= HIGHEST:
        findings.add("unexpected-value", f"an identifier is 0 to 0x{HIGHEST:x}", text)
        return BASE
    return BASE if number is None else number


class _Layout:
    """Creates the messages, in the order of their identifiers."""

    def __init__(
        self, map_: EventMap, links: Sequence[EventLink], base: int, period: int, span: Span
    ) -> None:
        self.map = map_
        self.links = links
        self.base = base
        self.period = period
        self.span = span
        self.names = Namer(RESERVED)
        self.made: list[CanWire] = []
        self.of_nodes: dict[tuple[str, int], CanWire] = {}
        self.comments: dict[int, str] = {}

    def wires(self) -> tuple[CanWire, ...]:
        """Return all messages."""
        own = self.map.own_nodes
        within = [m for m in self.map.messages if m.sender in own and m.receiver in own]
        for part in sorted(within, key=lambda m: (self._priority(m.number), m.number)):
            name = f"{part.source.machine}_{part.source.name}"
            values = [(field.name, field.type, [at]) for at, field in enumerate(part.fields)]
            self._add(name, part.sender, {part.receiver}, part.number, values, 0, part.name)
        for node in own:
            levels = self.map.levels_of(node)
            values = _sources(levels)
            takers = {level.receiver for level in levels if level.receiver in own}
            cycle = max(1, self.period // 1000)
            name = self.map.nodes[node]
            wire = self._add(
                f"{name}_levels", node, takers, LEVELS, values, cycle, f"levels of {name}"
            )
            self.of_nodes["levels", node] = wire
        for node in own:
            name = self.map.nodes[node]
            self.of_nodes["hello", node] = self._hello(name, node)
        return tuple(self.made)

    def _priority(self, number: int) -> tuple[bool, int]:
        priority = self.links[number - 1].priority
        return priority is None, priority or 0

    def _add(
        self,
        name: str,
        sender: int,
        receivers: set[int],
        number: int,
        values: list[tuple[str, Type, list[int]]],
        cycle: int,
        comment: str,
    ) -> CanWire:
        names = Namer(RESERVED)
        names.name("count")
        start = 8
        signals: list[Signal] = []
        parts: list[tuple[Signal, int | None]] = []
        for each, type_, places in values:
            signal = signal_of(names.name(each), type_, start, self.span)
            start += signal.bits
            signals.append(signal)
            parts += [(signal, place) for place in places]
        least = (start + 7) // 8
        length = next((n for n in LENGTHS if n >= least), least)
        message = Message(
            self.names.name(name),
            self.base + len(self.made),
            is_extended=False,
            is_fd=length > 8,
            length=length,
            cycle=cycle,
            senders=frozenset({self.map.nodes[sender]}),
            receivers=frozenset(self.map.nodes[receiver] for receiver in receivers),
            signals=tuple(signals),
            span=self.span,
        )
        wire = CanWire(message, number, tuple(parts))
        self.made.append(wire)
        self.comments[message.frame] = comment
        return wire

    def _hello(self, name: str, node: int) -> CanWire:
        sizes = ("hash", 32), ("session", 16), ("events", 16)
        start = 0
        signals: list[Signal] = []
        for each, bits in sizes:
            signals.append(signal_of(each, IntType(0, 2**bits - 1), start, self.span))
            start += bits
        others = (self.map.nodes[other] for other in self.map.own_nodes if other != node)
        message = Message(
            self.names.name(f"{name}_hello"),
            self.base + len(self.made),
            is_extended=False,
            is_fd=False,
            length=8,
            cycle=HELLO,
            senders=frozenset({name}),
            receivers=frozenset(others),
            signals=tuple(signals),
            span=self.span,
        )
        wire = CanWire(message, None, ())
        self.made.append(wire)
        self.comments[message.frame] = f"{name}: hash of the map, session, events sent"
        return wire

    def entry(self, wire: CanWire) -> Entry:
        """Return a message for the DBC file: with its counter."""
        message = wire.message
        if wire.number is not None:
            count = signal_of("count", IntType(0, 255), 0, self.span)
            message = replace(message, signals=(count, *message.signals))
        return Entry(message, self.comments[message.frame])

    def timed(self, wire: CanWire, bitrate: int) -> TimedFrame:
        """Return a message for the analysis of response times."""
        message = wire.message
        microseconds = LEAST_PAUSE * 1000 if not message.cycle else message.cycle * 1000
        if wire.number == LEVELS:
            microseconds = self.period
        bits = (
            fd_frame_bits(message.length)
            if message.is_fd
            else frame_bits(message.length, is_extended=False)
        )
        return TimedFrame(
            message.frame,
            is_extended=False,
            bits=bits,
            period=max(1, microseconds * bitrate // 1_000_000),
        )


def _sources(levels: tuple[LevelType, ...]) -> list[tuple[str, Type, list[int]]]:
    """Return each level of a node once, with its indices in the payload."""
    found: dict[tuple[str, str], tuple[str, Type, list[int]]] = {}
    for place, level in enumerate(levels):
        key = level.source.machine, level.source.name
        entry = found.setdefault(key, (f"{key[0]}_{key[1]}", level.type, []))
        entry[2].append(place)
    return list(found.values())


def signal_of(name: str, type_: Type, start: int, span: Span) -> Signal:
    """Return a signal for values of a type, with the fewest bits (at least one)."""
    if isinstance(type_, FloatType):
        return Signal(name, type_, start, type_.bits, False, False, span)
    found = integer_bounds(type_)
    assert found is not None, type_  # noqa: S101  (`report_limits` rejects others)
    lo, hi = found
    bits = max(1, (hi - lo).bit_length())
    if isinstance(type_, BoolType):
        return Signal(name, BOOL, start, bits, False, False, span)
    if isinstance(type_, EnumType):
        if not type_.is_counted:
            raise fail(
                "broken-deployment",
                f"the members of `{type_.name}` have numbers, and signals on CAN count from 0",
                span,
                help="send an integer, or give the members no numbers",
            )
        members = type_.numbers
        return Signal(name, type_, start, bits, False, False, span, members=members)
    return Signal(name, IntType(lo, hi), start, bits, False, False, span, shift=lo)


def late_by_connection(
    system: System, links: Sequence[EventLink], net: CanNet, times: CanTimes
) -> dict[Connection, int]:
    """Return the maximum latency of events on the bus in microseconds, by connection."""
    late = {message.name: response for message, response in times.responses}
    found = {}
    for link, wire in zip(links, net.events, strict=True):
        response = None if wire is None else late[wire.message.name]
        if response is not None:
            found[connection_of(system, link)] = response
    return found


def report_late(times: CanTimes, net: CanNet, at: Text, findings: Findings) -> None:
    """Report each message that may be later than its cycle, or without a bound."""
    frames = {wire.message.name: (wire, frame) for wire, frame in net.frames}
    for message, response in times.responses:
        wire, frame = frames[message.name]
        cycle = frame.period * 1_000_000 // net.bitrate
        if response is not None and (wire.number not in (None, LEVELS) or response <= cycle):
            continue
        late = "has no bound" if response is None else f"is {response} us"
        findings.add(
            "late-message",
            f"the response time of `{message.name}` {late}, and it is sent every {cycle} us; the "
            f"load of the bus is {times.load:.0%}",
            at,
            help="publish levels in fewer cycles (`every:`), or give the bus a higher bitrate",
        )
