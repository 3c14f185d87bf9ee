"""Expressions in Python, with exactly the meaning of the typed tree.

Python's integers are exact, so a result is reduced only where its type says that it wraps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, assert_never

import fsmkit.language as lang
from fsmkit.chart.analysis.effects import is_inside
from fsmkit.chart.analysis.ranges import raw_range
from fsmkit.codegen.python.linking import LINK, ME
from fsmkit.codegen.python.names import Names
from fsmkit.language.evaluation import field_position
from fsmkit.language.printing import ATOM, ExprPrinter, Fragment, Operator, left_assoc, prefix
from fsmkit.language.values import part_types
from fsmkit.plan.values import bounding, count_width, lowered, wrapping_bounds

CHOICE, OR, AND, NOT, COMPARE, BITOR, BITXOR, BITAND, SHIFT, SUM, PRODUCT, SIGN = range(1, 13)
COMPARISONS = tuple(lang.BinaryOp)[2:8]
QUOTIENTS = {lang.BinaryOp.DIV: "divide", lang.BinaryOp.REM: "remainder"}
SHIFTS = (lang.BinaryOp.SHIFT_LEFT, lang.BinaryOp.SHIFT_RIGHT)
SMALL = 0x3FFFFFFF
"""The greatest integer of one digit in CPython; comparisons below it are the fastest."""


@dataclass(frozen=True, slots=True)
class Printer(ExprPrinter):
    """Prints expressions of one chart; ``payload``: the position of each field of the event."""

    names: Names
    payload: Mapping[str, int] | None = None
    """None if the current event is unknown; the code then looks the position up."""
    parameters: Mapping[str, str] | None = None
    """The variables of a function of the chart by name; other variables are attributes."""

    unary: ClassVar[Mapping[lang.UnaryOp, Operator]] = {
        lang.UnaryOp.NOT: prefix("not ", NOT, NOT),
        lang.UnaryOp.NEGATE: prefix("-", SIGN, SIGN),
        lang.UnaryOp.INVERT: prefix("~", SIGN, SIGN),
    }
    binary: ClassVar[Mapping[lang.BinaryOp, Operator]] = {
        lang.BinaryOp.OR: left_assoc("or", OR),
        lang.BinaryOp.AND: left_assoc("and", AND),
        **{op: Operator(op.value, COMPARE, BITOR, BITOR) for op in COMPARISONS},
        lang.BinaryOp.BIT_OR: left_assoc("|", BITOR),
        lang.BinaryOp.BIT_XOR: left_assoc("^", BITXOR),
        lang.BinaryOp.BIT_AND: left_assoc("&", BITAND),
        lang.BinaryOp.SHIFT_LEFT: left_assoc("<<", SHIFT),
        lang.BinaryOp.SHIFT_RIGHT: left_assoc(">>", SHIFT),
        lang.BinaryOp.ADD: left_assoc("+", SUM),
        lang.BinaryOp.SUB: left_assoc("-", SUM),
        lang.BinaryOp.MUL: left_assoc("*", PRODUCT),
    }

    def print(self, expr: lang.Expr) -> str:
        """Return an expression as text, with its constant parts computed."""
        return self.fragment(lowered(expr)).text

    def frozen(self, expr: lang.Expr) -> str:
        """Return an expression whose value later assignments do not change."""
        text = self.print(expr)
        is_made_of_parts = isinstance(expr.type, lang.ArrayType | lang.RecordType)
        is_variable = is_made_of_parts and not isinstance(expr, lang.Literal)
        return f"{LINK}frozen({text})" if is_variable else text

    def literal(self, expr: lang.Literal) -> Fragment:
        """Print a constant, by its name in the chart if it has one."""
        constant = self.names.constant(expr.name, expr.value, expr.type)
        text = spell(expr.value, expr.type) if constant is None else constant
        return Fragment(text, SIGN if text.startswith("-") else ATOM)

    def variable(self, expr: lang.Variable) -> Fragment:
        """Print a variable."""
        if expr.storage is lang.Storage.LOCAL:
            return Fragment(self.local(expr.name))
        return Fragment(f"{ME}{self.names.variables[expr.name]}")

    def local(self, name: str) -> str:
        """Return the name of a local variable."""
        if self.parameters is not None:
            return self.parameters[name]
        return f"{ME}{self.names.locals[name]}"

    def event_field(self, expr: lang.EventField) -> Fragment:
        """Print a field of the current event's payload."""
        if self.payload is None:
            return Fragment(f"{ME}_field({expr.name!r})")
        return Fragment(f"{ME}_fields[{self.payload[expr.name]}]")

    def event_name(self, expr: lang.EventName) -> Fragment:
        """Print the name of the current event, or its type."""
        types = repr(self.names.types) if isinstance(expr, lang.EventType) else ""
        return Fragment(f"{ME}_event_name({types})")

    def in_state(self, expr: lang.InState) -> Fragment:
        """Print a state test."""
        return Fragment(f"{ME}_active & {self.names.states[expr.state]} != 0", COMPARE)

    def prefixed(self, expr: lang.Unary) -> Fragment:
        """Print a unary operator; its result wraps around if necessary."""
        return _reduced(ExprPrinter.prefixed(self, expr), expr)

    def infix(self, expr: lang.Binary) -> Fragment:
        """Print a binary operator; its result wraps around if necessary."""
        return _reduced(self._operation(expr), expr)

    def _operation(self, expr: lang.Binary) -> Fragment:
        if expr.op in QUOTIENTS:
            suffix = "_floats" if isinstance(expr.type, lang.FloatType) else ""
            arguments = self.arguments((expr.left, expr.right))
            return Fragment(f"{LINK}{QUOTIENTS[expr.op]}{suffix}({arguments})")
        bits = count_width(expr) if expr.op in SHIFTS else None
        if bits is not None:
            left, count = self.fragment(expr.left).at_least(SHIFT), self.fragment(expr.right)
            return Fragment(f"{left} {expr.op.value} ({count.at_least(PRODUCT)} % {bits})", SHIFT)
        return ExprPrinter.infix(self, expr)

    def sum(self, expr: lang.Expr) -> tuple[str, str] | None:
        """Return an unreduced sum that may wrap around, and the statement that reduces ``value``.

        Return None for other expressions, and where a mask costs no more than the test.
        """
        expr = lowered(expr)
        is_sum = isinstance(expr, lang.Binary) and expr.op in (lang.BinaryOp.ADD, lang.BinaryOp.SUB)
        own, raw = wrapping_bounds(expr), raw_range(expr)
        if not is_sum or own is None or raw is None or own[1] <= SMALL:
            return None
        assert isinstance(expr, lang.Binary)  # noqa: S101
        least = f"{_hexadecimal(max(own[0], -SMALL))} <= " if raw[0] < own[0] else ""
        most = f" <= {SMALL:#x}" if raw[1] > own[1] else ""
        otherwise = f"{LINK}around(value, {own[0]}, {own[1]})"
        return self._operation(expr).text, f"value if {least}value{most} else {otherwise}"

    def conditional(self, expr: lang.Conditional) -> Fragment:
        """Print a choice of two values."""
        test, then = self.fragment(expr.test).at_least(OR), self.fragment(expr.then).at_least(OR)
        otherwise = self.fragment(expr.otherwise).text
        return Fragment(f"{then} if {test} else {otherwise}", CHOICE)

    def element(self, expr: lang.Element) -> Fragment:
        """Print an element of an array."""
        return Fragment(f"{self.fragment(expr.array).text}[{self.index(expr)}]")

    def index(self, expr: lang.Element) -> str:
        """Return the index of an element, checked unless it cannot be outside."""
        assert isinstance(expr.array.type, lang.ArrayType)  # noqa: S101
        text, length = self.print(expr.index), expr.array.type.length
        is_sure = is_inside(expr.index, length)
        return text if is_sure else f"{LINK}position({text}, {length})"

    def member(self, expr: lang.Member) -> Fragment:
        """Print a field of a record."""
        record = self.fragment(expr.record).at_least(ATOM)
        return Fragment(f"{record}[{field_position(expr.record.type, expr.name)}]")

    def apply(self, expr: lang.Apply) -> Fragment:
        """Print ``min``, ``max`` or ``abs``."""
        text = f"{expr.function.value}({self.arguments(expr.arguments)})"
        return _reduced(Fragment(text), expr)

    def call(self, expr: lang.Call) -> Fragment:
        """Print a call of an operation."""
        passed = ", ".join(map(self.frozen, expr.arguments))
        return Fragment(f"{ME}_call_{self.names.operations[expr.operation]}({passed})")

    def call_function(self, expr: lang.CallFunction) -> Fragment:
        """Print a call of a function of the chart."""
        function = self.names.functions[expr.function.name]
        return Fragment(f"{ME}{function}({self.arguments(expr.arguments)})")

    def checked(self, expr: lang.Checked) -> Fragment:
        """Print a number as a value of a type that may lack it."""
        text = self.fragment(expr.operand).text
        if not isinstance(expr.type, lang.EnumType):
            return Fragment(f"{LINK}integer({text})")
        other = "" if expr.otherwise is None else f", {self.fragment(expr.otherwise).text}"
        known = ", ".join(map(str, expr.type.numbers))
        return Fragment(f"{LINK}member({text}, ({known},){other})")

    def convert(self, expr: lang.Convert) -> Fragment:
        """Print a value converted to a type, as `fsmkit.language.converted` does it."""
        text, how = self.fragment(expr.operand), bounding(expr)
        if isinstance(expr.type, lang.FloatType):
            is_single = expr.type.bits == 32
            return Fragment(f"{LINK}single({text.text})" if is_single else f"float({text.text})")
        if how is None:
            return text
        if how.overflow is lang.Overflow.WRAP:
            return _wrapped(text, how.lo, how.hi)
        inner = f"{LINK}truncate({text.text}, {how.lo}, {how.hi})" if how.truncates else text.text
        if how.overflow is lang.Overflow.NEAREST:
            return Fragment(f"min(max({inner}, {how.lo}), {how.hi})")
        call = f"{LINK}bounded" if how.overflow is lang.Overflow.FAULT else f"{ME}_clamp"
        return Fragment(f"{call}({inner}, {how.lo}, {how.hi})")

    def invalid(self, expr: lang.Invalid) -> Fragment:
        """Print an expression that cannot be evaluated."""
        return Fragment(f"{LINK}cannot({expr.reason!r})")

    def watched(self, expr: lang.CoveredCondition | lang.CoveredGuard) -> Fragment:
        """Print a counted condition, or a counted guard."""
        operand = self.fragment(expr.operand).text
        if isinstance(expr, lang.CoveredGuard):
            more = f", {expr.noted}" if expr.noted else ""
            return Fragment(f"{ME}_decided({operand}, {expr.counter}{more})")
        noted = f", {expr.bit}" if expr.bit >= 0 else ""
        verb = "_began" if expr.is_first else "_watched"
        return Fragment(f"{ME}{verb}({operand}, {expr.added}{noted})")


def _reduced(text: Fragment, expr: lang.Expr) -> Fragment:
    """Return the result of an operator, wrapped around if it can exceed its type."""
    own = wrapping_bounds(expr)
    return text if own is None else _wrapped(text, *own)


def _hexadecimal(value: int) -> str:
    return f"{value:#x}" if value else "0"


def _wrapped(text: Fragment, lo: int, hi: int) -> Fragment:
    """Return a value modulo the size of a range."""
    size = hi - lo + 1
    is_mask = size & (size - 1) == 0
    if lo == 0:
        if is_mask:
            return Fragment(f"{text.at_least(SHIFT)} & {hi:#x}", BITAND)
        return Fragment(f"{text.at_least(PRODUCT)} % {size}", PRODUCT)
    shifted = f"{text.at_least(SUM)} {'-' if lo > 0 else '+'} {abs(lo)}"
    inner = f"({shifted} & {size - 1:#x})" if is_mask else f"({shifted}) % {size}"
    return Fragment(f"{inner} {'+' if lo > 0 else '-'} {abs(lo)}", SUM)


def spell(value: lang.Value, type_: lang.Type | None, *, mutable: bool = False) -> str:
    """Return a constant; arrays and records as tuples, or as lists that can be changed."""
    match value:
        case bool() | str():
            return repr(value)
        case tuple():
            assert isinstance(type_, lang.ArrayType | lang.RecordType)  # noqa: S101
            pairs = zip(value, part_types(type_), strict=True)
            texts = [spell(part, of, mutable=mutable) for part, of in pairs]
            if mutable:
                if len(texts) > 1 and len(set(texts)) == 1 and not isinstance(value[0], tuple):
                    return f"[{texts[0]}] * {len(texts)}"
                return f"[{', '.join(texts)}]"
            return f"({', '.join(texts)}{',' if len(texts) == 1 else ''})"
        case float() | int():
            if isinstance(type_, lang.FloatType):
                text = repr(float(value))
                return f'float("{text}")' if text.lstrip("-") in {"inf", "nan"} else text
            return str(value)
        case _:
            assert_never(value)
