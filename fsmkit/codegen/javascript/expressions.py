"""Expressions in JavaScript, with exactly the meaning of the typed tree.

An integer is a number where every value of its type is a safe one, else BigInt. What is computed
of numbers is one only if each operand and the result before it is reduced is sure to be safe, by
the types alone (`fsmkit.chart.analysis.ranges`); else it is computed of BigInt.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, assert_never

import fsmkit.language as lang
from fsmkit.chart.analysis.effects import is_inside
from fsmkit.chart.analysis.ranges import Range, range_of, raw_range, within
from fsmkit.chart.chart import Operation
from fsmkit.emit.javascript import member, quoted
from fsmkit.language.arithmetic import width
from fsmkit.language.evaluation import field_position
from fsmkit.language.printing import ATOM, ExprPrinter, Fragment, Operator, left_assoc, prefix
from fsmkit.language.values import part_types
from fsmkit.plan.values import bounding, lowered, wrapping_bounds

SAFE = 2**53 - 1
"""The greatest integer up to which all integers are exact (ECMA-262, MAX_SAFE_INTEGER)."""
ALL_BIG = -1
"""A value for `SAFE` that makes every integer a BigInt: the oracle of the tests."""

CHOICE, OR, AND, BITOR, BITXOR, BITAND, EQUAL, COMPARE, SHIFT, SUM, PRODUCT, SIGN = range(1, 13)
EQUALITY = (lang.BinaryOp.EQ, lang.BinaryOp.NE)
ORDER = (lang.BinaryOp.LT, lang.BinaryOp.LE, lang.BinaryOp.GT, lang.BinaryOp.GE)
BITS = (lang.BinaryOp.BIT_AND, lang.BinaryOp.BIT_OR, lang.BinaryOp.BIT_XOR)
SHIFTS = (lang.BinaryOp.SHIFT_LEFT, lang.BinaryOp.SHIFT_RIGHT)
MEMBERS = {lang.Storage.DATA: "data", lang.Storage.INPUT: "inputs", lang.Storage.OUTPUT: "outputs"}
QUOTIENTS = {lang.BinaryOp.DIV: "rt.divide", lang.BinaryOp.REM: "rt.remainder"}
FUNCTIONS = {
    lang.Function.MIN: "rt.least",
    lang.Function.MAX: "rt.greatest",
    lang.Function.ABS: "Math.abs",
}
BOUNDING = {
    lang.Overflow.NEAREST: "rt.nearest",
    lang.Overflow.FAULT: "rt.bounded",
    lang.Overflow.SATURATE: "m._clamp",
}
INT32_RANGE, UINT32_RANGE = (lang.INT32.lo, lang.INT32.hi), (lang.UINT32.lo, lang.UINT32.hi)


@dataclass(frozen=True, slots=True)
class Printer(ExprPrinter):
    """Prints expressions; ``payload``: the position of each field of the current event.

    ``safe``: integers beyond it are BigInt.
    """

    operations: Mapping[str, Operation]
    safe: int = SAFE
    payload: Mapping[str, int] | None = None
    """None if the current event is unknown; the code then looks the position up."""
    functions: Mapping[str, str] = field(default_factory=dict)
    """The names of the chart's functions."""
    locals: Mapping[str, str] = field(default_factory=dict)
    """The names of local variables."""

    unary: ClassVar[Mapping[lang.UnaryOp, Operator]] = {
        lang.UnaryOp.NOT: prefix("!", SIGN, SIGN),
        lang.UnaryOp.NEGATE: prefix("-", SIGN, ATOM),
        lang.UnaryOp.INVERT: prefix("~", SIGN, ATOM),
    }
    binary: ClassVar[Mapping[lang.BinaryOp, Operator]] = {
        lang.BinaryOp.OR: left_assoc("||", OR),
        lang.BinaryOp.AND: left_assoc("&&", AND),
        lang.BinaryOp.BIT_OR: left_assoc("|", BITOR),
        lang.BinaryOp.BIT_XOR: left_assoc("^", BITXOR),
        lang.BinaryOp.BIT_AND: left_assoc("&", BITAND),
        **{op: Operator(op.value + "=", EQUAL, COMPARE, COMPARE) for op in EQUALITY},
        **{op: Operator(op.value, COMPARE, SHIFT, SHIFT) for op in ORDER},
        lang.BinaryOp.SHIFT_LEFT: left_assoc("<<", SHIFT),
        lang.BinaryOp.SHIFT_RIGHT: left_assoc(">>", SHIFT),
        lang.BinaryOp.ADD: left_assoc("+", SUM),
        lang.BinaryOp.SUB: left_assoc("-", SUM),
        lang.BinaryOp.MUL: left_assoc("*", PRODUCT),
        lang.BinaryOp.DIV: left_assoc("/", PRODUCT),
    }

    # --- numbers and BigInt -----------------------------------------------------------------------

    def is_big(self, type_: lang.Type | None) -> bool:
        """Whether values of a type are BigInt."""
        return isinstance(type_, lang.IntType) and not self._is_safe((type_.lo, type_.hi))

    def _is_safe(self, *ranges: Range | None) -> bool:
        return all(r is not None and -self.safe <= r[0] and r[1] <= self.safe for r in ranges)

    def print(self, expr: lang.Expr, type_: lang.Type | None = None) -> str:
        """Return an expression as text, as values of a type are held; by default of its own."""
        folded = lowered(expr)
        if type_ is None:
            return self.fragment(folded).text
        return self.held(self.fragment(folded), folded.type, type_).text

    def held(self, text: Fragment, source: lang.Type | None, type_: lang.Type) -> Fragment:
        """Return a value of one type in the representation of another."""
        if isinstance(type_, lang.ArrayType) and isinstance(source, lang.ArrayType):
            if self.is_big(source.element) == self.is_big(type_.element):
                return text
            call = "BigInt" if self.is_big(type_.element) else "Number"
            return Fragment(f"{text.at_least(ATOM)}.map({call})")
        if not isinstance(source, lang.IntType):
            return text
        return self._as(text, self.is_big(source), big=self.is_big(type_))

    def moved(self, text: str, source: lang.Type, type_: lang.Type) -> str:
        """Return the text of a value of one type in the representation of another."""
        return self.held(Fragment(text), source, type_).text

    def _as(self, text: Fragment, is_big: bool, *, big: bool) -> Fragment:
        if is_big == big:
            return text
        return Fragment(f"{'BigInt' if big else 'Number'}({text.text})")

    def _whole(self, expr: lang.Expr, *, big: bool) -> Fragment:
        """Return a number; a whole one as BigInt if ``big``."""
        if isinstance(expr, lang.Literal) and isinstance(expr.value, int):
            return _integer(int(expr.value), big=big)
        return self._as(self.fragment(expr), self.is_big(expr.type), big=big)

    # --- expressions ------------------------------------------------------------------------------

    def literal(self, expr: lang.Literal) -> Fragment:
        """Print a constant."""
        text = self.spell(expr.value, expr.type)
        return Fragment(text, SIGN if text.startswith("-") else ATOM)

    def variable(self, expr: lang.Variable) -> Fragment:
        """Print a variable."""
        if expr.storage is lang.Storage.LOCAL:
            return Fragment(self.locals[expr.name])
        return Fragment(f"m.{MEMBERS[expr.storage]}{member(expr.name)}")

    def event_field(self, expr: lang.EventField) -> Fragment:
        """Print a field of the current event's payload."""
        if self.payload is not None:
            return Fragment(f"m._at.payload[{self.payload[expr.name]}]")
        text = f"m._field({quoted(expr.name)})"  # of several events, whose types may differ
        if isinstance(expr.type, lang.IntType):
            text = f"{'BigInt' if self.is_big(expr.type) else 'Number'}({text})"
        return Fragment(text)

    def event_name(self, expr: lang.EventName) -> Fragment:
        """Print the name of the current event, or its type."""
        return Fragment(f"m._event{'Type' if isinstance(expr, lang.EventType) else 'Name'}()")

    def in_state(self, expr: lang.InState) -> Fragment:
        """Print a state test."""
        return Fragment(f"m._active[{expr.state}]")

    def conditional(self, expr: lang.Conditional) -> Fragment:
        """Print a choice of two values."""
        one, other = (
            self.held(self.fragment(side), side.type, expr.type)
            for side in (expr.then, expr.otherwise)
        )
        test = self.fragment(expr.test).at_least(OR)
        return Fragment(f"{test} ? {one.at_least(OR)} : {other.text}", CHOICE)

    def element(self, expr: lang.Element) -> Fragment:
        """Print an element of an array."""
        return Fragment(f"{self.fragment(expr.array).at_least(ATOM)}[{self.index(expr)}]")

    def index(self, expr: lang.Element) -> str:
        """Return the index of an element, checked unless it cannot be outside."""
        index, array = expr.index, expr.array.type
        assert isinstance(array, lang.ArrayType)  # noqa: S101
        if is_inside(index, array.length):
            return self._whole(index, big=False).text
        return f"rt.position({self.fragment(index).text}, {array.length})"

    def member(self, expr: lang.Member) -> Fragment:
        """Print a field of a record."""
        record = self.fragment(expr.record).at_least(ATOM)
        return Fragment(f"{record}[{field_position(expr.record.type, expr.name)}]")

    def call(self, expr: lang.Call) -> Fragment:
        """Print a call of the host, which the trace shows."""
        operation = self.operations[expr.operation]
        pairs = zip(expr.arguments, operation.parameters, strict=True)
        passed = ", ".join(self.print(argument, part.type) for argument, part in pairs)
        has_result = "false" if operation.result is None else "true"
        return Fragment(f"m._operation({quoted(expr.operation)}, [{passed}], {has_result})")

    def call_function(self, expr: lang.CallFunction) -> Fragment:
        """Print a call of a function of the chart."""
        pairs = zip(expr.arguments, expr.function.parameters, strict=True)
        passed = [self.print(argument, part.type) for argument, part in pairs]
        return Fragment(f"{self.functions[expr.function.name]}({', '.join(('m', *passed))})")

    def checked(self, expr: lang.Checked) -> Fragment:
        """Print a number as a value of a type that may lack it."""
        number = self.fragment(expr.operand).text
        if not isinstance(expr.type, lang.EnumType):
            return Fragment(f"rt.integer({number})")
        other = "" if expr.otherwise is None else f", {self.fragment(expr.otherwise).text}"
        return Fragment(f"rt.member({number}, [{', '.join(map(str, expr.type.numbers))}]{other})")

    def invalid(self, expr: lang.Invalid) -> Fragment:
        """Print an expression that cannot be evaluated."""
        return Fragment(f"rt.cannot({quoted(expr.reason)})")

    def prefixed(self, expr: lang.Unary) -> Fragment:
        """Print an operator of one operand."""
        if not isinstance(expr.type, lang.IntType):
            return ExprPrinter.prefixed(self, expr)
        big = not self._is_safe(range_of(expr.operand), raw_range(expr))
        inner = self._whole(expr.operand, big=big)
        if big:
            return self._reduced(
                Fragment(f"{expr.op.value}{inner.at_least(ATOM)}", SIGN), expr, big=True
            )
        start = "0" if expr.op is lang.UnaryOp.NEGATE else "-1"  # never -0
        return self._reduced(Fragment(f"{start} - {inner.at_least(PRODUCT)}", SUM), expr, big=False)

    def infix(self, expr: lang.Binary) -> Fragment:
        """Print an operator of two operands."""
        if isinstance(expr.type, lang.IntType):
            return self._arithmetic(expr)
        if expr.op in EQUALITY and self.is_big(expr.left.type) != self.is_big(expr.right.type):
            # loosely between a number and BigInt, which then compare as numbers do
            one, other = (self.fragment(e).at_least(COMPARE) for e in (expr.left, expr.right))
            return Fragment(f"{one} {expr.op.value} {other}", EQUAL)
        return ExprPrinter.infix(self, expr)

    def _arithmetic(self, expr: lang.Binary) -> Fragment:
        """Print arithmetic of whole numbers: of numbers if these are exact, else of BigInt."""
        op, a, b, raw = expr.op, range_of(expr.left), range_of(expr.right), raw_range(expr)
        assert isinstance(expr.type, lang.IntType)  # noqa: S101  (`infix`)
        assert a is not None  # noqa: S101
        assert b is not None  # noqa: S101
        is_signed = within(a, INT32_RANGE) and within(b, INT32_RANGE)
        big = not self._is_safe(a, b, raw)
        if op in BITS:  # of numbers, they work on 32 bits
            big |= not is_signed and not (within(a, UINT32_RANGE) and within(b, UINT32_RANGE))
        elif op in SHIFTS:
            big |= not within(b, (0, 31))
        left, right = (self._whole(part, big=big) for part in (expr.left, expr.right))
        if op in QUOTIENTS:
            text = Fragment(f"{QUOTIENTS[op]}({left.text}, {right.text})")
            return self._reduced(text, expr, big=big)
        if op in SHIFTS and not big:
            value, factor = left.at_least(PRODUCT), f"2 ** {right.at_least(ATOM)}"
            text = Fragment(f"Math.floor({value} / {factor})")
            if op is lang.BinaryOp.SHIFT_LEFT:
                text = Fragment(f"{value} * {factor}", PRODUCT)
            return self._reduced(text, expr, big=False)
        if op in SHIFTS:
            bits = 5 if width(expr.type) == 32 else 6
            right = Fragment(f"BigInt.asUintN({bits}, {right.text})")
        binds = self.binary[op].binds
        text = Fragment(f"{left.at_least(binds)} {op.value} {right.at_least(binds + 1)}", binds)
        if op in BITS and not big and not is_signed:
            text = Fragment(f"{text.at_least(SUM)} >>> 0", SHIFT)
        if op is lang.BinaryOp.MUL and not big and (a[0] < 0 or b[0] < 0):
            text = Fragment(f"{text.text} + 0", SUM)  # never -0
        return self._reduced(text, expr, big=big)

    def apply(self, expr: lang.Apply) -> Fragment:
        """Print ``min``, ``max`` or ``abs``."""
        ranges = *map(range_of, expr.arguments), raw_range(expr)
        big = not isinstance(expr.type, lang.FloatType) and not self._is_safe(*ranges)
        texts = [self._whole(part, big=big).text for part in expr.arguments]
        name = FUNCTIONS[expr.function]
        if big and expr.function is lang.Function.ABS:
            name = "rt.magnitude"
        return self._reduced(Fragment(f"{name}({', '.join(texts)})"), expr, big=big)

    def _reduced(self, text: Fragment, expr: lang.Expr, *, big: bool) -> Fragment:
        """Return a result in the representation of its type, wrapped around if it can exceed it."""
        type_ = expr.type
        if wrapping_bounds(expr) is None or not isinstance(type_, lang.IntType):
            return self._as(text, big, big=self.is_big(type_))
        return self._wrapped(text, None if big else raw_range(expr), type_, big=big)

    def _wrapped(
        self, text: Fragment, raw: Range | None, type_: lang.IntType, *, big: bool
    ) -> Fragment:
        """Return a value modulo the size of a range; ``raw`` is that of a safe number."""
        bounds = (type_.lo, type_.hi)
        if not big and not self.is_big(type_) and raw is not None:
            if bounds == INT32_RANGE:
                return Fragment(f"{text.at_least(BITXOR)} | 0", BITOR)
            if bounds == UINT32_RANGE:
                return Fragment(f"{text.at_least(SHIFT)} >>> 0", SHIFT)
            if type_.lo == 0 and type_.hi < 2**31 and type_.hi & (type_.hi + 1) == 0:
                return Fragment(f"{text.at_least(EQUAL)} & {type_.hi}", BITAND)
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

    def convert(self, expr: lang.Convert) -> Fragment:
        """Print a value converted to a type, as `fsmkit.language.converted` does it."""
        type_, operand, how = expr.type, expr.operand, bounding(expr)
        if isinstance(type_, lang.FloatType):
            text = self._whole(operand, big=False)
            return Fragment(f"Math.fround({text.text})") if type_.bits == 32 else text
        if how is None:
            return self._as(
                self.fragment(operand), self.is_big(operand.type), big=self.is_big(type_)
            )
        if how.overflow is lang.Overflow.WRAP:
            assert isinstance(type_, lang.IntType)  # noqa: S101
            is_big = self.is_big(operand.type)
            raw = None if is_big else range_of(operand)
            return self._wrapped(self.fragment(operand), raw, type_, big=is_big)
        big = self.is_big(type_) or self.is_big(operand.type)
        bounds = f"{how.lo}n, {how.hi}n" if big else f"{how.lo}, {how.hi}"
        text = self.fragment(operand) if how.truncates else self._whole(operand, big=big)
        if how.truncates:
            text = Fragment(f"rt.truncate{'Big' if big else ''}({text.text}, {bounds})")
        found = Fragment(f"{BOUNDING[how.overflow]}({text.text}, {bounds})")
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
