"""Formatting of expressions in the notation of fsmkit."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from fsmkit.language import tree, types
from fsmkit.language.durations import format_ticks
from fsmkit.language.printing import (
    ATOM,
    ExprPrinter,
    Fragment,
    Operator,
    left_assoc,
    non_assoc,
    prefix,
)

PLAIN_STATE = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*")
WORDS = {"and", "or", "not", "if", "else", "true", "false", "True", "False", "super"}
WORDS |= {"typeof", "new", "void"}
CHOICE, DENIAL, PREFIX = 1, 4, 14


def format_value(value: types.Value, type_: types.Type, tick: int = 1000) -> str:
    """Return a value of a type as a literal; ``tick`` is the length of a tick in microseconds."""
    match type_, value:
        case types.DurationType(), int():
            return format_ticks(value, tick)
        case types.EnumType(name), int():
            return f"{name}.{type_.member(value)}"
        case types.ArrayType(element), tuple():
            return f"[{', '.join(format_value(v, element, tick) for v in value)}]"
        case types.RecordType(_, fields), tuple():
            parts = (_format_field(f, v, tick) for f, v in zip(fields, value, strict=True))
            return f"({', '.join(parts)})"
        case _, bool():
            return "true" if value else "false"
        case _, str():
            return json.dumps(value, ensure_ascii=False)
        case _, float() if math.isinf(value):
            return "-1e308 * 10.0" if value < 0 else "1e308 * 10.0"
        case _, float() if math.isnan(value):
            return "0.0 / 0.0"
        case _:
            return repr(value)


def _format_field(field: types.Field, value: types.Value, tick: int) -> str:
    return f"{field.name} = {format_value(value, field.type, tick)}"


@dataclass(frozen=True, slots=True)
class SourcePrinter(ExprPrinter):
    """Prints an expression that reads back as the same tree in the same scope.

    Implicit conversions are not printed: they follow from the types. For ``tick`` see
    `format_value`.
    """

    tick: int = 1000

    unary: ClassVar[Mapping[tree.UnaryOp, Operator]] = {
        tree.UnaryOp.NOT: prefix("not ", DENIAL, DENIAL),
        tree.UnaryOp.NEGATE: prefix("-", PREFIX, PREFIX),
        tree.UnaryOp.INVERT: prefix("~", PREFIX, PREFIX),
    }
    binary: ClassVar[Mapping[tree.BinaryOp, Operator]] = {
        tree.BinaryOp.OR: left_assoc("or", 2),
        tree.BinaryOp.AND: left_assoc("and", 3),
        tree.BinaryOp.BIT_OR: left_assoc("|", 5),
        tree.BinaryOp.BIT_XOR: left_assoc("^", 6),
        tree.BinaryOp.BIT_AND: left_assoc("&", 7),
        tree.BinaryOp.EQ: Operator(
            "==", 8, 10, 10
        ),  # a comparison of a comparison needs parentheses
        tree.BinaryOp.NE: Operator("!=", 8, 10, 10),
        tree.BinaryOp.LT: non_assoc("<", 9),
        tree.BinaryOp.LE: non_assoc("<=", 9),
        tree.BinaryOp.GT: non_assoc(">", 9),
        tree.BinaryOp.GE: non_assoc(">=", 9),
        tree.BinaryOp.SHIFT_LEFT: left_assoc("<<", 10),
        tree.BinaryOp.SHIFT_RIGHT: left_assoc(">>", 10),
        tree.BinaryOp.ADD: left_assoc("+", 11),
        tree.BinaryOp.SUB: left_assoc("-", 11),
        tree.BinaryOp.MUL: left_assoc("*", 12),
        tree.BinaryOp.DIV: left_assoc("/", 12),
        tree.BinaryOp.REM: left_assoc("%", 12),
    }

    def literal(self, expr: tree.Literal) -> Fragment:
        """Print a constant, by its name in the chart if it has one."""
        if expr.name:
            return Fragment(expr.name)
        text = format_value(expr.value, expr.type, self.tick)
        if isinstance(expr.value, float) and not math.isfinite(expr.value):
            return Fragment(text, 12)
        return Fragment(text, PREFIX if text.startswith("-") else ATOM)

    def variable(self, expr: tree.Variable) -> Fragment:
        """Print a variable."""
        return Fragment(expr.name)

    def event_field(self, expr: tree.EventField) -> Fragment:
        """Print a field of the payload."""
        return Fragment(f"event.{expr.name}")

    def event_name(self, expr: tree.EventName) -> Fragment:
        """Print the name of the event, or its type."""
        return Fragment("_event.type" if isinstance(expr, tree.EventType) else "_event.name")

    def in_state(self, expr: tree.InState) -> Fragment:
        """Print a state test."""
        is_plain = PLAIN_STATE.fullmatch(expr.id) and not WORDS & {*expr.id.split(".")}
        return Fragment(
            f"In({expr.id})" if is_plain else f"In({json.dumps(expr.id, ensure_ascii=False)})"
        )

    def conditional(self, expr: tree.Conditional) -> Fragment:
        """Print a conditional expression as C does."""
        test = self.fragment(expr.test).at_least(CHOICE + 1)
        then = self.fragment(expr.then).at_least(CHOICE)
        return Fragment(f"{test} ? {then} : {self.print(expr.otherwise)}", CHOICE)

    def apply(self, expr: tree.Apply) -> Fragment:
        """Print a function of the language."""
        return Fragment(f"{expr.function.value}({self.arguments(expr.arguments)})")

    def call(self, expr: tree.Call) -> Fragment:
        """Print a call of an operation."""
        return Fragment(f"{expr.operation}({self.arguments(expr.arguments)})")

    def call_function(self, expr: tree.CallFunction) -> Fragment:
        """Print a call of a function of the chart."""
        return Fragment(f"{expr.function.name}({self.arguments(expr.arguments)})")

    def checked(self, expr: tree.Checked) -> Fragment:
        """Print a conversion that can fail."""
        name = expr.type.name if isinstance(expr.type, types.EnumType) else "int"
        other = () if expr.otherwise is None else (expr.otherwise,)
        return Fragment(f"{name}({self.arguments((expr.operand, *other))})")

    def convert(self, expr: tree.Convert) -> Fragment:
        """Print the operand; an explicit conversion also prints its type."""
        if expr.name is not None:
            return Fragment(f"{expr.name}({self.print(expr.operand)})")
        return self.fragment(expr.operand)

    def invalid(self, expr: tree.Invalid) -> Fragment:
        """Print the reason why it cannot be evaluated."""
        return Fragment(f"invalid({json.dumps(expr.reason)})")


def format_expression(expr: tree.Expr, tick: int = 1000) -> str:
    """Format an expression; ``tick`` is the length of a tick in microseconds."""
    return SourcePrinter(tick).print(expr)
