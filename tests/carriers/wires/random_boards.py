"""Random boards: a chart of inputs and counted events, and wires of every kind."""

from __future__ import annotations

import random
from dataclasses import dataclass, field

BITS, NUMBERS, EVENTS = 8, 4, 6
WHOLE = "-2147483648..2147483647"
CHART = "\n".join((
    "chart: Mould",
    "inputs:",
    *(f"  b{n}: bool" for n in range(BITS)),
    *(f"  n{n}: {WHOLE}" for n in range(NUMBERS)),
    "  e: Level",
    "types: {Level: [low, middle, high]}",
    "capacity: {queue: 32}",
    "data:",
    *(f"  k{n}: uint16 = 0" for n in range(EVENTS)),
    "events:",
    f"  in: [{', '.join(f'on{n}' for n in range(EVENTS))}]",
    "states:",
    "  counting:",
    "    on:",
    *(f"      on{n}: {{do: k{n} += 1}}" for n in range(EVENTS)),
    "",
))  # fmt: skip


@dataclass
class Maker:
    """Makes the wires of one board."""

    draw: random.Random
    signals: list[str] = field(default_factory=list)
    bits: list[str] = field(default_factory=list)
    numbers: list[str] = field(default_factory=list)
    exact: list[str] = field(default_factory=list)
    """Numbers that may be compared."""
    analog: dict[str, tuple[int, int]] = field(default_factory=dict)
    ranged: list[str] = field(default_factory=list)
    """Those that can be invalid."""

    def text(self) -> str:
        """Return the file."""
        draw = self.draw
        for number in range(draw.randint(2, 5)):
            self.bits.append(f"d{number}")
            active = draw.choice(["high", "low"])
            debounce = draw.choice(["", ", debounce: 3ms", ", debounce: 1500us", ", debounce: 7ms"])
            self.signals.append(f"d{number}: {{digital_in: {number}, active: {active}{debounce}}}")
        for number in range(draw.randint(1, 2)):
            self.numbers.append(f"c{number}")
            self.exact.append(f"c{number}")
            bits = draw.choice([1, 2, 8, 12, 16, 31, 32])
            self.signals.append(f"c{number}: {{counter: {number}, bits: {bits}}}")
        for number in range(draw.randint(1, 3)):
            self._analog(number)
        for number in range(draw.randint(1, 2)):
            self.numbers.append(f"m{number}")
            self.exact.append(f"m{number}")
            self.ranged.append(f"m{number}")
            least = draw.randint(-5, 3)
            limits = f"{least}..{least + draw.randint(1, 9)}"
            self.signals.append(f"m{number}: {{number_in: {number}, range: {limits}}}")
        self.signals.append(f"f0: {{flag: {draw.choice(['on', 'off'])}}}")
        flag = self._bit()
        self.bits.append("f0")
        low = draw.choice(["high", "low"])
        self.signals.append(
            f"o0: {{digital_out: 0, active: {low}, safe: {draw.choice(['on', 'off'])}}}"
        )
        self.signals.append(
            f"o1: {{pwm: 0, full: 1000, signed: true, safe: {draw.randint(-9, 9)}}}"
        )
        self.signals.append(f"o2: {{number_out: 0, range: {WHOLE}}}")
        level = ", ".join(f"{name}: {self._bit()}" for name in ("low", "high"))
        lines = ["board: a", "deployment: deployment.yaml", "period: 1ms", "signals:"]
        lines += [f"  {line}" for line in self.signals]
        lines += ["bind:", "  mould:"]
        lines += [f"    b{number}: {self._bit()}" for number in range(BITS)]
        lines += [f"    n{number}: {self._number()}" for number in range(NUMBERS)]
        lines += [f"    e: {{when: {{{level}}}, else: middle}}"]
        lines += [f"    on{number}: {self._trigger()}" for number in range(EVENTS)]
        lines += ["set:", f"  f0: {flag}", f"  o0: {self._bit()}"]
        lines += [f"  o1: '{self._test()} ? {draw.randint(-1000, 1000)} : 7'"]
        lines += [f"  o2: {self._number()}"]
        lines += [f"off: {{when: '{self._test()}', keep: [{draw.choice(['o0', 'o1', 'o2'])}]}}"]
        return "\n".join((*lines, ""))

    def _analog(self, number: int) -> None:
        draw = self.draw
        bits, is_signed = draw.choice([3, 8, 12, 24]), draw.random() < 0.4
        low = -(2 ** (bits - 1)) if is_signed else 0
        high = low + 2**bits - 1
        options = [f"bits: {bits}", f"signed: {'true' if is_signed else 'false'}"]
        span = (low, high)
        if draw.random() < 0.8:
            raws = sorted(draw.sample(range(low, high + 1), draw.randint(2, 5)))
            reach = draw.choice([5, 1000, 2**31 - 1])
            meant = [draw.randint(-reach, reach) for _ in raws]
            span = (min(meant), max(meant))
            points = ", ".join(f"{x}: {y}" for x, y in zip(raws, meant, strict=True))
            options.append(f"scale: {{{points}}}")
        if draw.random() < 0.6:
            options.append(f"lowpass: {draw.choice(['1ms', '5ms', '300ms', '32s'])}")
        if draw.random() < 0.5:
            least, greatest = sorted(draw.sample(range(low, high + 1), 2))
            options.append(f"valid: {least}..{greatest}")
            span = (1, 0)  # the scale may reach less
        name = f"a{number}"
        self.numbers.append(name)
        self.ranged.append(name)
        if span[1] - span[0] > 4:
            self.analog[name] = span
        self.signals.append(f"{name}: {{analog_in: {number}, {', '.join(options)}}}")

    def _test(self) -> str:
        """Return a condition."""
        draw = self.draw
        if draw.random() < 0.3:
            sign = draw.choice(["==", "!=", "<", "<=", ">", ">="])
            return f"{draw.choice(self.exact)} {sign} {draw.randint(-4, 4)}"
        first = f"{draw.choice(['', 'not '])}{draw.choice(self.bits)}"
        if draw.random() < 0.5:
            return first
        return f"{first} {draw.choice(['and', 'or', '=='])} {draw.choice(self.bits)}".replace(
            "not ", "" if "==" in first else "not "
        )

    def _bit(self) -> str:
        draw = self.draw
        chosen = draw.random()
        if chosen < 0.3 and self.analog:
            name = draw.choice(list(self.analog))
            least, greatest = self.analog[name]
            below, above = sorted(draw.sample(range(least + 1, greatest), 2))
            return f"{{of: {name}, above: {above}, below: {below}}}"
        if chosen < 0.5:
            return f"{{invalid: {draw.choice(self.ranged)}, for: {draw.choice(['1ms', '4ms'])}}}"
        return f"'{self._test()}'"

    def _number(self) -> str:
        draw = self.draw
        if draw.random() < 0.3:
            one, other = draw.sample(self.numbers, 2)
            return f"'{self._test()} ? {one} : {other}'"
        if draw.random() < 0.3:
            return "'m0 * m0 - 3 * m0'"
        return draw.choice(self.numbers)

    def _trigger(self) -> str:
        draw = self.draw
        condition = f", while: '{self._test()}'" if draw.random() < 0.4 else ""
        match draw.randrange(6):
            case 0:
                return f"{{rising: '{self._test()}'{condition}}}"
            case 1:
                return f"{{falling: '{self._test()}'{condition}}}"
            case 2:
                return f"{{changed: {draw.choice([*self.numbers, *self.bits])}{condition}}}"
            case 3:
                return f"{{while: '{self._test()}'}}"
            case 4:
                return f"{{invalid: {draw.choice(self.ranged)}, for: 2ms{condition}}}"
            case _:
                return f"{{is: {draw.randint(-1, 1)}, of: c0{condition}}}"
