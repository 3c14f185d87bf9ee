"""Expressions of charts in UPPAAL's notation, whose arithmetic is that of C in 32 bits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import ClassVar

from fsmkit.export.uppaal.terms import denied, range_of, refuse, require_small
from fsmkit.language import (
    Apply,
    Binary,
    BinaryOp,
    BoolType,
    Call,
    CallFunction,
    Checked,
    Conditional,
    Convert,
    DurationType,
    EnumType,
    EventField,
    EventName,
    Expr,
    ExprPrinter,
    Fragment,
    Function,
    InState,
    IntType,
    Invalid,
    Literal,
    Member,
    Overflow,
    Spelling,
    Unary,
    UnaryOp,
    Value,
    Variable,
)
from fsmkit.language.conversion import bounds
from fsmkit.language.printing import left_assoc, non_assoc, prefix

CHOICE, COMPARED, SUM, PRODUCT, PREFIX = 1, 8, 10, 11, 13

BITWISE = frozenset(
    {
        BinaryOp.BIT_OR,
        BinaryOp.BIT_XOR,
        BinaryOp.BIT_AND,
        BinaryOp.SHIFT_LEFT,
        BinaryOp.SHIFT_RIGHT,
    }
)

Access = Callable[[str, Variable], Fragment]
"""Returns the text of a variable, or of a part of a record; the name is a path with dots."""


class Printer(ExprPrinter):
    """Prints with the names that it is given; ``constants`` names members of enumerations."""

    unary: ClassVar[Mapping[UnaryOp, Spelling]] = {
        UnaryOp.NOT: prefix("!", PREFIX, PREFIX),
        UnaryOp.NEGATE: prefix("-", PREFIX, PREFIX + 1),
    }
    binary: ClassVar[Mapping[BinaryOp, Spelling]] = {
        BinaryOp.OR: left_assoc("||", 2),
        BinaryOp.AND: left_assoc("&&", 3),
        BinaryOp.BIT_OR: left_assoc("|", 4),
        BinaryOp.BIT_XOR: left_assoc("^", 5),
        BinaryOp.BIT_AND: left_assoc("&", 6),
        BinaryOp.EQ: non_assoc("==", 7),
        BinaryOp.NE: non_assoc("!=", 7),
        BinaryOp.LT: non_assoc("<", COMPARED),
        BinaryOp.LE: non_assoc("<=", COMPARED),
        BinaryOp.GT: non_assoc(">", COMPARED),
        BinaryOp.GE: non_assoc(">=", COMPARED),
        BinaryOp.SHIFT_LEFT: non_assoc("<<", 9),
        BinaryOp.SHIFT_RIGHT: non_assoc(">>", 9),
        BinaryOp.ADD: left_assoc("+", SUM),
        BinaryOp.SUB: left_assoc("-", SUM),
        BinaryOp.MUL: left_assoc("*", PRODUCT),
        BinaryOp.DIV: left_assoc("/", PRODUCT),
        BinaryOp.REM: left_assoc("%", PRODUCT),
    }

    def __init__(
        self,
        access: Access,
        constant: Callable[[EnumType, int], str],
        symbol: Callable[[str], int],
        test: Callable[[InState], Fragment] | None = None,
        *,
        flat: bool = False,
    ) -> None:
        """Print with these names; ``test`` says in a query whether a state is active.

        ``flat``: reject operators on bits, which TChecker does not have.
        """
        self._flat = flat
        self._access = access
        self._constant = constant
        self._symbol = symbol
        self._test = test

    def condition(self, expr: Expr, *, holds: bool = True) -> str:
        """Return a condition, or its negation, as one part of a conjunction."""
        if not holds:
            expr = denied(expr)
        return self.fragment(expr).at_least(4)

    def value(self, value: Value) -> str:
        """Return a constant whose type does not matter."""
        if isinstance(value, str):
            return str(self._symbol(value))
        assert isinstance(value, int)  # noqa: S101  (scalars; floats were refused)
        return str(int(value))

    def literal(self, expr: Literal) -> Fragment:
        """Print a constant."""
        match expr.type, expr.value:
            case BoolType(), value:
                return Fragment("true" if value else "false")
            case EnumType() as type_, int(value):
                return Fragment(self._constant(type_, value))
            case _, str(value):
                return Fragment(str(self._symbol(value)))
            case _, int(value):
                range_of(expr)
                return Fragment(str(value), PREFIX if value < 0 else 100)
            case _:
                raise refuse(
                    f"a constant of type `{expr.type}` cannot be said", expr.span, "use a number"
                )

    def variable(self, expr: Variable) -> Fragment:
        """Print a variable."""
        return self._access(expr.name, expr)

    def member(self, expr: Member) -> Fragment:
        """Print a part of a record, which is a variable of its own."""
        path, record = [expr.name], expr.record
        while isinstance(record, Member):
            path.append(record.name)
            record = record.record
        if not isinstance(record, Variable):
            raise refuse("a part of this record cannot be said", expr.span, "use a variable")
        name = ".".join([record.name, *reversed(path)])
        assert expr.type is not None  # noqa: S101  (a value)
        return self._access(name, Variable(name, expr.type, record.storage, expr.span))

    def prefixed(self, expr: Unary) -> Fragment:
        """Print an operator of one operand; UPPAAL has no complement."""
        if expr.op is UnaryOp.INVERT:
            inner = self.fragment(expr.operand).at_least(PREFIX + 1)
            return self._reduced(Fragment(f"-{inner} - 1", SUM), expr)
        return self._reduced(super().prefixed(expr), expr)

    def infix(self, expr: Binary) -> Fragment:
        """Print an operator of two operands."""
        if self._flat and expr.op in BITWISE:
            raise refuse(
                "operators on bits are not in the flat form: TChecker has none",
                expr.span,
                "use `--to uppaal`, or a multiplication, a division or a remainder",
            )
        if expr.op in (BinaryOp.SHIFT_LEFT, BinaryOp.SHIFT_RIGHT):
            lo, hi = range_of(expr.right)
            if lo < 0 or hi > 31 or range_of(expr.left)[0] < 0:
                raise refuse("this shift depends on the width", expr.span, "multiply or divide")
        return self._reduced(super().infix(expr), expr)

    def _reduced(self, printed: Fragment, expr: Unary | Binary) -> Fragment:
        """Demand that a result needs no wrapping: 32 bits hold it."""
        if isinstance(expr.type, IntType):
            lo, hi = range_of(expr)
            if expr.type.overflow is Overflow.WRAP and not expr.type.lo <= lo <= hi <= expr.type.hi:
                return self._wrapped(printed, lo, expr.type.lo, expr.type.hi)
        elif not isinstance(expr.type, BoolType | DurationType):
            raise refuse(f"a value of type `{expr.type}` cannot be said", expr.span, "use integers")
        return printed

    def _wrapped(self, printed: Fragment, least: int, lo: int, hi: int) -> Fragment:
        size = hi - lo + 1
        require_small(lo, size, None)
        shifted = f"{printed.at_least(SUM)} - {lo}" if lo > 0 else printed.text
        if lo < 0:
            shifted = f"{printed.at_least(SUM)} + {-lo}"
        if lo == 0:
            shifted = printed.at_least(PRODUCT)
        rest = f"({shifted}) % {size}" if lo else f"{shifted} % {size}"
        if least < lo:
            rest = f"({rest} + {size}) % {size}"
        if lo == 0:
            return Fragment(rest, PRODUCT)
        return Fragment(f"{rest} - {-lo}" if lo < 0 else f"{rest} + {lo}", SUM)

    def conditional(self, expr: Conditional) -> Fragment:
        """Print a choice as C does."""
        parts = [self.fragment(e).at_least(CHOICE + 1) for e in (expr.test, expr.then)]
        other = self.fragment(expr.otherwise).at_least(CHOICE + 1)
        return Fragment(f"{parts[0]} ? {parts[1]} : {other}", CHOICE)

    def apply(self, expr: Apply) -> Fragment:
        """Print a function of the language by choices, which every tool knows."""
        range_of(expr)
        texts = [self.fragment(argument).at_least(9) for argument in expr.arguments]
        if expr.function is Function.ABS:
            tight = self.fragment(expr.arguments[0]).at_least(PREFIX + 1)
            return Fragment(f"{texts[0]} < 0 ? -{tight} : {texts[0]}", CHOICE)
        sign = "<=" if expr.function is Function.MIN else ">="
        text = texts[0]
        for other in texts[1:]:
            text = f"({text} {sign} {other} ? {text} : {other})"
        return Fragment(text)

    def convert(self, expr: Convert) -> Fragment:
        """Print a value brought into a range."""
        type_ = expr.type
        if not isinstance(type_, IntType | DurationType):
            raise refuse(f"a value of type `{type_}` cannot be said", expr.span, "use integers")
        lo, hi, overflow = bounds(type_)
        least, greatest = range_of(expr.operand)
        inner = self.fragment(expr.operand)
        if lo <= least and greatest <= hi:
            return inner
        if overflow is Overflow.WRAP:
            return self._wrapped(inner, least, lo, hi)
        text = inner.at_least(9)
        found = text
        if greatest > hi:
            found = f"({text} > {hi} ? {hi} : {text})"
        if least < lo:
            found = f"({text} < {lo} ? {lo} : {found})"
        return Fragment(found)

    def in_state(self, expr: InState) -> Fragment:
        """Print a state test, in a query; elsewhere the location decides it."""
        assert self._test is not None, expr  # noqa: S101  (bound while recording)
        return self._test(expr)

    def event_field(self, expr: EventField) -> Fragment:
        """Never there: bound while recording."""
        raise refuse("there is no event at hand here", expr.span, "remove it")

    def event_name(self, expr: EventName) -> Fragment:
        """Never there: bound while recording."""
        raise refuse("there is no event at hand here", expr.span, "remove it")

    def call(self, expr: Call) -> Fragment:
        """Never there: bound while recording."""
        raise refuse(f"`{expr.operation}` cannot be called here", expr.span, "call it elsewhere")

    def call_function(self, expr: CallFunction) -> Fragment:
        """Refuse a function: its body has statements."""
        advice = "write what it computes here, or declare an operation"
        raise refuse(f"the function `{expr.function.name}` is not translated", expr.span, advice)

    def checked(self, expr: Checked) -> Fragment:
        """Refuse a conversion that can fail."""
        raise refuse("this conversion is not translated", expr.span, "compare with each value")

    def invalid(self, expr: Invalid) -> Fragment:
        """Refuse it: only what never evaluates it can be said."""
        raise refuse(expr.reason, expr.span, "write what can be evaluated")
