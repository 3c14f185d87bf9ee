"""Expressions in JavaScript, with exactly the meaning of the typed tree.

An integer is a number where every value of its type is a safe one, else BigInt. What is computed
of numbers is one only if each operand and the result before it is reduced is sure to be safe, by
the types alone (`fsmkit.chart.analysis.ranges`); else it is computed of BigInt.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import assert_never

import fsmkit.language as lang
from fsmkit.chart.analysis.effects import is_inside
from fsmkit.chart.analysis.ranges import Range, range_of, raw_range, within
from fsmkit.chart.chart import Operation
from fsmkit.emit.javascript import member, quoted
from fsmkit.language.arithmetic import width
from fsmkit.language.values import part_types

SAFE = 2**53 - 1
"""The greatest integer that a number holds with all below it (ECMA-262, MAX_SAFE_INTEGER)."""
ALL_BIG = -1
"""Instead of `SAFE`: every integer is BigInt, the oracle of the tests."""

CHOICE, OR, AND, BITOR, BITXOR, BITAND, EQUAL, COMPARE, SHIFT, SUM, PRODUCT, SIGN, ATOM = range(
    1, 14
)
INFIX: Mapping[lang.BinaryOp, tuple[str, int]] = {
    lang.BinaryOp.OR: ("||", OR),
    lang.BinaryOp.AND: ("&&", AND),
    lang.BinaryOp.LT: ("<", COMPARE),
    lang.BinaryOp.LE: ("<=", COMPARE),
    lang.BinaryOp.GT: (">", COMPARE),
    lang.BinaryOp.GE: (">=", COMPARE),
    lang.BinaryOp.BIT_OR: ("|", BITOR),
    lang.BinaryOp.BIT_XOR: ("^", BITXOR),
    lang.BinaryOp.BIT_AND: ("&", BITAND),
    lang.BinaryOp.SHIFT_LEFT: ("<<", SHIFT),
    lang.BinaryOp.SHIFT_RIGHT: (">>", SHIFT),
    lang.BinaryOp.ADD: ("+", SUM),
    lang.BinaryOp.SUB: ("-", SUM),
    lang.BinaryOp.MUL: ("*", PRODUCT),
}
EQUALITY = {lang.BinaryOp.EQ: "==", lang.BinaryOp.NE: "!="}
LOGIC = (lang.BinaryOp.OR, lang.BinaryOp.AND)
ORDER = (lang.BinaryOp.LT, lang.BinaryOp.LE, lang.BinaryOp.GT, lang.BinaryOp.GE)
BITS = (lang.BinaryOp.BIT_AND, lang.BinaryOp.BIT_OR, lang.BinaryOp.BIT_XOR)
SHIFTS = (lang.BinaryOp.SHIFT_LEFT, lang.BinaryOp.SHIFT_RIGHT)
PLACES = {lang.Storage.DATA: "data", lang.Storage.INPUT: "inputs", lang.Storage.OUTPUT: "outputs"}
QUOTIENTS = {lang.BinaryOp.DIV: "rt.divide", lang.BinaryOp.REM: "rt.remainder"}
INT32_RANGE, UINT32_RANGE = (lang.INT32.lo, lang.INT32.hi), (lang.UINT32.lo, lang.UINT32.hi)


@dataclass(frozen=True, slots=True)
class Fragment:
    """Printed text and how tightly it binds."""

    text: str
    binds: int = ATOM

    def at(self, binds: int) -> str:
        """Return the text, in parentheses unless it binds that tightly."""
        return self.text if self.binds >= binds else f"({self.text})"


@dataclass(frozen=True, slots=True)
class Printer:
    """Prints expressions; ``payload``: where the fields of the event at hand are.

    ``safe``: integers beyond it are BigInt.
    """

    operations: Mapping[str, Operation]
    safe: int = SAFE
    payload: Mapping[str, int] | None = None
    """None where it is not known which event is at hand: looked up when needed."""
    functions: Mapping[str, str] = field(default_factory=dict)
    """What the functions of the chart are called."""
    locals: Mapping[str, str] = field(default_factory=dict)
    """What local variables are called."""

    def is_big(self, type_: lang.Type | None) -> bool:
        """Whether values of a type are BigInt."""
        return isinstance(type_, lang.IntType) and not self._is_safe((type_.lo, type_.hi))

    def _is_safe(self, *ranges: Range | None) -> bool:
        return all(r is not None and -self.safe <= r[0] and r[1] <= self.safe for r in ranges)

    def print(self, expr: lang.Expr, type_: lang.Type | None = None) -> str:
        """Return an expression as text, as values of a type are held; by default of its own."""
        folded = lang.fold(expr)
        if type_ is None:
            return self.fragment(folded).text
        return self.held(self.fragment(folded), folded.type, type_).text

    def held(self, text: Fragment, source: lang.Type | None, type_: lang.Type) -> Fragment:
        """Return a value of one type as values of another are held."""
        if isinstance(type_, lang.ArrayType) and isinstance(source, lang.ArrayType):
            if self.is_big(source.element) == self.is_big(type_.element):
                return text
            way = "BigInt" if self.is_big(type_.element) else "Number"
            return Fragment(f"{text.at(ATOM)}.map({way})")
        if isinstance(source, lang.IntType) and isinstance(type_, lang.IntType):
            return self._as(text, self.is_big(source), big=self.is_big(type_))
        if isinstance(source, lang.IntType) and not isinstance(type_, lang.IntType):
            return self._as(text, self.is_big(source), big=False)
        return text

    def moved(self, text: str, source: lang.Type, type_: lang.Type) -> str:
        """Return a value of one type, at hand as a text, as values of another are held."""
        return self.held(Fragment(text), source, type_).text

    def _as(self, text: Fragment, is_big: bool, *, big: bool) -> Fragment:
        if is_big == big:
            return text
        return Fragment(f"{'BigInt' if big else 'Number'}({text.text})")

    def _whole(self, expr: lang.Expr, *, big: bool) -> Fragment:
        """Return a whole number as a number or as BigInt."""
        if isinstance(expr, lang.Literal) and isinstance(expr.value, int):
            return _integer(int(expr.value), big=big)
        return self._as(self.fragment(expr), self.is_big(expr.type), big=big)

    def fragment(self, expr: lang.Expr) -> Fragment:
        """Return an expression as text that can stand inside more text."""
        match expr:
            case lang.Literal(value, type_):
                return Fragment(
                    text := self.spell(value, type_), SIGN if text.startswith("-") else ATOM
                )
            case lang.Variable(name, storage=lang.Storage.LOCAL):
                return Fragment(self.locals[name])
            case lang.Variable(name, storage=storage):
                return Fragment(f"m.{PLACES[storage]}{member(name)}")
            case lang.EventField(name, type_):
                return self._field(name, type_)
            case lang.EventType():
                return Fragment("m._eventType()")
            case lang.EventName():
                return Fragment("m._eventName()")
            case lang.InState(state):
                return Fragment(f"m._active[{state}]")
            case lang.Unary():
                return self._unary(expr)
            case lang.Binary():
                return self._binary(expr)
            case lang.Conditional(test, then, otherwise, type_):
                one, other = (
                    self.held(self.fragment(side), side.type, type_) for side in (then, otherwise)
                )
                text = f"{self.fragment(test).at(OR)} ? {one.at(OR)} : {other.at(CHOICE)}"
                return Fragment(text, CHOICE)
            case lang.Element():
                return Fragment(f"{self.fragment(expr.array).at(ATOM)}[{self.index(expr)}]")
            case lang.Member(record, name):
                return Fragment(f"{self.fragment(record).at(ATOM)}[{place_of(record.type, name)}]")
            case lang.Apply():
                return self._apply(expr)
            case lang.Call():
                return self.call(expr)
            case lang.CallFunction():
                return self._call_function(expr)
            case lang.Checked():
                return self._checked(expr)
            case lang.Convert(operand, type_):
                return self._convert(operand, type_)
            case lang.Watched(operand) | lang.Decided(operand):
                return self.fragment(operand)
            case lang.Invalid(reason):
                return Fragment(f"rt.cannot({quoted(reason)})")
            case _:
                assert_never(expr)

    def call(self, expr: lang.Call) -> Fragment:
        """Return a call of the host, which is told of by the trace."""
        operation = self.operations[expr.operation]
        pairs = zip(expr.arguments, operation.parameters, strict=True)
        passed = ", ".join(self.print(argument, part.type) for argument, part in pairs)
        has_result = "false" if operation.result is None else "true"
        return Fragment(f"m._operation({quoted(expr.operation)}, [{passed}], {has_result})")

    def _call_function(self, expr: lang.CallFunction) -> Fragment:
        pairs = zip(expr.arguments, expr.function.parameters, strict=True)
        passed = [self.print(argument, part.type) for argument, part in pairs]
        return Fragment(f"{self.functions[expr.function.name]}({', '.join(('m', *passed))})")

    def _checked(self, expr: lang.Checked) -> Fragment:
        if not isinstance(expr.type, lang.EnumType):
            return Fragment(f"rt.integer({self._real(expr.operand).text})")
        number = self.fragment(expr.operand).text
        other = "" if expr.otherwise is None else f", {self.fragment(expr.otherwise).text}"
        return Fragment(f"rt.member({number}, [{', '.join(map(str, expr.type.numbers))}]{other})")

    def index(self, expr: lang.Element) -> str:
        """Return the index of an element, checked unless it cannot be outside."""
        index, array = expr.index, expr.array.type
        assert isinstance(array, lang.ArrayType)  # noqa: S101
        if is_inside(index, array.length):
            return self._whole(index, big=False).text
        return f"rt.position({self.fragment(index).text}, {array.length})"

    def _field(self, name: str, type_: lang.Type) -> Fragment:
        if self.payload is not None:
            return Fragment(f"m._at.payload[{self.payload[name]}]")
        text = f"m._field({quoted(name)})"  # of several events, whose types may differ
        if isinstance(type_, lang.IntType):
            text = f"{'BigInt' if self.is_big(type_) else 'Number'}({text})"
        return Fragment(text)

    def _unary(self, expr: lang.Unary) -> Fragment:
        operand = self.fragment(expr.operand)
        if expr.op is lang.UnaryOp.NOT:
            return Fragment(f"!{operand.at(SIGN)}", SIGN)
        if isinstance(expr.type, lang.FloatType):
            return Fragment(f"-{operand.at(ATOM)}", SIGN)
        big = not self._is_safe(range_of(expr.operand), raw_range(expr))
        inner = self._whole(expr.operand, big=big)
        if big:
            return self._reduced(Fragment(f"{expr.op.value}{inner.at(ATOM)}", SIGN), expr, big=True)
        start = "0" if expr.op is lang.UnaryOp.NEGATE else "-1"  # never -0
        return self._reduced(Fragment(f"{start} - {inner.at(PRODUCT)}", SUM), expr, big=False)

    def _binary(self, expr: lang.Binary) -> Fragment:
        op, left, right = expr.op, expr.left, expr.right
        if op in LOGIC:
            text, binds = INFIX[op]
            inner = f"{self.fragment(left).at(binds)} {text} {self.fragment(right).at(binds + 1)}"
            return Fragment(inner, binds)
        if op in EQUALITY:
            # loosely only between a number and BigInt, which then compare as numbers do
            is_mixed = self.is_big(left.type) != self.is_big(right.type)
            text = EQUALITY[op] + ("" if is_mixed else "=")
            one, other = (self.fragment(part).at(COMPARE) for part in (left, right))
            return Fragment(f"{one} {text} {other}", EQUAL)
        if op in ORDER:
            one, other = (self.fragment(part).at(SHIFT) for part in (left, right))
            return Fragment(f"{one} {INFIX[op][0]} {other}", COMPARE)
        if isinstance(expr.type, lang.FloatType):
            text, binds = ("/", PRODUCT) if op is lang.BinaryOp.DIV else INFIX[op]
            one, other = self._real(left).at(binds), self._real(right).at(binds + 1)
            return Fragment(f"{one} {text} {other}", binds)
        return self._whole_numbers(expr)

    def _real(self, expr: lang.Expr) -> Fragment:
        return self._as(self.fragment(expr), self.is_big(expr.type), big=False)

    def _whole_numbers(self, expr: lang.Binary) -> Fragment:
        a, b, raw = range_of(expr.left), range_of(expr.right), raw_range(expr)
        if a is not None and b is not None and self._is_safe(a, b, raw):
            found = self._numbers(expr, a, b)
            if found is not None:
                return self._reduced(found, expr, big=False)
        left, right = self._whole(expr.left, big=True), self._whole(expr.right, big=True)
        if expr.op in QUOTIENTS:
            text = Fragment(f"{QUOTIENTS[expr.op]}({left.text}, {right.text})")
            return self._reduced(text, expr, big=True)
        infix, binds = INFIX[expr.op]
        if expr.op in SHIFTS:
            assert isinstance(expr.type, lang.IntType)  # noqa: S101
            bits = 5 if width(expr.type) == 32 else 6
            right = Fragment(f"BigInt.asUintN({bits}, {right.text})")
        text = Fragment(f"{left.at(binds)} {infix} {right.at(binds + 1)}", binds)
        return self._reduced(text, expr, big=True)

    def _numbers(self, expr: lang.Binary, a: Range, b: Range) -> Fragment | None:
        """Return an operation of numbers, all safe; None where BigInt has to do it."""
        op = expr.op
        left, right = self._whole(expr.left, big=False), self._whole(expr.right, big=False)
        if op in QUOTIENTS:
            return Fragment(f"{QUOTIENTS[op]}({left.text}, {right.text})")
        if op in BITS:
            infix, binds = INFIX[op]
            text = Fragment(f"{left.at(binds)} {infix} {right.at(binds + 1)}", binds)
            if within(a, INT32_RANGE) and within(b, INT32_RANGE):
                return text
            if within(a, UINT32_RANGE) and within(b, UINT32_RANGE):
                return Fragment(f"{text.at(SUM)} >>> 0", SHIFT)
            return None
        if op in SHIFTS:
            if not within(b, (0, 31)):
                return None
            if op is lang.BinaryOp.SHIFT_LEFT:
                return Fragment(f"{left.at(PRODUCT)} * 2 ** {right.at(ATOM)}", PRODUCT)
            return Fragment(f"Math.floor({left.at(PRODUCT)} / 2 ** {right.at(ATOM)})")
        infix, binds = INFIX[op]
        text = Fragment(f"{left.at(binds)} {infix} {right.at(binds + 1)}", binds)
        if op is lang.BinaryOp.MUL and (a[0] < 0 or b[0] < 0):
            return Fragment(f"{text.text} + 0", SUM)  # never -0
        return text

    def _apply(self, expr: lang.Apply) -> Fragment:
        parts = expr.arguments
        if isinstance(expr.type, lang.FloatType):
            texts = [self._real(part).text for part in parts]
            name = {lang.Function.MIN: "rt.least", lang.Function.MAX: "rt.greatest"}.get(
                expr.function, "Math.abs"
            )
            return Fragment(f"{name}({', '.join(texts)})")
        big = not self._is_safe(*map(range_of, parts), raw_range(expr))
        texts = [self._whole(part, big=big).text for part in parts]
        match expr.function:
            case lang.Function.MIN:
                name = "rt.least"
            case lang.Function.MAX:
                name = "rt.greatest"
            case lang.Function.ABS:
                name = "rt.magnitude" if big else "Math.abs"
            case _:
                assert_never(expr.function)
        return self._reduced(Fragment(f"{name}({', '.join(texts)})"), expr, big=big)

    def _reduced(self, text: Fragment, expr: lang.Expr, *, big: bool) -> Fragment:
        """Return a result reduced to its type if that wraps around, as its type is held."""
        type_, raw = expr.type, raw_range(expr)
        if not isinstance(type_, lang.IntType) or type_.overflow is not lang.Overflow.WRAP:
            return self._as(text, big, big=self.is_big(type_))
        if raw is not None and within(raw, (type_.lo, type_.hi)):
            return self._as(text, big, big=self.is_big(type_))
        return self._wrapped(text, None if big else raw, type_, big=big)

    def _wrapped(
        self, text: Fragment, raw: Range | None, type_: lang.IntType, *, big: bool
    ) -> Fragment:
        """Return a value modulo the size of a range; ``raw`` is that of a safe number."""
        bounds = (type_.lo, type_.hi)
        if not big and not self.is_big(type_) and raw is not None:
            if bounds == INT32_RANGE:
                return Fragment(f"{text.at(BITXOR)} | 0", BITOR)
            if bounds == UINT32_RANGE:
                return Fragment(f"{text.at(SHIFT)} >>> 0", SHIFT)
            if type_.lo == 0 and type_.hi < 2**31 and type_.hi & (type_.hi + 1) == 0:
                return Fragment(f"{text.at(EQUAL)} & {type_.hi}", BITAND)
            distance = (raw[0] - type_.lo, raw[1] - type_.lo)
            if self._is_safe(distance, (0, type_.hi - type_.lo + 1)):
                return Fragment(f"rt.around({text.text}, {type_.lo}, {type_.hi})")
        inner = self._as(text, big, big=True).text
        size = type_.hi - type_.lo + 1
        if type_.lo == 0 and size & (size - 1) == 0:
            found = Fragment(f"BigInt.asUintN({size.bit_length() - 1}, {inner})")
        elif type_.lo == -type_.hi - 1 and size & (size - 1) == 0:
            found = Fragment(f"BigInt.asIntN({size.bit_length() - 1}, {inner})")
        else:
            found = Fragment(f"rt.around({inner}, {type_.lo}n, {type_.hi}n)")
        return self._as(found, is_big=True, big=self.is_big(type_))

    def _convert(self, operand: lang.Expr, type_: lang.Type) -> Fragment:
        match type_:
            case lang.FloatType(bits):
                text = self._real(operand)
                return Fragment(f"Math.fround({text.text})") if bits == 32 else text
            case lang.IntType(overflow=lang.Overflow.NEAREST) if isinstance(
                operand.type, lang.EnumType | lang.DurationType
            ):
                return self._as(self.fragment(operand), is_big=False, big=self.is_big(type_))
            case lang.IntType() | lang.DurationType():
                return self._bounded(operand, type_)
            case _:
                return self.fragment(operand)

    def _bounded(self, operand: lang.Expr, type_: lang.IntType | lang.DurationType) -> Fragment:
        """Bring a number into bounds, as `fsmkit.language.converted` does."""
        lo, hi, overflow = 0, lang.LONGEST_DURATION, lang.Overflow.SATURATE
        if isinstance(type_, lang.IntType):
            lo, hi, overflow = type_.lo, type_.hi, type_.overflow
        is_real = isinstance(operand.type, lang.FloatType)
        if isinstance(type_, lang.IntType) and overflow is lang.Overflow.WRAP and not is_real:
            is_big = self.is_big(operand.type)
            raw = None if is_big else range_of(operand)
            return self._wrapped(self.fragment(operand), raw, type_, big=is_big)
        big = self.is_big(type_) or (not is_real and self.is_big(operand.type))
        end = "n" if big else ""
        if is_real:
            how = "rt.truncateBig" if big else "rt.truncate"
            text = f"{how}({self.fragment(operand).text}, {lo}{end}, {hi}{end})"
        else:
            text = self._whole(operand, big=big).text
        way = {
            lang.Overflow.WRAP: "rt.nearest",  # a float is never wrapped around
            lang.Overflow.NEAREST: "rt.nearest",
            lang.Overflow.FAULT: "rt.bounded",
            lang.Overflow.SATURATE: "m._clamp",
        }[overflow]
        found = Fragment(f"{way}({text}, {lo}{end}, {hi}{end})")
        return self._as(found, big, big=self.is_big(type_))

    def spell(self, value: lang.Value, type_: lang.Type) -> str:
        """Return a constant; arrays and records as arrays."""
        match value:
            case bool():
                return "true" if value else "false"
            case str():
                return quoted(value)
            case tuple():
                assert isinstance(type_, lang.ArrayType | lang.RecordType)  # noqa: S101
                pairs = zip(value, part_types(type_), strict=True)
                return f"[{', '.join(self.spell(part, of) for part, of in pairs)}]"
            case float() | int():
                if isinstance(type_, lang.FloatType):
                    text = repr(float(value))
                    return text.replace("inf", "Infinity").replace("nan", "NaN")
                return _integer(int(value), big=self.is_big(type_)).text
            case _:
                assert_never(value)


def _integer(value: int, *, big: bool) -> Fragment:
    return Fragment(f"{value}{'n' if big else ''}", SIGN if value < 0 else ATOM)


def place_of(type_: lang.Type | None, name: str) -> int:
    """Return where in a record its field stands."""
    assert isinstance(type_, lang.RecordType)  # noqa: S101
    return next(i for i, part in enumerate(type_.fields) if part.name == name)
