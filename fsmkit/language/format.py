"""Expressions as people write them: the notation of fsmkit itself."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from fsmkit.language.durations import spelled
from fsmkit.language.printing import (
    ATOM,
    ExprPrinter,
    Fragment,
    Spelling,
    left_assoc,
    non_assoc,
    prefix,
)
from fsmkit.language.tree import (
    Apply,
    BinaryOp,
    Call,
    CallFunction,
    Checked,
    Conditional,
    Convert,
    EventField,
    EventName,
    EventType,
    Expr,
    InState,
    Invalid,
    Literal,
    UnaryOp,
    Variable,
)
from fsmkit.language.types import (
    ArrayType,
    DurationType,
    EnumType,
    Field,
    RecordType,
    Type,
    Value,
)

PLAIN_STATE = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*")
WORDS = {"and", "or", "not", "if", "else", "true", "false", "True", "False", "super"}
WORDS |= {"typeof", "new", "void"}
CHOICE, DENIAL, PREFIX = 1, 4, 14


def spell_value(value: Value, type_: Type, tick: int = 1000) -> str:
    """Return a value of a type as a literal; ``tick`` is the length of a tick in microseconds."""
    match type_, value:
        case DurationType(), int():
            return spelled(value, tick)
        case EnumType(name), int():
            return f"{name}.{type_.member(value)}"
        case ArrayType(element), tuple():
            return f"[{', '.join(spell_value(v, element, tick) for v in value)}]"
        case RecordType(_, fields), tuple():
            parts = (_spell_field(f, v, tick) for f, v in zip(fields, value, strict=True))
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


def _spell_field(field: Field, value: Value, tick: int) -> str:
    return f"{field.name} = {spell_value(value, field.type, tick)}"


@dataclass(frozen=True, slots=True)
class SourcePrinter(ExprPrinter):
    """Prints what reads back as the same tree, where the scope is the same.

    Conversions are not written: they follow from the types again. ``tick`` as for `spell_value`.
    """

    tick: int = 1000

    unary: ClassVar[Mapping[UnaryOp, Spelling]] = {
        UnaryOp.NOT: prefix("not ", DENIAL, DENIAL),
        UnaryOp.NEGATE: prefix("-", PREFIX, PREFIX),
        UnaryOp.INVERT: prefix("~", PREFIX, PREFIX),
    }
    binary: ClassVar[Mapping[BinaryOp, Spelling]] = {
        BinaryOp.OR: left_assoc("or", 2),
        BinaryOp.AND: left_assoc("and", 3),
        BinaryOp.BIT_OR: left_assoc("|", 5),
        BinaryOp.BIT_XOR: left_assoc("^", 6),
        BinaryOp.BIT_AND: left_assoc("&", 7),
        BinaryOp.EQ: Spelling("==", 8, 10, 10),  # a comparison of a comparison needs parentheses
        BinaryOp.NE: Spelling("!=", 8, 10, 10),
        BinaryOp.LT: non_assoc("<", 9),
        BinaryOp.LE: non_assoc("<=", 9),
        BinaryOp.GT: non_assoc(">", 9),
        BinaryOp.GE: non_assoc(">=", 9),
        BinaryOp.SHIFT_LEFT: left_assoc("<<", 10),
        BinaryOp.SHIFT_RIGHT: left_assoc(">>", 10),
        BinaryOp.ADD: left_assoc("+", 11),
        BinaryOp.SUB: left_assoc("-", 11),
        BinaryOp.MUL: left_assoc("*", 12),
        BinaryOp.DIV: left_assoc("/", 12),
        BinaryOp.REM: left_assoc("%", 12),
    }

    def literal(self, expr: Literal) -> Fragment:
        """Print a constant, by its name in the chart if it has one."""
        if expr.name:
            return Fragment(expr.name)
        text = spell_value(expr.value, expr.type, self.tick)
        if isinstance(expr.value, float) and not math.isfinite(expr.value):
            return Fragment(text, 12)
        return Fragment(text, PREFIX if text.startswith("-") else ATOM)

    def variable(self, expr: Variable) -> Fragment:
        """Print a variable."""
        return Fragment(expr.name)

    def event_field(self, expr: EventField) -> Fragment:
        """Print a field of the payload."""
        return Fragment(f"event.{expr.name}")

    def event_name(self, expr: EventName) -> Fragment:
        """Print the name of the event, or its type."""
        return Fragment("_event.type" if isinstance(expr, EventType) else "_event.name")

    def in_state(self, expr: InState) -> Fragment:
        """Print a state test."""
        is_plain = PLAIN_STATE.fullmatch(expr.id) and not WORDS & {*expr.id.split(".")}
        return Fragment(
            f"In({expr.id})" if is_plain else f"In({json.dumps(expr.id, ensure_ascii=False)})"
        )

    def conditional(self, expr: Conditional) -> Fragment:
        """Print a choice as C does."""
        test = self.fragment(expr.test).at_least(CHOICE + 1)
        then = self.fragment(expr.then).at_least(CHOICE)
        return Fragment(f"{test} ? {then} : {self.print(expr.otherwise)}", CHOICE)

    def apply(self, expr: Apply) -> Fragment:
        """Print a function of the language."""
        return Fragment(f"{expr.function.value}({self.arguments(expr.arguments)})")

    def call(self, expr: Call) -> Fragment:
        """Print a call of an operation."""
        return Fragment(f"{expr.operation}({self.arguments(expr.arguments)})")

    def call_function(self, expr: CallFunction) -> Fragment:
        """Print a call of a function of the chart."""
        return Fragment(f"{expr.function.name}({self.arguments(expr.arguments)})")

    def checked(self, expr: Checked) -> Fragment:
        """Print a conversion that can fail."""
        name = expr.type.name if isinstance(expr.type, EnumType) else "int"
        other = () if expr.otherwise is None else (expr.otherwise,)
        return Fragment(f"{name}({self.arguments((expr.operand, *other))})")

    def convert(self, expr: Convert) -> Fragment:
        """Print what is converted; a conversion that was written names its type."""
        if expr.name is not None:
            return Fragment(f"{expr.name}({self.print(expr.operand)})")
        return self.fragment(expr.operand)

    def invalid(self, expr: Invalid) -> Fragment:
        """Print why it cannot be evaluated."""
        return Fragment(f"invalid({json.dumps(expr.reason)})")


def spell(expr: Expr, tick: int = 1000) -> str:
    """Return an expression as people write it."""
    return SourcePrinter(tick).print(expr)
