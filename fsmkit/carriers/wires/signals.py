"""Read the signals of a board: kinds of wires, and their options."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

from fsmkit.carriers.wires import keys as wire_keys
from fsmkit.carriers.wires.board import Kind, Register, Signal
from fsmkit.carriers.wires.shared_registers import report_shared_registers
from fsmkit.diagnostics import Findings, Text
from fsmkit.language import BOOL, BoolType, IntType, Scope, read_duration
from fsmkit.system.indices import integer
from fsmkit.yaml.nodes import Mapping, Node, check_keys, entries_of, require_mapping, require_text

MOST_SIGNALS = 4096
LEAST, GREATEST = -(2**31), 2**31 - 1
MOST_READINGS = 65535
LONGEST_LOWPASS = 32767
"""Cycles: then the filter, which counts in 1/65536, still reaches its input."""
WORDS = {"off": 0, "on": 1, "false": 0, "true": 1}
RESERVED = ("nothing", "host")


def scaled(points: tuple[tuple[int, int], ...], raw: int) -> int:
    """Return the meaning of a raw value: on the line between two points, halves away from the left.

    Beyond the outermost points it is theirs.
    """
    if raw <= points[0][0]:
        return points[0][1]
    for (x0, y0), (x1, y1) in pairwise(points):
        if raw <= x1:
            step = (abs(y1 - y0) * (raw - x0) + (x1 - x0) // 2) // (x1 - x0)
            return y0 + step if y1 >= y0 else y0 - step
    return points[-1][1]


def read_signals(node: Node | None, period: int, findings: Findings) -> tuple[Signal, ...] | None:
    """Return the signals, None after a finding; ``period``: of the board, in microseconds."""
    entries = entries_of(node, "`signals`", findings)
    if len(entries) > MOST_SIGNALS:
        findings.add("broken-board", f"a board has at most {MOST_SIGNALS} signals", entries[-1][0])
        return None
    found = [_signal(name, value, period, findings) for name, value in entries]
    signals = tuple(signal for signal in found if signal is not None)
    is_sound = not _report_shared_wires(signals, findings) and len(signals) == len(found)
    return signals if is_sound else None


def _report_shared_wires(signals: tuple[Signal, ...], findings: Findings) -> bool:
    """Report signals on one wire; return whether there are any."""
    are_there = report_shared_registers(signals, findings)
    taken: dict[tuple[Kind, int], Signal] = {}
    for signal in signals:
        if signal.kind is Kind.FLAG:
            continue
        first = taken.setdefault((signal.kind, signal.number), signal)
        if first is not signal and first.span is not None:
            are_there = True
            findings.add(
                "wire-used-twice",
                f"`{signal.kind.value}: {signal.number}` is `{first.name}` already",
                signal.span,
                secondary=[(first.span, "here")],
                help="give each signal a number of its own; several bindings may read one signal",
            )
    return are_there


def _signal(name: Text, node: Node, period: int, findings: Findings) -> Signal | None:
    parts = name.value.split(".")
    if len(parts) > 2 or not all(part.isascii() and part.isidentifier() for part in parts):
        findings.add(
            "broken-board",
            f"`{name}` is not a valid signal name",
            name,
            help="write `lamp` or `feeder.encoder`: letters, digits and `_`, at most one dot",
        )
        return None
    if name.value in RESERVED:
        findings.add("broken-board", f"`{name}` has a meaning in bindings", name, help="rename it")
        return None
    mapping = require_mapping(node, f"the signal `{name}`", findings)
    if mapping is None:
        return None
    given = [key for key, _ in mapping.entries if key.value in wire_keys.WIRES]
    if len(given) != 1:
        findings.add(
            "broken-board",
            f"`{name}` has no kind" if not given else f"`{name}` has several kinds",
            name,
            help=f"write one of {', '.join(f'`{kind}`' for kind in wire_keys.WIRES)}",
        )
        return None
    kind = given[0].value
    check_keys(mapping, wire_keys.WIRES[kind], f"a signal of the kind `{kind}`", findings)
    options = _Options(name, {k.value: v for k, v in mapping.entries}, period, findings)
    before = len(findings)
    signal = options.signal(Kind(kind))
    return signal if len(findings) == before else None


@dataclass(slots=True)
class _Options:
    """The options of a signal in the file."""

    name: Text
    options: dict[str, Node]
    period: int
    findings: Findings

    def signal(self, kind: Kind) -> Signal:
        """Return the signal; mind the findings."""
        found = self._of_kind(kind, 0 if kind is Kind.FLAG else self._number(kind))
        is_of_host = bool(self.word("host", {"true": 1, "false": 0}, 0))
        return replace(found, is_of_host=is_of_host, register=self._register(found))

    def _number(self, kind: Kind) -> int:
        return self.number(kind.value, 0, 0, 65535)

    def _of_kind(self, kind: Kind, number: int) -> Signal:
        name, span = self.name.value, self.name.span
        match kind:
            case Kind.FLAG:
                start = self.word("flag", WORDS, 0)
                return Signal(name, kind, BOOL, safe=start, span=span)
            case Kind.DIGITAL_IN:
                low, cycles = self._is_low(), max(1, self.cycles("debounce", MOST_READINGS))
                return Signal(name, kind, BOOL, number, low, cycles, span=span)
            case Kind.DIGITAL_OUT:
                safe = self.word("safe", WORDS, 0)
                return Signal(name, kind, BOOL, number, self._is_low(), safe=safe, span=span)
            case Kind.COUNTER:
                bits = self.number("bits", 32, 1, 32)
                whole = IntType(LEAST, GREATEST)
                return Signal(name, kind, whole, number, bits=bits, span=span)
            case Kind.ANALOG_IN:
                return self._analog(number)
            case Kind.NUMBER_IN:
                lo, hi = self._range("range", (LEAST, GREATEST), (LEAST, GREATEST))
                return Signal(name, kind, IntType(lo, hi), number, valid=(lo, hi), span=span)
            case Kind.PWM:
                full = self.number("full", 0, 1, GREATEST)
                if "full" not in self.options:
                    self._report("a pwm needs `full`, its greatest value", "write `full: 4096`")
                least = -full if self.word("signed", {"true": 1, "false": 0}, 0) else 0
                return self._output(kind, number, least, full)
            case Kind.NUMBER_OUT:
                return self._output(
                    kind, number, *self._range("range", (LEAST, GREATEST), (LEAST, GREATEST))
                )

    def _output(self, kind: Kind, number: int, lo: int, hi: int) -> Signal:
        safe = self.number("safe", min(max(lo, 0), hi), lo, hi)
        return Signal(
            self.name.value, kind, IntType(lo, hi), number, safe=safe, span=self.name.span
        )

    def _analog(self, number: int) -> Signal:
        bits = self.number("bits", 12, 1, 24)
        is_signed = bool(self.word("signed", {"true": 1, "false": 0}, 0))
        lo, hi = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if is_signed else (0, 2**bits - 1)
        points = self._scale(lo, hi)
        valid = self._range("valid", (lo, hi), (lo, hi))
        inside = [x for x, _ in points if valid[0] <= x <= valid[1]]
        reached = [scaled(points, x) for x in (*valid, *inside)]
        return Signal(
            self.name.value,
            Kind.ANALOG_IN,
            IntType(min(reached), max(reached)),
            number,
            bits=bits,
            is_signed=is_signed,
            points=points,
            lowpass=self.cycles("lowpass", LONGEST_LOWPASS),
            valid=valid,
            span=self.name.span,
        )

    def _scale(self, lo: int, hi: int) -> tuple[tuple[int, int], ...]:
        """Return the points of the scale; without one a raw value is its own meaning."""
        if "scale" not in self.options:
            return ((lo, lo), (hi, hi))
        found: list[tuple[int, int]] = []
        for key, value in entries_of(self.options["scale"], "`scale`", self.findings):
            text = require_text(value, f"what {key} means", self.findings)
            raw = integer(key, self.findings)
            meant = None if text is None else integer(text, self.findings)
            if raw is None or meant is None:
                return ((lo, lo), (hi, hi))
            if not lo <= raw <= hi or not LEAST <= meant <= GREATEST:
                self._report(f"`{key}` of the scale is not within {lo}..{hi}", "correct it", key)
            elif found and raw <= found[-1][0]:
                self._report("the raw values of a scale must ascend", "put them in order", key)
            else:
                found.append((raw, meant))
        if len(found) < 2:
            self._report("a scale has two points or more", "write `scale: {0: -400, 4095: 1000}`")
            return ((lo, lo), (hi, hi))
        return tuple(found)

    def _register(self, signal: Signal) -> Register | None:
        node = self.options.get("register")
        if node is None:
            return None
        if not isinstance(node, Mapping):
            node = Mapping(((self.name.with_value("at"), node),), node.span)
        check_keys(node, wire_keys.REGISTER, "a register", self.findings)
        parts = _Options(
            self.name, {k.value: v for k, v in node.entries}, self.period, self.findings
        )
        access = parts.number("access", 32, 8, 32)
        offset = parts.number("at", 0, 0, 2**24)
        shift = parts.number("shift", 0, 0, access - 1)
        width = 1 if isinstance(signal.type, BoolType) else access - shift
        if signal.kind in (Kind.COUNTER, Kind.ANALOG_IN):
            width = signal.bits
        bits = parts.number("bits", width, 1, 32)
        lo, hi = (0, 1) if isinstance(signal.type, BoolType) else (signal.type.lo, signal.type.hi)
        is_signed = signal.is_signed if signal.kind is Kind.ANALOG_IN else lo < 0
        is_signed = is_signed and signal.kind is not Kind.COUNTER
        if "at" not in parts.options:
            self._report(f"the register of `{self.name}` has no address", "write `register: 0x10`")
        elif access not in (8, 16, 32) or offset % (access // 8):
            self._report(
                f"`{self.name}` is not at a multiple of its access of 8, 16 or 32 bits", "move it"
            )
        elif shift + bits > access:
            self._report(f"`{self.name}` does not fit into its register", "widen the access")
        elif signal.kind in (Kind.PWM, Kind.NUMBER_OUT) and not (
            -(2 ** (bits - 1)) <= lo and hi < 2 ** (bits - 1) if is_signed else hi < 2**bits
        ):
            self._report(
                f"{lo}..{hi} does not fit into {bits} bits",
                "widen the register, or narrow the range",
            )
        return Register(offset, access, shift, bits, is_signed)

    def _is_low(self) -> bool:
        return bool(self.word("active", {"high": 0, "low": 1}, 0))

    def text(self, key: str) -> Text | None:
        """Return the text of a key."""
        return require_text(self.options.get(key), f"`{key}`", self.findings)

    def word(self, key: str, words: dict[str, int], otherwise: int) -> int:
        """Return the meaning of one of some words."""
        text = self.text(key)
        if text is None:
            return otherwise
        if text.value not in words:
            known = ", ".join(f"`{word}`" for word in words)
            self.findings.add(
                "unexpected-value", f"`{key}` is not `{text}`", text, help=f"use one of {known}"
            )
        return words.get(text.value, otherwise)

    def number(self, key: str, otherwise: int, lo: int, hi: int) -> int:
        """Return a whole number within a range."""
        text = self.text(key)
        number = None if text is None else integer(text, self.findings)
        if number is None:
            return otherwise
        if not lo <= number <= hi:
            self._report(f"`{key}` of `{self.name}` is within {lo}..{hi}", "correct it", text)
            return otherwise
        return number

    def _range(
        self, key: str, otherwise: tuple[int, int], within: tuple[int, int]
    ) -> tuple[int, int]:
        text = self.text(key)
        if text is None:
            return otherwise
        dots = text.value.find("..")
        if dots < 0:
            self._report(f"`{text}` is not a range", "write `least..greatest`", text)
            return otherwise
        lo = integer(text.part(0, dots), self.findings)
        hi = integer(text.part(dots + 2, len(text.value)), self.findings)
        if lo is None or hi is None:
            return otherwise
        if not within[0] <= lo <= hi <= within[1]:
            self._report(
                f"`{key}` of `{self.name}` is a range within {within[0]}..{within[1]}",
                "write the minimum first",
                text,
            )
            return otherwise
        return lo, hi

    def cycles(self, key: str, most: int) -> int:
        """Return a duration in cycles, rounded up; 0 without one."""
        text = self.text(key)
        micros = None if text is None else read_duration(text, Scope(tick=1), self.findings)
        if micros is None:
            return 0
        count = -(-micros // self.period)
        if count > most:
            self._report(
                f"`{key}` of `{self.name}` is longer than {most} cycles", "shorten it", text
            )
            return 0
        return count

    def _report(self, message: str, advice: str, at: Text | None = None) -> None:
        self.findings.add("broken-board", message, at or self.name, help=advice)
