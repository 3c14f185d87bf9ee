"""Conditions of properties in C, over ``int64_t`` and ``double`` however variables are stored.

What cannot be evaluated notes so in ``failed``. The explorer is compiled with ``-fwrapv``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import assert_never

from fsmkit.language import (
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
    Element,
    EnumType,
    EventField,
    EventName,
    Expr,
    FloatType,
    Function,
    InState,
    IntType,
    Invalid,
    Literal,
    Member,
    Overflow,
    Unary,
    Variable,
    Watched,
)
from fsmkit.verify.engines.c.condition_functions import Helpers

Access = Callable[[Variable], str]
"""Returns the C text of a variable."""


class ConditionPrinter:
    """Prints conditions; ``access`` spells variables, ``test`` whether a state is active."""

    def __init__(
        self,
        access: Access,
        test: Callable[[int], str],
        symbol: Callable[[str], int],
        helpers: Helpers,
    ) -> None:
        """Print with these spellings; ``symbol`` numbers strings."""
        self._access = access
        self._helpers = helpers
        self._test = test
        self._symbol = symbol

    def inside(self, names: Mapping[str, str]) -> ConditionPrinter:
        """Return what prints the body of a function, which has names of its own."""

        def access(variable: Variable) -> str:
            return names.get(variable.name) or self._access(variable)

        return ConditionPrinter(access, self._test, self._symbol, self._helpers)

    def place(self, variable: Variable) -> str:
        """Return the C text of a variable."""
        return self._access(variable)

    def print(self, expr: Expr) -> str:
        """Return an expression, in parentheses where it needs them."""
        match expr:
            case Literal(value):
                return self._literal(value)
            case Variable(_, type_):
                cast = "double" if isinstance(type_, FloatType) else "fsm_value"
                return f"({cast})({self._access(expr)})"
            case InState(state):
                return self._test(state)
            case Unary(op, operand):
                return f"({op.value}({self.print(operand)}))"
            case Binary():
                return self._binary(expr)
            case Conditional(test, then, otherwise):
                return f"({self.print(test)} ? {self.print(then)} : {self.print(otherwise)})"
            case Element():
                return self._element(expr)
            case Member():
                return f"(fsm_value)({self._place(expr)})"
            case Apply(function, arguments):
                return self._apply(function, [self.print(argument) for argument in arguments])
            case Convert(operand, type_):
                return self._convert(operand, type_)
            case CallFunction():
                return self._helpers.call(expr, self)
            case Checked(operand, type_):
                return self._checked(self.print(operand), type_, expr.otherwise)
            case Call() | Invalid() | EventField() | EventName():
                return "(fsm_value)fsm_fails(&failed)"
            case Watched(operand) | Decided(operand):
                return self.print(operand)
            case _:
                assert_never(expr)

    def _literal(self, value: object) -> str:
        match value:
            case bool():
                return str(int(value))
            case int():
                return f"INT64_C({value})" if value >= 0 else f"(-INT64_C({-value - 1}) - 1)"
            case float():
                return value.hex() if value >= 0 else f"({value.hex()})"
            case str():
                return str(self._symbol(value))
            case _:
                return "(fsm_value)fsm_fails(&failed)"

    def _binary(self, expr: Binary) -> str:
        left, right = self.print(expr.left), self.print(expr.right)
        is_float = isinstance(expr.type, FloatType)
        match expr.op:
            case BinaryOp.DIV if not is_float:
                text = f"fsm_div_i64(&failed, {left}, {right})"
            case BinaryOp.REM if not is_float:
                text = f"fsm_rem_i64(&failed, {left}, {right})"
            case BinaryOp.SHIFT_LEFT | BinaryOp.SHIFT_RIGHT:
                wide = isinstance(expr.type, IntType) and expr.type.hi - expr.type.lo >= 2**32
                text = f"({left} {expr.op.value} ({right} & {63 if wide else 31}))"
            case _:
                text = f"({left} {expr.op.value} {right})"
        return _reduced(text, expr.type)

    def _place(self, expr: Expr) -> str:
        match expr:
            case Member(record, name):
                return f"{self._place(record)}.{name}"
            case Variable():
                return self._access(expr)
            case _:
                return self.print(expr)

    def _element(self, expr: Element) -> str:
        array = expr.array.type
        length = array.length if isinstance(array, ArrayType) else 1
        index = f"fsm_place(&failed, {self.print(expr.index)}, {length}u)"
        cast = "double" if isinstance(expr.type, FloatType) else "fsm_value"
        return f"({cast})({self._access(expr.array)}[{index}])"

    def _apply(self, function: Function, arguments: list[str]) -> str:
        if function is Function.ABS:
            (only,) = arguments
            return f"({only} < 0 ? -({only}) : {only})"
        sign = "<" if function is Function.MIN else ">"
        text = arguments[0]
        for other in arguments[1:]:
            text = f"({text} {sign} {other} ? {text} : {other})"
        return text

    def _checked(self, text: str, type_: object, otherwise: Literal | None) -> str:
        """Return a member by its number, or the whole part of a float, if there is one."""
        fails = "(fsm_value)fsm_fails(&failed)" if otherwise is None else self.print(otherwise)
        if isinstance(type_, EnumType):
            known = " || ".join(f"{text} == {self._literal(n)}" for n in type_.numbers)
        else:
            known = f"{text} >= -0x1p63 && {text} < 0x1p63"
        return f"({known} ? (fsm_value){text} : {fails})"

    def _convert(self, operand: Expr, type_: object) -> str:
        text = self.print(operand)
        if isinstance(type_, FloatType):
            return f"((double){text})"
        if isinstance(type_, IntType) and type_.overflow is Overflow.WRAP:
            return _reduced(f"((fsm_value){text})", type_)
        if isinstance(type_, IntType):
            lo, hi = self._literal(type_.lo), self._literal(min(type_.hi, 2**63 - 1))
            return f"({text} < {lo} ? {lo} : {text} > {hi} ? {hi} : (fsm_value){text})"
        return f"((fsm_value){text})"


def _reduced(text: str, type_: object) -> str:
    """Return a result brought into the wrapping type it is computed in."""
    if isinstance(type_, IntType) and type_.overflow is Overflow.WRAP:
        if type_.hi - type_.lo >= 2**64 - 1:
            return text
        return f"fsm_wrap({text}, INT64_C({type_.lo}), INT64_C({type_.hi}))"
    return text
