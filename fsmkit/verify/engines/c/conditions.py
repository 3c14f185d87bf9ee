"""Conditions of properties in C, over ``int64_t`` and ``double`` however variables are stored.

What cannot be evaluated notes so in ``failed``. The explorer is compiled with ``-fwrapv``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import assert_never

import fsmkit.language as lang
from fsmkit.verify.engines.c.condition_functions import Helpers

Access = Callable[[lang.Variable], str]
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

        def access(variable: lang.Variable) -> str:
            return names.get(variable.name) or self._access(variable)

        return ConditionPrinter(access, self._test, self._symbol, self._helpers)

    def place(self, variable: lang.Variable) -> str:
        """Return the C text of a variable."""
        return self._access(variable)

    def print(self, expr: lang.Expr) -> str:
        """Return an expression, in parentheses where it needs them."""
        match expr:
            case lang.Literal(value):
                return self._literal(value)
            case lang.Variable(_, type_):
                cast = "double" if isinstance(type_, lang.FloatType) else "fsm_value"
                return f"({cast})({self._access(expr)})"
            case lang.InState(state):
                return self._test(state)
            case lang.Unary(op, operand):
                return f"({op.value}({self.print(operand)}))"
            case lang.Binary():
                return self._binary(expr)
            case lang.Conditional(test, then, otherwise):
                return f"({self.print(test)} ? {self.print(then)} : {self.print(otherwise)})"
            case lang.Element():
                return self._element(expr)
            case lang.Member():
                return f"(fsm_value)({self._place(expr)})"
            case lang.Apply(function, arguments):
                return self._apply(function, [self.print(argument) for argument in arguments])
            case lang.Convert(operand, type_):
                return self._convert(operand, type_)
            case lang.CallFunction():
                return self._helpers.call(expr, self)
            case lang.Checked(operand, type_):
                return self._checked(self.print(operand), type_, expr.otherwise)
            case lang.Call() | lang.Invalid() | lang.EventField() | lang.EventName():
                return "(fsm_value)fsm_fails(&failed)"
            case lang.Watched(operand) | lang.Decided(operand):
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

    def _binary(self, expr: lang.Binary) -> str:
        left, right = self.print(expr.left), self.print(expr.right)
        is_float = isinstance(expr.type, lang.FloatType)
        match expr.op:
            case lang.BinaryOp.DIV if not is_float:
                text = f"fsm_div_i64(&failed, {left}, {right})"
            case lang.BinaryOp.REM if not is_float:
                text = f"fsm_rem_i64(&failed, {left}, {right})"
            case lang.BinaryOp.SHIFT_LEFT | lang.BinaryOp.SHIFT_RIGHT:
                wide = isinstance(expr.type, lang.IntType) and expr.type.hi - expr.type.lo >= 2**32
                text = f"({left} {expr.op.value} ({right} & {63 if wide else 31}))"
            case _:
                text = f"({left} {expr.op.value} {right})"
        return _reduced(text, expr.type)

    def _place(self, expr: lang.Expr) -> str:
        match expr:
            case lang.Member(record, name):
                return f"{self._place(record)}.{name}"
            case lang.Variable():
                return self._access(expr)
            case _:
                return self.print(expr)

    def _element(self, expr: lang.Element) -> str:
        array = expr.array.type
        length = array.length if isinstance(array, lang.ArrayType) else 1
        index = f"fsm_place(&failed, {self.print(expr.index)}, {length}u)"
        cast = "double" if isinstance(expr.type, lang.FloatType) else "fsm_value"
        return f"({cast})({self._access(expr.array)}[{index}])"

    def _apply(self, function: lang.Function, arguments: list[str]) -> str:
        if function is lang.Function.ABS:
            (only,) = arguments
            return f"({only} < 0 ? -({only}) : {only})"
        sign = "<" if function is lang.Function.MIN else ">"
        text = arguments[0]
        for other in arguments[1:]:
            text = f"({text} {sign} {other} ? {text} : {other})"
        return text

    def _checked(self, text: str, type_: object, otherwise: lang.Literal | None) -> str:
        """Return a member by its number, or the whole part of a float, if there is one."""
        fails = "(fsm_value)fsm_fails(&failed)" if otherwise is None else self.print(otherwise)
        if isinstance(type_, lang.EnumType):
            known = " || ".join(f"{text} == {self._literal(n)}" for n in type_.numbers)
        else:
            known = f"{text} >= -0x1p63 && {text} < 0x1p63"
        return f"({known} ? (fsm_value){text} : {fails})"

    def _convert(self, operand: lang.Expr, type_: object) -> str:
        text = self.print(operand)
        if isinstance(type_, lang.FloatType):
            return f"((double){text})"
        if isinstance(type_, lang.IntType) and type_.overflow is lang.Overflow.WRAP:
            return _reduced(f"((fsm_value){text})", type_)
        if isinstance(type_, lang.IntType):
            lo, hi = self._literal(type_.lo), self._literal(min(type_.hi, 2**63 - 1))
            return f"({text} < {lo} ? {lo} : {text} > {hi} ? {hi} : (fsm_value){text})"
        return f"((fsm_value){text})"


def _reduced(text: str, type_: object) -> str:
    """Return a result brought into the wrapping type it is computed in."""
    if isinstance(type_, lang.IntType) and type_.overflow is lang.Overflow.WRAP:
        if type_.hi - type_.lo >= 2**64 - 1:
            return text
        return f"fsm_wrap({text}, INT64_C({type_.lo}), INT64_C({type_.hi}))"
    return text
