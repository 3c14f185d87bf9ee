"""Expressions in Python, with exactly the meaning of the typed tree.

Python's integers are exact, so a result is reduced only where its type says that it wraps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import assert_never

from fsmkit.chart.analysis.effects import is_inside
from fsmkit.chart.analysis.ranges import raw_range, within
from fsmkit.codegen.python.linking import LINK, ME
from fsmkit.codegen.python.names import Names
from fsmkit.diagnostics.frozen import quick
from fsmkit.language import (
    LONGEST_DURATION,
    Apply,
    ArrayType,
    Binary,
    BinaryOp,
    Call,
    CallFunction,
    Checked,
    Conditional,
    Convert,
    Decided,
    DurationType,
    Element,
    EnumType,
    EventField,
    EventName,
    EventType,
    Expr,
    FloatType,
    InState,
    IntType,
    Invalid,
    Literal,
    Member,
    Overflow,
    RecordType,
    Storage,
    Type,
    Unary,
    UnaryOp,
    Value,
    Variable,
    Watched,
    fold,
)

CHOICE, OR, AND, NOT, COMPARE, BITOR, BITXOR, BITAND, SHIFT, SUM, PRODUCT, SIGN, ATOM = range(1, 14)

INFIX: Mapping[BinaryOp, tuple[str, int, int, int]] = {
    # the text, how tightly it binds, and what its left and right operands must at least
    BinaryOp.OR: ("or", OR, OR, AND),
    BinaryOp.AND: ("and", AND, AND, NOT),
    BinaryOp.EQ: ("==", COMPARE, BITOR, BITOR),
    BinaryOp.NE: ("!=", COMPARE, BITOR, BITOR),
    BinaryOp.LT: ("<", COMPARE, BITOR, BITOR),
    BinaryOp.LE: ("<=", COMPARE, BITOR, BITOR),
    BinaryOp.GT: (">", COMPARE, BITOR, BITOR),
    BinaryOp.GE: (">=", COMPARE, BITOR, BITOR),
    BinaryOp.BIT_OR: ("|", BITOR, BITOR, BITXOR),
    BinaryOp.BIT_XOR: ("^", BITXOR, BITXOR, BITAND),
    BinaryOp.BIT_AND: ("&", BITAND, BITAND, SHIFT),
    BinaryOp.SHIFT_LEFT: ("<<", SHIFT, SHIFT, SUM),
    BinaryOp.SHIFT_RIGHT: (">>", SHIFT, SHIFT, SUM),
    BinaryOp.ADD: ("+", SUM, SUM, PRODUCT),
    BinaryOp.SUB: ("-", SUM, SUM, PRODUCT),
    BinaryOp.MUL: ("*", PRODUCT, PRODUCT, SIGN),
}
SMALL = 0x3FFFFFFF
"""The greatest number that Python computes with in one digit: below it, comparing is cheapest."""
SHIFTS = (BinaryOp.SHIFT_LEFT, BinaryOp.SHIFT_RIGHT)


@quick
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

    def print(self, expr: Expr) -> str:
        """Return an expression as text, what is constant in it computed."""
        return self.fragment(fold(expr)).text

    def frozen(self, expr: Expr) -> str:
        """Return an expression whose value later assignments do not change."""
        text = self.print(expr)
        is_made_of_parts = isinstance(expr.type, ArrayType | RecordType)
        return (
            f"{LINK}frozen({text})" if is_made_of_parts and not isinstance(expr, Literal) else text
        )

    def fragment(self, expr: Expr) -> Fragment:
        """Return an expression as text that can stand inside more text."""
        match expr:
            case Literal(value, type_, name=name):
                constant = self.names.constant(name, value, type_)
                return _literal(value, type_) if constant is None else Fragment(constant)
            case Variable(name, storage=Storage.LOCAL):
                return Fragment(self.local(name))
            case Variable(name):
                return Fragment(f"{ME}{self.names.variables[name]}")
            case EventField(name):
                return self._field(name)
            case EventType():
                return Fragment(f"{ME}_event_name({self.names.types!r})")
            case EventName():
                return Fragment(f"{ME}_event_name()")
            case InState(state):
                bit = self.names.states[state]
                return Fragment(f"{ME}_active & {bit} != 0", COMPARE)
            case Unary():
                return self._unary(expr)
            case Binary():
                return self._binary(expr)
            case Conditional(test, then, otherwise):
                text = f"{self.fragment(then).at(OR)} if {self.fragment(test).at(OR)}"
                return Fragment(f"{text} else {self.fragment(otherwise).at(CHOICE)}", CHOICE)
            case Element():
                return Fragment(f"{self.print(expr.array)}[{self.index(expr)}]")
            case Member(record, name):
                return Fragment(f"{self.fragment(record).at(ATOM)}[{place(record.type, name)}]")
            case Apply():
                return self._apply(expr)
            case Call(operation, arguments):
                passed = ", ".join(self.frozen(argument) for argument in arguments)
                return Fragment(f"{ME}_call_{self.names.operations[operation]}({passed})")
            case CallFunction(function, arguments):
                passed = ", ".join(self.print(argument) for argument in arguments)
                return Fragment(f"{ME}{self.names.functions[function.name]}({passed})")
            case Checked():
                return self._checked(expr)
            case Convert(operand, type_):
                return self._convert(operand, type_)
            case Invalid(reason):
                return Fragment(f"{LINK}cannot({reason!r})")
            case Watched(operand, added, bit, is_first):
                noted = f", {bit}" if bit >= 0 else ""
                verb = "_began" if is_first else "_watched"
                return Fragment(f"{ME}{verb}({self.print(operand)}, {added}{noted})")
            case Decided(operand, counter, noted):
                more = f", {noted}" if noted else ""
                return Fragment(f"{ME}_decided({self.print(operand)}, {counter}{more})")
            case _:
                assert_never(expr)

    def local(self, name: str) -> str:
        """Return what a local variable is called."""
        if self.parameters is not None:
            return self.parameters[name]
        return f"{ME}{self.names.locals[name]}"

    def _checked(self, expr: Checked) -> Fragment:
        text = self.print(expr.operand)
        if not isinstance(expr.type, EnumType):
            return Fragment(f"{LINK}integer({self._float(expr.operand, text)})")
        other = "" if expr.otherwise is None else f", {self.print(expr.otherwise)}"
        known = ", ".join(map(str, expr.type.numbers))
        return Fragment(f"{LINK}member({text}, ({known},){other})")

    def index(self, expr: Element) -> str:
        """Return the index of an element, checked unless it cannot be outside."""
        index, array = expr.index, expr.array.type
        assert isinstance(array, ArrayType)  # noqa: S101
        text = self.print(index)
        return text if is_inside(index, array.length) else f"{LINK}position({text}, {array.length})"

    def _field(self, name: str) -> Fragment:
        if self.payload is None:
            return Fragment(f"{ME}_field({name!r})")
        return Fragment(f"{ME}_fields[{self.payload[name]}]")

    def _unary(self, expr: Unary) -> Fragment:
        operand = self.fragment(expr.operand)
        match expr.op:
            case UnaryOp.NOT:
                return Fragment(f"not {operand.at(NOT)}", NOT)
            case UnaryOp.NEGATE | UnaryOp.INVERT:
                return reduced(Fragment(f"{expr.op.value}{operand.at(SIGN)}", SIGN), expr)
            case _:
                assert_never(expr.op)

    def _binary(self, expr: Binary) -> Fragment:
        is_float = isinstance(expr.type, FloatType)
        if expr.op in (BinaryOp.DIV, BinaryOp.REM):
            name = "divide" if expr.op is BinaryOp.DIV else "remainder"
            name += "_floats" if is_float else ""
            left, right = (
                self._number(part, is_float=is_float) for part in (expr.left, expr.right)
            )
            return reduced(Fragment(f"{LINK}{name}({left}, {right})"), expr)
        return reduced(self._infix(expr), expr)

    def _infix(self, expr: Binary) -> Fragment:
        is_float = isinstance(expr.type, FloatType)
        text, binds, left_binds, right_binds = INFIX[expr.op]
        left = self.fragment(expr.left).at(left_binds)
        right = self.fragment(expr.right).at(right_binds)
        if is_float:
            left = self._float(expr.left, left)
            right = self._float(expr.right, right)
        if expr.op in SHIFTS and isinstance(expr.type, IntType):
            right = self._count(expr.right, expr.type)
        return Fragment(f"{left} {text} {right}", binds)

    def sum(self, expr: Expr) -> tuple[str, str] | None:
        """Return a sum that may wrap around, not yet reduced, and how ``value`` is reduced.

        None for anything else, and where a mask is as cheap as the question.
        """
        expr = fold(expr)
        type_, raw = expr.type, raw_range(expr)
        is_sum = isinstance(expr, Binary) and expr.op in (BinaryOp.ADD, BinaryOp.SUB)
        if not is_sum or raw is None or not isinstance(type_, IntType) or type_.hi <= SMALL:
            return None
        if type_.overflow is not Overflow.WRAP or within(raw, (type_.lo, type_.hi)):
            return None
        assert isinstance(expr, Binary)  # noqa: S101
        least = f"{_hexadecimal(max(type_.lo, -SMALL))} <= " if raw[0] < type_.lo else ""
        most = f" <= {SMALL:#x}" if raw[1] > type_.hi else ""
        otherwise = f"{LINK}around(value, {type_.lo}, {type_.hi})"
        return self._infix(expr).text, f"value if {least}value{most} else {otherwise}"

    def _number(self, expr: Expr, *, is_float: bool) -> str:
        text = self.print(expr)
        return self._float(expr, text) if is_float else text

    def _float(self, expr: Expr, text: str) -> str:
        return text if isinstance(expr.type, FloatType) else f"float({text})"

    def _count(self, expr: Expr, type_: IntType) -> str:
        """Return a shift count, reduced to the width of the result unless it is less."""
        width = 32 if type_.hi <= 2**32 - 1 and type_.lo >= -(2**31) else 64
        fragment = self.fragment(expr)
        if isinstance(expr.type, IntType) and expr.type.lo >= 0 and expr.type.hi < width:
            return fragment.at(SUM)
        return f"({fragment.at(PRODUCT)} % {width})"

    def _apply(self, expr: Apply) -> Fragment:
        arguments = ", ".join(self.print(argument) for argument in expr.arguments)
        return reduced(Fragment(f"{expr.function.value}({arguments})"), expr)

    def _convert(self, operand: Expr, type_: Type) -> Fragment:
        text = self.fragment(operand)
        match type_:
            case FloatType(bits):
                if bits == 32:
                    return Fragment(f"{LINK}single({text.text})")
                return Fragment(self._float(operand, text.text))
            case IntType(overflow=Overflow.NEAREST) if isinstance(
                operand.type, EnumType | DurationType
            ):
                return text  # its number is what is held
            case IntType() | DurationType():
                return _bounded(text, operand.type, type_)
            case _:
                return text


def _bounded(text: Fragment, source: Type | None, type_: IntType | DurationType) -> Fragment:
    """Bring a number into bounds, as `fsmkit.language.converted` does."""
    lo, hi, overflow = 0, LONGEST_DURATION, Overflow.SATURATE
    if isinstance(type_, IntType):
        lo, hi, overflow = type_.lo, type_.hi, type_.overflow
    if isinstance(source, FloatType):
        whole = f"{LINK}truncate({text.text}, {lo}, {hi})"
        if overflow in (Overflow.WRAP, Overflow.NEAREST):  # a float is never wrapped around
            return Fragment(f"min(max({whole}, {lo}), {hi})")
        text = Fragment(whole)
    elif overflow is Overflow.WRAP:
        return wrapped(text, lo, hi)
    if overflow is Overflow.NEAREST:
        return Fragment(f"min(max({text.text}, {lo}), {hi})")
    how = f"{LINK}bounded" if overflow is Overflow.FAULT else f"{ME}_clamp"
    return Fragment(f"{how}({text.text}, {lo}, {hi})")


def reduced(text: Fragment, expr: Expr) -> Fragment:
    """Reduce the result of an expression to its type if that wraps around, and it can leave it."""
    type_ = expr.type
    if not isinstance(type_, IntType) or type_.overflow is not Overflow.WRAP:
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


def _literal(value: Value, type_: Type | None) -> Fragment:
    if isinstance(value, tuple):
        return Fragment(spell(value, type_))
    text = spell(value, type_)
    return Fragment(text, SIGN if text.startswith("-") else ATOM)


def spell(value: Value, type_: Type | None, *, mutable: bool = False) -> str:
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
            if isinstance(type_, FloatType):
                text = repr(float(value))
                return f'float("{text}")' if text.lstrip("-") in {"inf", "nan"} else text
            return str(value)
        case _:
            assert_never(value)


def _part_types(type_: Type | None, size: int) -> tuple[Type | None, ...]:
    match type_:
        case ArrayType(element):
            return (element,) * size
        case RecordType(_, parts):
            return tuple(part.type for part in parts)
        case _:
            return (None,) * size


def place(type_: Type | None, name: str) -> int:
    """Return where in a record its field stands."""
    assert isinstance(type_, RecordType)  # noqa: S101
    return next(i for i, part in enumerate(type_.fields) if part.name == name)
