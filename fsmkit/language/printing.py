"""Expressions as infix text: a language supplies its notation, this module the walk."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Generic, TypeVar

from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.language import tree

ATOM = 100
"""How tightly a name, a call or anything in brackets binds."""
HOOKS: Mapping[type, str] = {
    tree.Literal: "literal",
    tree.Variable: "variable",
    tree.EventField: "event_field",
    tree.EventName: "event_name",
    tree.EventType: "event_name",
    tree.InState: "in_state",
    tree.Unary: "prefixed",
    tree.Binary: "infix",
    tree.Conditional: "conditional",
    tree.Element: "element",
    tree.Member: "member",
    tree.Apply: "apply",
    tree.Call: "call",
    tree.CallFunction: "call_function",
    tree.Checked: "checked",
    tree.Convert: "convert",
    tree.Invalid: "invalid",
    tree.CoveredCondition: "watched",
    tree.CoveredGuard: "watched",
}
"""The method that prints a node of each class."""


@dataclass(frozen=True, slots=True)
class Operator:
    """An operator: its symbol, how tightly it binds, and what each operand slot accepts.

    An operand is parenthesised when it binds less tightly than its slot requires. ``left`` and
    ``right`` may require more than the grammar of the language does, to keep compilers quiet.
    """

    symbol: str
    binds: int
    left: int
    right: int


def left_assoc(text: str, binds: int) -> Operator:
    """Return an operator for which ``a - b - c`` means ``(a - b) - c``."""
    return Operator(text, binds, binds, binds + 1)


def non_assoc(text: str, binds: int) -> Operator:
    """Return an operator whose operands need parentheses where they are such operators."""
    return Operator(text, binds, binds + 1, binds + 1)


def prefix(text: str, binds: int, operand: int) -> Operator:
    """Return a prefix operator."""
    return Operator(text, binds, operand, operand)


@fast_init
@dataclass(frozen=True, slots=True)
class Fragment:
    """Printed text and how tightly it binds."""

    text: str
    binds: int = ATOM

    def at_least(self, required: int) -> str:
        """Return the text, in parentheses unless it binds tightly enough."""
        return self.text if self.binds >= required else f"({self.text})"


Printed = TypeVar("Printed")
"""A printed expression: its text, and what the language has to know to use it as an operand."""


class Walk(Generic[Printed]):
    """Prints expressions: a language implements the methods of `HOOKS` for what it can express."""

    def fragment(self, expr: tree.Expr) -> Printed:
        """Return an expression as an operand of others."""
        found: Printed = getattr(self, HOOKS[expr.__class__], self.rejected)(expr)
        return found

    def rejected(self, expr: tree.Expr) -> Printed:
        """Print a node for which the language has no method: an error by default."""
        raise AssertionError(expr)

    def watched(self, expr: tree.CoveredCondition | tree.CoveredGuard) -> Printed:
        """Print a counted condition, or a counted guard; by default it is not counted."""
        return self.fragment(expr.operand)


CHOICE, TEST, COMPARISON, SUM, PRODUCT, PREFIX = 1, 7, 8, 10, 11, 13
"""How tightly operators of C bind (C99 6.5)."""
C_UNARY = {
    tree.UnaryOp.NOT: prefix("!", PREFIX, PREFIX),
    tree.UnaryOp.NEGATE: prefix("-", PREFIX, ATOM),
    tree.UnaryOp.INVERT: prefix("~", PREFIX, ATOM),
}
C_BINARY = {
    tree.BinaryOp.OR: Operator("||", 2, TEST, TEST),
    tree.BinaryOp.AND: Operator("&&", 3, TEST, TEST),
    tree.BinaryOp.BIT_OR: Operator("|", 4, PREFIX, PREFIX),
    tree.BinaryOp.BIT_XOR: Operator("^", 5, PREFIX, PREFIX),
    tree.BinaryOp.BIT_AND: Operator("&", 6, PREFIX, PREFIX),
    tree.BinaryOp.EQ: Operator("==", TEST, SUM, SUM),
    tree.BinaryOp.NE: Operator("!=", TEST, SUM, SUM),
    tree.BinaryOp.LT: Operator("<", COMPARISON, SUM, SUM),
    tree.BinaryOp.LE: Operator("<=", COMPARISON, SUM, SUM),
    tree.BinaryOp.GT: Operator(">", COMPARISON, SUM, SUM),
    tree.BinaryOp.GE: Operator(">=", COMPARISON, SUM, SUM),
    tree.BinaryOp.SHIFT_LEFT: Operator("<<", 9, PREFIX, PREFIX),
    tree.BinaryOp.SHIFT_RIGHT: Operator(">>", 9, PREFIX, PREFIX),
    tree.BinaryOp.ADD: left_assoc("+", SUM),
    tree.BinaryOp.SUB: left_assoc("-", SUM),
    tree.BinaryOp.MUL: left_assoc("*", PRODUCT),
    tree.BinaryOp.DIV: left_assoc("/", PRODUCT),
    tree.BinaryOp.REM: left_assoc("%", PRODUCT),
}
"""Operators of C, and of notations after it, with the parentheses that compilers recommend."""


class ExprPrinter(Walk[Fragment]):
    """Prints expressions of a language that has the operators of the tables, by default C's.

    Override `prefixed` or `infix` where an operator has another meaning for some types.
    """

    unary: ClassVar[Mapping[tree.UnaryOp, Operator]] = C_UNARY
    binary: ClassVar[Mapping[tree.BinaryOp, Operator]] = C_BINARY

    def print(self, expr: tree.Expr) -> str:
        """Return an expression as text of the language."""
        return self.fragment(expr).text

    def arguments(self, arguments: tuple[tree.Expr, ...]) -> str:
        """Print a list of arguments, without its brackets."""
        return ", ".join([self.fragment(argument).text for argument in arguments])

    def prefixed(self, expr: tree.Unary) -> Fragment:
        """Print an operator of one operand."""
        how = self.unary[expr.op]
        return Fragment(how.symbol + self.fragment(expr.operand).at_least(how.right), how.binds)

    def infix(self, expr: tree.Binary) -> Fragment:
        """Print an operator of two operands."""
        how = self.binary[expr.op]
        left = self.fragment(expr.left).at_least(how.left)
        right = self.fragment(expr.right).at_least(how.right)
        return Fragment(f"{left} {how.symbol} {right}", how.binds)

    def element(self, expr: tree.Element) -> Fragment:
        """Print an element of an array, unchecked."""
        array = self.fragment(expr.array).at_least(ATOM)
        return Fragment(f"{array}[{self.fragment(expr.index).text}]")

    def member(self, expr: tree.Member) -> Fragment:
        """Print a field of a record."""
        return Fragment(f"{self.fragment(expr.record).at_least(ATOM)}.{expr.name}")

    def conditional(self, expr: tree.Conditional) -> Fragment:
        """Print a choice of two values."""
        parts = (expr.test, expr.then, expr.otherwise)
        test, then, otherwise = (self.fragment(part).at_least(CHOICE + 1) for part in parts)
        return Fragment(f"{test} ? {then} : {otherwise}", CHOICE)
