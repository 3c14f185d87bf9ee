"""Expressions in Python, with exactly the meaning of the typed tree.

Python's integers are exact, so a result is reduced only where its type says that it wraps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import assert_never

import fsmkit.language as lang
from fsmkit.chart.analysis.effects import is_inside
from fsmkit.chart.analysis.ranges import raw_range, within
from fsmkit.codegen.python.linking import LINK, ME
from fsmkit.codegen.python.names import Names
from fsmkit.diagnostics.fast_init import fast_init

CHOICE, OR, AND, NOT, COMPARE, BITOR, BITXOR, BITAND, SHIFT, SUM, PRODUCT, SIGN, ATOM = range(1, 14)

INFIX: Mapping[lang.BinaryOp, tuple[str, int, int, int]] = {
    # the text, how tightly it binds, and what its left and right operands must at least
    lang.BinaryOp.OR: ("or", OR, OR, AND),
    lang.BinaryOp.AND: ("and", AND, AND, NOT),
    lang.BinaryOp.EQ: ("==", COMPARE, BITOR, BITOR),
    lang.BinaryOp.NE: ("!=", COMPARE, BITOR, BITOR),
    lang.BinaryOp.LT: ("<", COMPARE, BITOR, BITOR),
    lang.BinaryOp.LE: ("<=", COMPARE, BITOR, BITOR),
    lang.BinaryOp.GT: (">", COMPARE, BITOR, BITOR),
    lang.BinaryOp.GE: (">=", COMPARE, BITOR, BITOR),
    lang.BinaryOp.BIT_OR: ("|", BITOR, BITOR, BITXOR),
    lang.BinaryOp.BIT_XOR: ("^", BITXOR, BITXOR, BITAND),
    lang.BinaryOp.BIT_AND: ("&", BITAND, BITAND, SHIFT),
    lang.BinaryOp.SHIFT_LEFT: ("<<", SHIFT, SHIFT, SUM),
    lang.BinaryOp.SHIFT_RIGHT: (">>", SHIFT, SHIFT, SUM),
    lang.BinaryOp.ADD: ("+", SUM, SUM, PRODUCT),
    lang.BinaryOp.SUB: ("-", SUM, SUM, PRODUCT),
    lang.BinaryOp.MUL: ("*", PRODUCT, PRODUCT, SIGN),
}
SMALL = 0x3FFFFFFF
"""The greatest number that Python computes with in one digit: below it, comparing is cheapest."""
SHIFTS = (lang.BinaryOp.SHIFT_LEFT, lang.BinaryOp.SHIFT_RIGHT)


@fast_init
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
    """Prints expressions of one chart; ``payload``: where the fields of the event at hand are."""

    names: Names
    payload: Mapping[str, int] | None = None
    """None where it is not known which event is at hand: looked up when needed."""
    parameters: Mapping[str, str] | None = None
    """In a function of the chart: what its variables are called; else they are attributes."""

    def print(self, expr: lang.Expr) -> str:
        """Return an expression as text, what is constant in it computed."""
        return self.fragment(lang.fold(expr)).text

    def frozen(self, expr: lang.Expr) -> str:
        """Return an expression whose value later assignments do not change."""
        text = self.print(expr)
        is_made_of_parts = isinstance(expr.type, lang.ArrayType | lang.RecordType)
        return (
            f"{LINK}frozen({text})"
            if is_made_of_parts and not isinstance(expr, lang.Literal)
            else text
        )

    def fragment(self, expr: lang.Expr) -> Fragment:
        """Return an expression as text that can stand inside more text."""
        match expr:
            case lang.Literal(value, type_, name=name):
                constant = self.names.constant(name, value, type_)
                return _literal(value, type_) if constant is None else Fragment(constant)
            case lang.Variable(name, storage=lang.Storage.LOCAL):
                return Fragment(self.local(name))
            case lang.Variable(name):
                return Fragment(f"{ME}{self.names.variables[name]}")
            case lang.EventField(name):
                return self._field(name)
            case lang.EventType():
                return Fragment(f"{ME}_event_name({self.names.types!r})")
            case lang.EventName():
                return Fragment(f"{ME}_event_name()")
            case lang.InState(state):
                bit = self.names.states[state]
                return Fragment(f"{ME}_active & {bit} != 0", COMPARE)
            case lang.Unary():
                return self._unary(expr)
            case lang.Binary():
                return self._binary(expr)
            case lang.Conditional(test, then, otherwise):
                text = f"{self.fragment(then).at(OR)} if {self.fragment(test).at(OR)}"
                return Fragment(f"{text} else {self.fragment(otherwise).at(CHOICE)}", CHOICE)
            case lang.Element():
                return Fragment(f"{self.print(expr.array)}[{self.index(expr)}]")
            case lang.Member(record, name):
                return Fragment(f"{self.fragment(record).at(ATOM)}[{place(record.type, name)}]")
            case lang.Apply():
                return self._apply(expr)
            case lang.Call(operation, arguments):
                passed = ", ".join(self.frozen(argument) for argument in arguments)
                return Fragment(f"{ME}_call_{self.names.operations[operation]}({passed})")
            case lang.CallFunction(function, arguments):
                passed = ", ".join(self.print(argument) for argument in arguments)
                return Fragment(f"{ME}{self.names.functions[function.name]}({passed})")
            case lang.Checked():
                return self._checked(expr)
            case lang.Convert(operand, type_):
                return self._convert(operand, type_)
            case lang.Invalid(reason):
                return Fragment(f"{LINK}cannot({reason!r})")
            case lang.Watched(operand, added, bit, is_first):
                noted = f", {bit}" if bit >= 0 else ""
                verb = "_began" if is_first else "_watched"
                return Fragment(f"{ME}{verb}({self.print(operand)}, {added}{noted})")
            case lang.Decided(operand, counter, noted):
                more = f", {noted}" if noted else ""
                return Fragment(f"{ME}_decided({self.print(operand)}, {counter}{more})")
            case _:
                assert_never(expr)

    def local(self, name: str) -> str:
        """Return what a local variable is called."""
        if self.parameters is not None:
            return self.parameters[name]
        return f"{ME}{self.names.locals[name]}"

    def _checked(self, expr: lang.Checked) -> Fragment:
        text = self.print(expr.operand)
        if not isinstance(expr.type, lang.EnumType):
            return Fragment(f"{LINK}integer({self._float(expr.operand, text)})")
        other = "" if expr.otherwise is None else f", {self.print(expr.otherwise)}"
        known = ", ".join(map(str, expr.type.numbers))
        return Fragment(f"{LINK}member({text}, ({known},){other})")

    def index(self, expr: lang.Element) -> str:
        """Return the index of an element, checked unless it cannot be outside."""
        index, array = expr.index, expr.array.type
        assert isinstance(array, lang.ArrayType)  # noqa: S101
        text = self.print(index)
        return text if is_inside(index, array.length) else f"{LINK}position({text}, {array.length})"

    def _field(self, name: str) -> Fragment:
        if self.payload is None:
            return Fragment(f"{ME}_field({name!r})")
        return Fragment(f"{ME}_fields[{self.payload[name]}]")

    def _unary(self, expr: lang.Unary) -> Fragment:
        operand = self.fragment(expr.operand)
        match expr.op:
            case lang.UnaryOp.NOT:
                return Fragment(f"not {operand.at(NOT)}", NOT)
            case lang.UnaryOp.NEGATE | lang.UnaryOp.INVERT:
                return reduced(Fragment(f"{expr.op.value}{operand.at(SIGN)}", SIGN), expr)
            case _:
                assert_never(expr.op)

    def _binary(self, expr: lang.Binary) -> Fragment:
        is_float = isinstance(expr.type, lang.FloatType)
        if expr.op in (lang.BinaryOp.DIV, lang.BinaryOp.REM):
            name = "divide" if expr.op is lang.BinaryOp.DIV else "remainder"
            name += "_floats" if is_float else ""
            left, right = (
                self._number(part, is_float=is_float) for part in (expr.left, expr.right)
            )
            return reduced(Fragment(f"{LINK}{name}({left}, {right})"), expr)
        return reduced(self._infix(expr), expr)

    def _infix(self, expr: lang.Binary) -> Fragment:
        is_float = isinstance(expr.type, lang.FloatType)
        text, binds, left_binds, right_binds = INFIX[expr.op]
        left = self.fragment(expr.left).at(left_binds)
        right = self.fragment(expr.right).at(right_binds)
        if is_float:
            left = self._float(expr.left, left)
            right = self._float(expr.right, right)
        if expr.op in SHIFTS and isinstance(expr.type, lang.IntType):
            right = self._count(expr.right, expr.type)
        return Fragment(f"{left} {text} {right}", binds)

    def sum(self, expr: lang.Expr) -> tuple[str, str] | None:
        """Return a sum that may wrap around, not yet reduced, and how ``value`` is reduced.

        None for anything else, and where a mask is as cheap as the question.
        """
        expr = lang.fold(expr)
        type_, raw = expr.type, raw_range(expr)
        is_sum = isinstance(expr, lang.Binary) and expr.op in (lang.BinaryOp.ADD, lang.BinaryOp.SUB)
        if not is_sum or raw is None or not isinstance(type_, lang.IntType) or type_.hi <= SMALL:
            return None
        if type_.overflow is not lang.Overflow.WRAP or within(raw, (type_.lo, type_.hi)):
            return None
        assert isinstance(expr, lang.Binary)  # noqa: S101
        least = f"{_hexadecimal(max(type_.lo, -SMALL))} <= " if raw[0] < type_.lo else ""
        most = f" <= {SMALL:#x}" if raw[1] > type_.hi else ""
        otherwise = f"{LINK}around(value, {type_.lo}, {type_.hi})"
        return self._infix(expr).text, f"value if {least}value{most} else {otherwise}"

    def _number(self, expr: lang.Expr, *, is_float: bool) -> str:
        text = self.print(expr)
        return self._float(expr, text) if is_float else text

    def _float(self, expr: lang.Expr, text: str) -> str:
        return text if isinstance(expr.type, lang.FloatType) else f"float({text})"

    def _count(self, expr: lang.Expr, type_: lang.IntType) -> str:
        """Return a shift count, reduced to the width of the result unless it is less."""
        width = 32 if type_.hi <= 2**32 - 1 and type_.lo >= -(2**31) else 64
        fragment = self.fragment(expr)
        if isinstance(expr.type, lang.IntType) and expr.type.lo >= 0 and expr.type.hi < width:
            return fragment.at(SUM)
        return f"({fragment.at(PRODUCT)} % {width})"

    def _apply(self, expr: lang.Apply) -> Fragment:
        arguments = ", ".join(self.print(argument) for argument in expr.arguments)
        return reduced(Fragment(f"{expr.function.value}({arguments})"), expr)

    def _convert(self, operand: lang.Expr, type_: lang.Type) -> Fragment:
        text = self.fragment(operand)
        match type_:
            case lang.FloatType(bits):
                if bits == 32:
                    return Fragment(f"{LINK}single({text.text})")
                return Fragment(self._float(operand, text.text))
            case lang.IntType(overflow=lang.Overflow.NEAREST) if isinstance(
                operand.type, lang.EnumType | lang.DurationType
            ):
                return text  # its number is what is held
            case lang.IntType() | lang.DurationType():
                return _bounded(text, operand.type, type_)
            case _:
                return text


def _bounded(
    text: Fragment, source: lang.Type | None, type_: lang.IntType | lang.DurationType
) -> Fragment:
    """Bring a number into bounds, as `fsmkit.language.converted` does."""
    lo, hi, overflow = 0, lang.LONGEST_DURATION, lang.Overflow.SATURATE
    if isinstance(type_, lang.IntType):
        lo, hi, overflow = type_.lo, type_.hi, type_.overflow
    if isinstance(source, lang.FloatType):
        whole = f"{LINK}truncate({text.text}, {lo}, {hi})"
        if overflow in (
            lang.Overflow.WRAP,
            lang.Overflow.NEAREST,
        ):  # a float is never wrapped around
            return Fragment(f"min(max({whole}, {lo}), {hi})")
        text = Fragment(whole)
    elif overflow is lang.Overflow.WRAP:
        return wrapped(text, lo, hi)
    if overflow is lang.Overflow.NEAREST:
        return Fragment(f"min(max({text.text}, {lo}), {hi})")
    how = f"{LINK}bounded" if overflow is lang.Overflow.FAULT else f"{ME}_clamp"
    return Fragment(f"{how}({text.text}, {lo}, {hi})")


def reduced(text: Fragment, expr: lang.Expr) -> Fragment:
    """Reduce the result of an expression to its type if that wraps around, and it can leave it."""
    type_ = expr.type
    if not isinstance(type_, lang.IntType) or type_.overflow is not lang.Overflow.WRAP:
        return text
    raw = raw_range(expr)
    if raw is not None and within(raw, (type_.lo, type_.hi)):
        return text
    return wrapped(text, type_.lo, type_.hi)


def _hexadecimal(value: int) -> str:
    return f"{value:#x}" if value else "0"


def wrapped(text: Fragment, lo: int, hi: int) -> Fragment:
    """Return a value modulo the size of a range."""
    size = hi - lo + 1
    is_mask = size & (size - 1) == 0
    if lo == 0:
        if is_mask:
            return Fragment(f"{text.at(SHIFT)} & {hi:#x}", BITAND)
        return Fragment(f"{text.at(PRODUCT)} % {size}", PRODUCT)
    shifted = f"{text.at(SUM)} {'-' if lo > 0 else '+'} {abs(lo)}"
    inner = f"({shifted} & {size - 1:#x})" if is_mask else f"({shifted}) % {size}"
    return Fragment(f"{inner} {'+' if lo > 0 else '-'} {abs(lo)}", SUM)


def _literal(value: lang.Value, type_: lang.Type | None) -> Fragment:
    if isinstance(value, tuple):
        return Fragment(spell(value, type_))
    text = spell(value, type_)
    return Fragment(text, SIGN if text.startswith("-") else ATOM)


def spell(value: lang.Value, type_: lang.Type | None, *, mutable: bool = False) -> str:
    """Return a constant; arrays and records as tuples, or as lists that can be changed."""
    match value:
        case bool() | str():
            return repr(value)
        case tuple():
            parts = _part_types(type_, len(value))
            texts = [spell(v, t, mutable=mutable) for v, t in zip(value, parts, strict=True)]
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


def _part_types(type_: lang.Type | None, size: int) -> tuple[lang.Type | None, ...]:
    match type_:
        case lang.ArrayType(element):
            return (element,) * size
        case lang.RecordType(_, parts):
            return tuple(part.type for part in parts)
        case _:
            return (None,) * size


def place(type_: lang.Type | None, name: str) -> int:
    """Return where in a record its field stands."""
    assert isinstance(type_, lang.RecordType)  # noqa: S101
    return next(i for i, part in enumerate(type_.fields) if part.name == name)
