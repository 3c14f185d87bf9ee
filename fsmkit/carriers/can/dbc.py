"""Messages and signals of a DBC file, with types of the action language and locations.

`cantools` reads the file. A signal is an integer in units of its factor: ``(0.1,0) [-40|100]`` is
``-400..1000``, in tenths. Its raw value differs from it by a sign and a shift only, so no value is
rounded.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from itertools import islice
from math import ceil, floor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fsmkit.diagnostics import Findings, Source, Span, fail
from fsmkit.emit import Namer, legal, snake
from fsmkit.language import BOOL, BoolType, EnumType, FloatType, IntType, Type

if TYPE_CHECKING:
    from cantools.database.can import Database
    from cantools.database.can.message import Message as DbcMessage
    from cantools.database.can.signal import Signal as DbcSignal

LARGEST = 64
"""Bytes of a frame of CAN FD at most; 8 of a classical one."""
LEAST_INTEGER, GREATEST_INTEGER = -(2**63), 2**64 - 1
MOST_CHOICES = 1024
"""Values of the multiplexers of a message, each of which is an event."""
MOST_CYCLE = 3_600_000
"""Milliseconds."""
MOST_DIGITS = 64
"""Characters of a number in a file."""
MOST_EXPONENT = 300
MOST_RANGE = 65_536
"""Multiplexer values between the two ends of a range."""
RESERVED = frozenset(
    {"abs", "and", "as", "assert", "do", "else", "event", "false", "for", "if", "in", "In"}
    | {"log", "max", "min", "not", "null", "off", "on", "or", "raise", "reply", "return", "send"}
    | {"super", "true", "yes", "no"}
)
"""Words of the action language, and of YAML, that no name of a chart may be."""


@dataclass(frozen=True, slots=True)
class Signal:
    """A signal in charts: ``raw * sign + shift``, or a member of an enumeration."""

    name: str
    """An identifier; different from that of each other signal of its message."""
    type: Type
    start: int
    """The lowest bit, or of a big-endian signal the highest, numbered as in DBC files."""
    bits: int
    is_big_endian: bool
    is_signed: bool
    span: Span
    sign: int = 1
    shift: int = 0
    members: tuple[int, ...] = ()
    """The raw value of each member of an enumeration."""

    @property
    def bounds(self) -> tuple[int, int]:
        """The minimum and the maximum; for an enumeration the indices of its members."""
        match self.type:
            case IntType(lo, hi):
                return lo, hi
            case BoolType():
                return 0, 1
            case _:
                return 0, len(self.members) - 1

    @property
    def lowest(self) -> int:
        """The place of the lowest bit: eight times its byte, plus the bit."""
        return next(_positions(self))

    @property
    def raw_bounds(self) -> tuple[int, int]:
        """The minimum and the maximum raw value; for a float those of its bits."""
        if isinstance(self.type, FloatType):
            return 0, 2**self.bits - 1
        ends = [self.raw_of(value) for value in self.bounds]
        return min(ends), max(ends)

    @property
    def idle(self) -> int:
        """The value sent without a connection: its raw value is nearest to 0."""
        if self.members or isinstance(self.type, FloatType):
            return 0
        lo, hi = self.bounds
        return min(max(self.shift, lo), hi)

    def value_of(self, raw: int) -> int | None:
        """Return the value of a raw one; None if it is out of range."""
        if self.members:
            return self.members.index(raw) if raw in self.members else None
        value = raw * self.sign + self.shift
        lo, hi = self.bounds
        return value if lo <= value <= hi else None

    def raw_of(self, value: int) -> int:
        """Return the raw value of a value within the bounds."""
        return self.members[value] if self.members else (value - self.shift) * self.sign


@dataclass(frozen=True, slots=True)
class Message:
    """A message, or its variant for one value of each of its multiplexers."""

    name: str
    """An identifier; different from that of each other message of its file."""
    frame: int
    is_extended: bool
    is_fd: bool
    length: int
    """Bytes."""
    cycle: int
    """Milliseconds from one to the next; 0: it comes as an event."""
    senders: frozenset[str]
    receivers: frozenset[str]
    signals: tuple[Signal, ...]
    span: Span
    selectors: tuple[tuple[Signal, int], ...] = ()
    """The multiplexers, outer ones first, and their raw values."""

    @property
    def is_levels(self) -> bool:
        """Whether its signals are levels: it is sent in a cycle."""
        return self.cycle > 0


@dataclass(frozen=True)
class Dbc:
    """A DBC file."""

    source: Source
    nodes: tuple[str, ...]
    messages: tuple[Message, ...]
    database: Database = field(compare=False)
    """The result of cantools, not compared."""

    @cached_property
    def by_frame(self) -> Mapping[tuple[int, bool], tuple[Message, ...]]:
        """The messages of each identifier, more than one only of a multiplexed message."""
        found: dict[tuple[int, bool], tuple[Message, ...]] = {}
        for message in self.messages:
            key = message.frame, message.is_extended
            found[key] = (*found.get(key, ()), message)
        return found


def read_dbc(path: Path, content: bytes, findings: Findings) -> Dbc | None:
    """Return the content of a DBC file; None after reporting errors at their locations."""
    try:
        import cantools
        from cantools.database import Error
    except ImportError as error:
        raise fail(
            "missing-package",
            f"reading DBC files needs cantools: {error}",
            help="pip install 'fsmkit[can]'",
        ) from error
    source = Source(str(path), content.decode("cp1252", errors="replace"))
    if _report_numbers(source, findings):
        return None
    try:
        database = cantools.database.load_string(source.text, database_format="dbc")
    except (Error, ValueError, KeyError, IndexError, TypeError, RecursionError) as error:
        _report_unread(str(error), source, findings)
        return None
    places = _Places(source)
    if not _is_sound(database, places, findings):
        return None
    names = Namer(RESERVED)
    messages: list[Message] = []
    for found in database.messages:
        messages += _messages(found, names, places, findings)
    return Dbc(source, tuple(node.name for node in database.nodes), tuple(messages), database)


def word(name: str) -> str:
    """Return a name in the notation of charts: lower case, words joined by one ``_`` each."""
    found = re.sub(r"_+", "_", snake(name)).strip("_")
    return legal(found) if found else "unnamed"


class _Places:
    """The locations of declarations of messages and signals."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self._messages = {
            int(found[1]): found
            for found in reversed(
                list(re.finditer(r"^[ \t]*BO_[ \t]+(\d+)[ \t]+(\w+)", source.text, re.MULTILINE))
            )
        }

    def message(self, message: DbcMessage) -> Span:
        frame = message.frame_id | (1 << 31 if message.is_extended_frame else 0)
        found = self._messages.get(frame)
        return self._span(found, 2) if found is not None else Span(self.source, 0, 0)

    def signal(self, message: DbcMessage, name: str) -> Span:
        start = self.message(message).end
        after = re.compile(r"^[ \t]*BO_[ \t]", re.MULTILINE).search(self.source.text, start)
        end = len(self.source.text) if after is None else after.start()
        pattern = re.compile(rf"\bSG_[ \t]+({re.escape(name)})\b")
        found = pattern.search(self.source.text, start, end)
        return self.message(message) if found is None else self._span(found, 1)

    def is_selected(self, message: DbcMessage, name: str) -> bool:
        """Return whether the file declares a signal for one value of a multiplexer: `m7`."""
        end = self.signal(message, name).end
        return re.compile(r"[ \t]+m\d").match(self.source.text, end) is not None

    def _span(self, found: re.Match[str], group: int) -> Span:
        return Span(self.source, found.start(group), found.end(group))


_STRING = re.compile(r'"(?:\\.|[^"\\])*"', re.DOTALL)
_NUMBER = re.compile(r"(?<![\w.])m?[-+]?[\d.]+(?:[eE][-+]?\d+)?")
_MESSAGE = re.compile(r"\bBO_[ \t]+(\d+)[ \t]+(\w+)[ \t]*:[ \t]*(\d+)")
_SIGNAL = re.compile(r"\bSG_\s+(\w+)(?:\s+(?:M|m\d+M?))?\s*:\s*(\d+)\s*\|\s*(\d+)\s*@")
_RANGE = re.compile(r"\b(\d+)\s*-\s*(\d+)\b")


def _report_numbers(source: Source, findings: Findings) -> bool:
    """Report numbers that no bus has, before they become bits, lists or floats."""
    count = len(findings)
    text = _STRING.sub(lambda found: " " * len(found[0]), source.text)

    def report(found: re.Match[str], group: int, message: str, fix: str) -> None:
        span = Span(source, found.start(group), found.end(group))
        findings.add("broken-dbc", message, span, help=fix)

    for found in _NUMBER.finditer(text):
        _, _, exponent = found[0].lower().partition("e")
        power = int(exponent[:MOST_DIGITS] or "0")
        if len(found[0]) > MOST_DIGITS or abs(power) > MOST_EXPONENT:
            shown = found[0] if len(found[0]) <= MOST_DIGITS else f"{found[0][:8]}..."
            report(
                found,
                0,
                f"the number `{shown}` is out of range",
                f"write at most {MOST_DIGITS} characters, and a power of ten within "
                f"-{MOST_EXPONENT}..{MOST_EXPONENT}",
            )
    if len(findings) > count:
        return True
    for found in _MESSAGE.finditer(text):
        if int(found[3]) > LARGEST:
            fix = "a frame has 0 to 8 bytes, of CAN FD up to 64"
            report(found, 2, f"`{found[2]}` has {found[3]} bytes", fix)
    for found in _SIGNAL.finditer(text):
        if int(found[2]) >= 8 * LARGEST:
            fix = f"bits are numbered from 0 to {8 * LARGEST - 1}"
            report(found, 1, f"`{found[1]}` starts at bit {found[2]}", fix)
        if not 1 <= int(found[3]) <= 64:
            fix = "a signal has 1 to 64 bits"
            report(found, 1, f"`{found[1]}` has {found[3]} bits", fix)
    for line in re.finditer(r"\bSG_MUL_VAL_\b[^;]*", text):
        for found in _RANGE.finditer(text, line.start(), line.end()):
            if not 0 <= int(found[2]) - int(found[1]) < MOST_RANGE:
                fix = f"the first number is less, by less than {MOST_RANGE}"
                report(found, 0, f"`{found[0]}` is not a range of multiplexer values", fix)
    return len(findings) > count


def _report_unread(error: str, source: Source, findings: Findings) -> None:
    """Report the error of `cantools` at the location that it names."""
    text = error.removeprefix('DBC: "').removesuffix('"')
    place = re.search(r"at line (\d+), column (\d+)", text)
    span = Span(source, 0, 0)
    if place is not None:
        start = source.offset(int(place[1]), int(place[2]))
        span = Span(source, start, min(start + 1, len(source.text)))
        text = "the syntax of DBC files is broken here"
    elif (named := re.search(r"in message (\w+)", text)) is not None:
        pattern = re.compile(rf"^[ \t]*BO_[ \t]+\d+[ \t]+({re.escape(named[1])})\b", re.MULTILINE)
        if (found := pattern.search(source.text)) is not None:
            span = Span(source, found.start(1), found.end(1))
            inner = re.search(r"[Ss]ignals? (\w+)", text)
            if inner is not None:
                part = re.compile(rf"\bSG_[ \t]+({re.escape(inner[1])})\b")
                if (within := part.search(source.text, found.end())) is not None:
                    span = Span(source, within.start(1), within.end(1))
    findings.add(
        "broken-dbc",
        " ".join(text.split())[:200],
        span,
        help="correct the file, or write it again with the tool that it comes from",
    )


def _is_sound(database: Database, places: _Places, findings: Findings) -> bool:
    seen: dict[tuple[int, bool], str] = {}
    count = len(list(findings))
    for message in database.messages:
        key = message.frame_id, message.is_extended_frame
        if key in seen:
            findings.add(
                "broken-dbc",
                f"`{message.name}` has the identifier of `{seen[key]}`",
                places.message(message),
                help="give each message an identifier of its own",
            )
        seen[key] = message.name
        if not 0 <= (message.cycle_time or 0) <= MOST_CYCLE:
            findings.add(
                "broken-dbc",
                f"`{message.name}` has a cycle of {message.cycle_time} ms",
                places.message(message),
                help=f"`GenMsgCycleTime` is 0 to {MOST_CYCLE} ms",
            )
        if not 0 <= message.length <= LARGEST:
            findings.add(
                "broken-dbc",
                f"`{message.name}` has {message.length} bytes",
                places.message(message),
                help="a frame has 0 to 8 bytes, of CAN FD up to 64",
            )
    return len(list(findings)) == count


def _messages(
    found: DbcMessage, names: Namer, places: _Places, findings: Findings
) -> Iterator[Message]:
    """Yield a message; for a multiplexed one, one for each choice of its multiplexers."""
    span = places.message(found)
    receivers = frozenset(name for signal in found.signals for name in signal.receivers)
    cycle = found.cycle_time or 0

    def build(
        name: str, signals: list[DbcSignal], selectors: tuple[tuple[Signal, int], ...]
    ) -> Message:
        own = Namer(RESERVED)
        parts = [_signal(found, signal, own, places, findings) for signal in signals]
        return Message(
            names.name(word(name)),
            found.frame_id,
            found.is_extended_frame,
            found.is_fd,
            found.length,
            0 if selectors else cycle,
            frozenset(found.senders),
            receivers,
            tuple(part for part in parts if part is not None),
            span,
            selectors,
        )

    unselected = [
        signal
        for signal in found.signals
        if signal.multiplexer_ids is None and places.is_selected(found, signal.name)
    ]
    if unselected:
        name = unselected[0].name
        findings.add(
            "omitted-message",
            f"`{found.name}` is omitted: it has several multiplexers, and nothing says which of "
            f"them selects `{name}`",
            places.signal(found, name),
            help=f"add `SG_MUL_VAL_` for `{name}`",
        )
        return
    selecting = {signal.multiplexer_signal for signal in found.signals} - {None}
    if not selecting:
        yield build(found.name, list(found.signals), ())
        return
    choices = list(islice(_choices(found.signals), MOST_CHOICES + 1))
    if len(choices) > MOST_CHOICES:
        findings.add(
            "omitted-message",
            f"`{found.name}` is omitted: its multiplexers have more than {MOST_CHOICES} choices, "
            "and each is an event",
            span,
            help="divide the message, or give its multiplexers fewer values",
        )
        return
    by_name = {
        signal.name: _raw_signal(signal, places.signal(found, signal.name))
        for signal in found.signals
        if signal.name in selecting
    }
    for choice in choices:
        plain = [
            signal
            for signal in found.signals
            if signal.name not in selecting and _is_chosen(signal, choice)
        ]
        parts = [found.name]
        for multiplexer, number in choice:
            names_of = multiplexer.choices or {}
            parts.append(str(names_of[number]) if number in names_of else f"m{number}")
        selectors = tuple((by_name[each.name], number) for each, number in choice)
        yield build("_".join(parts), plain, selectors)


Choice = tuple[tuple["DbcSignal", int], ...]
"""The multiplexers that a message has, with their raw values; outer ones first."""


def _is_chosen(signal: DbcSignal, choice: Choice) -> bool:
    """Return whether a message has a signal, given the values of its multiplexers."""
    if signal.multiplexer_ids is None:
        return True
    return any(
        signal.multiplexer_signal == multiplexer.name and number in signal.multiplexer_ids
        for multiplexer, number in choice
    )


def _choices(signals: Sequence[DbcSignal], before: Choice = ()) -> Iterator[Choice]:
    """Yield the possible combinations of values of all multiplexers, in ascending order."""
    known = {multiplexer.name for multiplexer, _ in before}
    for multiplexer in signals:
        own = [s for s in signals if s.multiplexer_signal == multiplexer.name]
        if own and multiplexer.name not in known and _is_chosen(multiplexer, before):
            for number in sorted({n for signal in own for n in signal.multiplexer_ids or ()}):
                yield from _choices(signals, (*before, (multiplexer, number)))
            return
    yield before


def _raw_signal(signal: DbcSignal, span: Span) -> Signal:
    lo, hi = _raw_bounds(signal)
    is_big = signal.byte_order == "big_endian"
    return Signal(
        word(signal.name),
        IntType(lo, hi),
        signal.start,
        signal.length,
        is_big,
        signal.is_signed,
        span,
    )


def _raw_bounds(signal: DbcSignal) -> tuple[int, int]:
    if signal.is_signed:
        return -(2 ** (signal.length - 1)), 2 ** (signal.length - 1) - 1
    return 0, 2**signal.length - 1


def _signal(
    message: DbcMessage, signal: DbcSignal, names: Namer, places: _Places, findings: Findings
) -> Signal | None:
    """Return a signal with its type; None after reporting an error."""
    span = places.signal(message, signal.name)

    def reject(why: str, fix: str) -> Signal | None:
        findings.add("broken-dbc", f"`{message.name}.{signal.name}` {why}", span, help=fix)
        return None

    name = names.name(word(signal.name))
    lo, hi = _raw_bounds(signal)
    is_big = signal.byte_order == "big_endian"
    place = signal.start, signal.length, is_big, signal.is_signed, span
    if signal.length > 64:
        return reject(f"has {signal.length} bits", "charts have integers of up to 64")
    factor, offset = Fraction(str(signal.scale)), Fraction(str(signal.offset))
    if signal.is_float:
        if factor != 1 or offset != 0 or signal.length not in (32, 64):
            return reject(
                "is a float of another size, or with a factor or an offset",
                "send floats of 32 or 64 bits as they are, or integers with a factor",
            )
        return Signal(name, FloatType(signal.length), *place)
    if factor == 0:
        return reject("has the factor 0", "give it the factor by which raw values are multiplied")
    sign, unit = (1, factor) if factor > 0 else (-1, -factor)
    if (offset / unit).denominator != 1:
        return reject(
            f"has the offset {signal.offset}, which is not a multiple of its factor {signal.scale}",
            "choose a multiple of it: charts have integers in units of the factor",
        )
    shift = int(offset / unit)
    ends = sorted((lo * sign + shift, hi * sign + shift))
    least, most = ends
    if signal.minimum is not None:
        least = max(least, ceil(Fraction(str(signal.minimum)) / unit))
    if signal.maximum is not None:
        most = min(most, floor(Fraction(str(signal.maximum)) / unit))
    if least > most:
        return reject(
            "has no value: its minimum and maximum leave none of those that its bits have",
            "correct `[minimum|maximum]`; they are physical values",
        )
    choices: dict[int, str] = {}
    for number, choice in (signal.choices or {}).items():
        if lo <= number <= hi:
            choices[number] = str(choice)
    within = sorted(n for n in choices if least <= n * sign + shift <= most)
    is_ranged = signal.minimum is not None and signal.maximum is not None
    if len(within) > 1 and (not is_ranged or len(within) == most - least + 1):
        members = Namer(RESERVED)
        enum = EnumType("", tuple(members.name(word(choices[n])) for n in within))
        return Signal(name, enum, *place, members=tuple(within))
    if least < LEAST_INTEGER or most > GREATEST_INTEGER or (least < 0 and most >= 2**63):
        return reject("has values beyond 64 bits", "give it a minimum and a maximum")
    is_bool = (least, most, signal.length, shift, sign) == (0, 1, 1, 0, 1)
    return Signal(name, BOOL if is_bool else IntType(least, most), *place, sign, shift)


def encode(message: Message, values: tuple[Any, ...]) -> bytes:
    """Return the bytes of a message with these values, and 0 for other signals."""
    content = bytearray(message.length)
    for signal, number in message.selectors:
        _put(content, signal, number)
    for signal, value in zip(message.signals, values, strict=True):
        if isinstance(signal.type, FloatType):
            form = "<f" if signal.bits == 32 else "<d"
            raw = int.from_bytes(struct.pack(form, value), "little")
        else:
            raw = signal.raw_of(int(value))
        _put(content, signal, raw)
    return bytes(content)


def decode(messages: tuple[Message, ...], content: bytes) -> tuple[Message, tuple[Any, ...]] | None:
    """Return the received message among those of one identifier, and its values.

    None: it is too short, its multiplexers choose none of them, or a value is out of range.
    """
    for message in messages:
        if len(content) < message.length:
            return None
        if any(_get(content, signal) != number for signal, number in message.selectors):
            continue
        values: list[Any] = []
        for signal in message.signals:
            raw = _get(content, signal)
            if isinstance(signal.type, FloatType):
                form = "<f" if signal.bits == 32 else "<d"
                values.append(struct.unpack(form, raw.to_bytes(signal.bits // 8, "little"))[0])
                continue
            value = signal.value_of(raw)
            if value is None:
                return None
            values.append(bool(value) if isinstance(signal.type, BoolType) else value)
        return message, tuple(values)
    return None


def _positions(signal: Signal) -> Iterator[int]:
    """Yield the bit positions from the lowest on: eight times the byte, plus the bit."""
    if not signal.is_big_endian:
        yield from range(signal.start, signal.start + signal.bits)
        return
    first = signal.start // 8 * 8 + 7 - signal.start % 8  # counted from the highest bit of byte 0
    for place in range(first + signal.bits - 1, first - 1, -1):
        yield place // 8 * 8 + 7 - place % 8


def _get(content: bytes, signal: Signal) -> int:
    raw = 0
    for number, place in enumerate(_positions(signal)):
        raw |= (content[place // 8] >> place % 8 & 1) << number
    is_negative = signal.is_signed and raw >> (signal.bits - 1) & 1
    return raw - (1 << signal.bits) if is_negative else raw


def _put(content: bytearray, signal: Signal, raw: int) -> None:
    for number, place in enumerate(_positions(signal)):
        content[place // 8] |= (raw >> number & 1) << place % 8
