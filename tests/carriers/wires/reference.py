"""The meaning of wires in Python, cycle by cycle: what the generated C is compared with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from fsmkit.carriers.wires.board import (
    Board,
    Cases,
    Edge,
    Formula,
    Hysteresis,
    Invalid,
    Kind,
    Origin,
    Signal,
    Wire,
)
from fsmkit.carriers.wires.signals import scaled
from fsmkit.language import BoolType, Expr, IntType, Value, evaluate


class Environment:
    """Variables of a formula; nothing else stands in one."""

    def __init__(self, variable: Callable[[str], Value]) -> None:
        self.variable = variable

    def range_error(self) -> None:
        raise AssertionError("no value of a board is saturated")

    def __getattr__(self, name: str) -> Callable[..., Value]:
        raise AssertionError(name)


@dataclass
class Reference:
    """A board without devices and operations."""

    board: Board
    values: list[int] = field(default_factory=list)
    counted: dict[int, int] = field(default_factory=dict)
    last: dict[int, int] = field(default_factory=dict)
    filtered: dict[int, int] = field(default_factory=dict)
    invalid: dict[int, int] = field(default_factory=dict)
    beyond: dict[Hysteresis, bool] = field(default_factory=dict)
    was: dict[int, int] = field(default_factory=dict)
    posted: dict[int, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for signal in self.board.signals:
            start = signal.safe
            if signal.is_input and isinstance(signal.type, IntType):
                start = min(max(0, signal.type.lo), signal.type.hi)
            self.values.append(start)

    def read(self, raw: Sequence[int]) -> None:
        """Take in what hardware has, by the number of the signal."""
        for number, signal in enumerate(self.board.signals):
            if signal.is_input:
                self._reading(number, signal, raw[number])

    def _reading(self, number: int, signal: Signal, raw: int) -> None:
        before = self.values[number]
        if signal.kind is Kind.DIGITAL_IN:
            level = int((raw != 0) != signal.is_low)
            self.counted[number] = self.counted.get(number, 0) + 1 if level != before else 0
            if self.counted[number] >= signal.debounce:
                self.values[number] = level
                self.counted[number] = 0
        elif signal.kind is Kind.COUNTER:
            size = 2**signal.bits
            moved = (raw - self.last[number]) % size if number in self.last else raw % size
            if number in self.last and moved >= size // 2 and signal.bits < 32:
                moved -= size
            self.last[number] = raw % size
            self.values[number] = (before + moved + 2**31) % 2**32 - 2**31
        elif signal.valid[0] <= raw <= signal.valid[1]:
            self.invalid[number] = 0
            self.values[number] = raw
            if signal.kind is Kind.ANALOG_IN:
                self.values[number] = self._filtered(number, signal, scaled(signal.points, raw))
        else:
            self.invalid[number] = self.invalid.get(number, 0) + 1

    def _filtered(self, number: int, signal: Signal, value: int) -> int:
        reading = value * 65536
        if number not in self.filtered:
            self.filtered[number] = reading
        else:
            gap = reading - self.filtered[number]
            step = abs(gap) // (signal.lowpass + 1)
            self.filtered[number] += step if gap > 0 else -step
        return (self.filtered[number] + 32768) // 65536

    def to_machines(self) -> list[int]:
        """Return the inputs of the machine in their order; count what is posted."""
        for found in self._hystereses():
            value = self.values[found.signal]
            if value > found.above:
                self.beyond[found] = True
            elif value < found.below:
                self.beyond[found] = False
        for bound in self.board.following:
            if self.board.signals[bound.signal].kind is Kind.FLAG:
                self.values[bound.signal] = self.of(bound.origin)
        inputs = {bound.input: self.of(bound.origin) for bound in self.board.inputs}
        for number, event in enumerate(self.board.events):
            now, before = self.of(event.watched), self.was.get(number, 0)
            is_so = {
                Edge.RISING: now > before,
                Edge.FALLING: now < before,
                Edge.CHANGED: now != before,
                Edge.ALWAYS: bool(now),
            }[event.edge]
            self.was[number] = now
            if is_so and (event.condition is None or self.of(event.condition)):
                self.posted[event.event] = self.posted.get(event.event, 0) + 1
        return [inputs[number] for number in sorted(inputs)]

    def from_machines(self) -> list[int]:
        """Return the raw outputs, in the order of the signals."""
        for bound in self.board.following:
            if self.board.signals[bound.signal].is_output:
                self.values[bound.signal] = self.of(bound.origin)
        is_off = self.board.off is not None and bool(self.of(self.board.off))
        raw = []
        for number, signal in enumerate(self.board.signals):
            if signal.is_output:
                value = signal.safe if is_off and not signal.is_kept else self.values[number]
                raw.append(value ^ signal.is_low)
        return raw

    def _hystereses(self) -> set[Hysteresis]:
        origins: list[Origin] = [bound.origin for bound in self.board.inputs]
        origins += [bound.watched for bound in self.board.events]
        origins += [bound.origin for bound in self.board.following]
        bits = [
            b for o in origins for b in ([c for _, c in o.cases] if isinstance(o, Cases) else [o])
        ]
        return {bit for bit in bits if isinstance(bit, Hysteresis)}

    def of(self, origin: Origin) -> int:
        """Return a value of any origin."""
        match origin:
            case Formula(expression, meanings):
                return self._evaluated(expression, meanings)
            case Hysteresis():
                return int(self.beyond.get(origin, False))
            case Invalid(signal, readings):
                return int(min(self.invalid.get(signal, 0), 65535) >= readings)
            case Cases(cases, otherwise):
                return next((value for value, bit in cases if self.of(bit)), otherwise)
            case _:
                raise AssertionError(origin)

    def _evaluated(self, expression: Expr, meanings: object) -> int:
        def variable(name: str) -> Value:
            meaning = meanings[name]  # type: ignore[index]
            assert isinstance(meaning, Wire)
            value = self.values[meaning.signal]
            is_bit = isinstance(self.board.signals[meaning.signal].type, BoolType)
            return bool(value) if is_bit else value

        value = evaluate(expression, Environment(variable))  # type: ignore[arg-type]
        assert isinstance(value, int)
        return int(value)
