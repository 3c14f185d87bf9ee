"""Expressions as infix text: a target supplies the spellings, this module the walk."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, assert_never

from fsmkit.language import tree

ATOM = 100
"""How tightly a name, a call or anything in brackets binds."""


@dataclass(frozen=True, slots=True)
class Spelling:
    """How an operator is written, how tightly it binds, and what each operand slot accepts.

    An operand is parenthesised when it binds less tightly than its slot requires. ``left`` and
    ``right`` may ask for more than the grammar of the target does, to keep compilers quiet.
    """

    text: str
    binds: int
    left: int
    right: int


def left_assoc(text: str, binds: int) -> Spelling:
    """Spell an operator for which ``a - b - c`` means ``(a - b) - c``."""
    return Spelling(text, binds, binds, binds + 1)


def non_assoc(text: str, binds: int) -> Spelling:
    """Spell an operator that must not meet itself without parentheses."""
    return Spelling(text, binds, binds + 1, binds + 1)


def prefix(text: str, binds: int, operand: int) -> Spelling:
    """Spell a prefix operator."""
    return Spelling(text, binds, operand, operand)


@dataclass(frozen=True, slots=True)
class Fragment:
    """Printed text and how tightly it binds."""

    text: str
    binds: int = ATOM

    def at_least(self, required: int) -> str:
        """Return the text, in parentheses unless it binds tightly enough."""
        return self.text if self.binds >= required else f"({self.text})"


class ExprPrinter(ABC):
    """Prints expressions for one target.

    Operators go by the tables ``unary`` and ``binary``; override `prefixed` or `infix` where the
    target has no operator of that meaning for those types.
    """

    unary: ClassVar[Mapping[tree.UnaryOp, Spelling]]
    binary: ClassVar[Mapping[tree.BinaryOp, Spelling]]

    def print(self, expr: tree.Expr) -> str:
        """Return an expression as text of the target."""
        return self.fragment(expr).text

    def fragment(self, expr: tree.Expr) -> Fragment:
        """Return an expression as text that can stand inside more text."""
        match expr:
            case tree.Literal():
                return self.literal(expr)
            case tree.Variable():
                return self.variable(expr)
            case tree.EventField():
                return self.event_field(expr)
            case tree.EventName():
                return self.event_name(expr)
            case tree.InState():
                return self.in_state(expr)
            case tree.Unary():
                return self.prefixed(expr)
            case tree.Binary():
                return self.infix(expr)
            case tree.Conditional():
                return self.conditional(expr)
            case tree.Element():
                return self.element(expr)
            case tree.Member():
                return self.member(expr)
            case tree.Apply():
                return self.apply(expr)
            case tree.Call():
                return self.call(expr)
            case tree.CallFunction():
                return self.call_function(expr)
            case tree.Checked():
                return self.checked(expr)
            case tree.Convert():
                return self.convert(expr)
            case tree.Invalid():
                return self.invalid(expr)
            case tree.Watched(operand) | tree.Decided(operand):
                return self.fragment(operand)
            case _:
                assert_never(expr)

    def arguments(self, arguments: tuple[tree.Expr, ...]) -> str:
        """Print a list of arguments, without its brackets."""
        return ", ".join(self.print(argument) for argument in arguments)

    def prefixed(self, expr: tree.Unary) -> Fragment:
        """Print an operator of one operand."""
        how = self.unary[expr.op]
        return Fragment(how.text + self.fragment(expr.operand).at_least(how.right), how.binds)

    def infix(self, expr: tree.Binary) -> Fragment:
        """Print an operator of two operands."""
        how = self.binary[expr.op]
        left = self.fragment(expr.left).at_least(how.left)
        right = self.fragment(expr.right).at_least(how.right)
        return Fragment(f"{left} {how.text} {right}", how.binds)

    def element(self, expr: tree.Element) -> Fragment:
        """Print an element of an array, unchecked."""
        array = self.fragment(expr.array).at_least(ATOM)
        return Fragment(f"{array}[{self.print(expr.index)}]")

    def member(self, expr: tree.Member) -> Fragment:
        """Print a field of a record."""
        return Fragment(f"{self.fragment(expr.record).at_least(ATOM)}.{expr.name}")

    @abstractmethod
    def literal(self, expr: tree.Literal) -> Fragment:
        """Print a constant."""

    @abstractmethod
    def variable(self, expr: tree.Variable) -> Fragment:
        """Print a variable."""

    @abstractmethod
    def event_field(self, expr: tree.EventField) -> Fragment:
        """Print a field of the payload being handled."""

    @abstractmethod
    def event_name(self, expr: tree.EventName) -> Fragment:
        """Print the name of the event being handled, or its type."""

    @abstractmethod
    def in_state(self, expr: tree.InState) -> Fragment:
        """Print a state test."""

    @abstractmethod
    def conditional(self, expr: tree.Conditional) -> Fragment:
        """Print a choice of two values."""

    @abstractmethod
    def apply(self, expr: tree.Apply) -> Fragment:
        """Print ``min``, ``max`` or ``abs``."""

    @abstractmethod
    def call(self, expr: tree.Call) -> Fragment:
        """Print a call of an operation."""

    @abstractmethod
    def call_function(self, expr: tree.CallFunction) -> Fragment:
        """Print a call of a function of the chart."""

    @abstractmethod
    def checked(self, expr: tree.Checked) -> Fragment:
        """Print a number as a value of a type that it may not have."""

    @abstractmethod
    def convert(self, expr: tree.Convert) -> Fragment:
        """Print a value brought into a type."""

    @abstractmethod
    def invalid(self, expr: tree.Invalid) -> Fragment:
        """Print what cannot be evaluated."""
