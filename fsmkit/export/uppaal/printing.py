"""Print expressions of charts in UPPAAL's notation, whose arithmetic is that of C in 32 bits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import ClassVar

import fsmkit.language as lang
from fsmkit.export.uppaal.terms import negation, range_of, require_small, unsupported
from fsmkit.language.conversion import bounds
from fsmkit.language.printing import ATOM, C_BINARY, CHOICE, PREFIX, PRODUCT, SUM, left_assoc

BITWISE = frozenset(
    {
        lang.BinaryOp.BIT_OR,
        lang.BinaryOp.BIT_XOR,
        lang.BinaryOp.BIT_AND,
        lang.BinaryOp.SHIFT_LEFT,
        lang.BinaryOp.SHIFT_RIGHT,
    }
)

Access = Callable[[str, lang.Variable], lang.Fragment]
"""Returns the text of a variable, or of a part of a record; the name is a path with dots."""


class Printer(lang.ExprPrinter):
    """Prints with the given names; ``constants`` names members of enumerations."""

    binary: ClassVar[Mapping[lang.BinaryOp, lang.Operator]] = C_BINARY | {
        lang.BinaryOp.OR: left_assoc("||", 2),
        lang.BinaryOp.AND: left_assoc("&&", 3),
    }

    def __init__(
        self,
        access: Access,
        constant: Callable[[lang.EnumType, int], str],
        symbol: Callable[[str], int],
        test: Callable[[lang.InState], lang.Fragment] | None = None,
        *,
        flat: bool = False,
    ) -> None:
        """Print with these names; ``test`` prints in a query whether a state is active.

        ``flat``: reject operators on bits, which TChecker does not have.
        """
        self._flat = flat
        self._access = access
        self._constant = constant
        self._symbol = symbol
        self._test = test

    def condition(self, expr: lang.Expr, *, holds: bool = True) -> str:
        """Return a condition, or its negation, as one part of a conjunction."""
        if not holds:
            expr = negation(expr)
        return self.fragment(expr).at_least(4)

    def value(self, value: lang.Value) -> str:
        """Return a constant whose type does not matter."""
        if isinstance(value, str):
            return str(self._symbol(value))
        assert isinstance(value, int)  # noqa: S101  (scalars; floats are rejected)
        return str(int(value))

    def literal(self, expr: lang.Literal) -> lang.Fragment:
        """Print a constant."""
        match expr.type, expr.value:
            case lang.BoolType(), value:
                return lang.Fragment("true" if value else "false")
            case lang.EnumType() as type_, int(value):
                return lang.Fragment(self._constant(type_, value))
            case _, str(value):
                return lang.Fragment(str(self._symbol(value)))
            case _, int(value):
                range_of(expr)
                return lang.Fragment(str(value), PREFIX if value < 0 else ATOM)
            case _:
                raise unsupported(
                    f"a constant of type `{expr.type}` is not supported", expr.span, "use a number"
                )

    def variable(self, expr: lang.Variable) -> lang.Fragment:
        """Print a variable."""
        return self._access(expr.name, expr)

    def member(self, expr: lang.Member) -> lang.Fragment:
        """Print a part of a record, which is a variable of its own."""
        path, record = [expr.name], expr.record
        while isinstance(record, lang.Member):
            path.append(record.name)
            record = record.record
        if not isinstance(record, lang.Variable):
            raise unsupported("a part of this record is not supported", expr.span, "use a variable")
        name = ".".join([record.name, *reversed(path)])
        assert expr.type is not None  # noqa: S101  (a value)
        return self._access(name, lang.Variable(name, expr.type, record.storage, expr.span))

    def prefixed(self, expr: lang.Unary) -> lang.Fragment:
        """Print an operator of one operand; UPPAAL has no complement."""
        if expr.op is lang.UnaryOp.INVERT:
            inner = self.fragment(expr.operand).at_least(ATOM)
            return self._reduced(lang.Fragment(f"-{inner} - 1", SUM), expr)
        return self._reduced(super().prefixed(expr), expr)

    def infix(self, expr: lang.Binary) -> lang.Fragment:
        """Print an operator of two operands."""
        if self._flat and expr.op in BITWISE:
            raise unsupported(
                "operators on bits are not in the flat form: TChecker has none",
                expr.span,
                "use `--to uppaal`, or a multiplication, a division or a remainder",
            )
        if expr.op in (lang.BinaryOp.SHIFT_LEFT, lang.BinaryOp.SHIFT_RIGHT):
            lo, hi = range_of(expr.right)
            if lo < 0 or hi > 31 or range_of(expr.left)[0] < 0:
                raise unsupported(
                    "this shift depends on the width", expr.span, "multiply or divide"
                )
        return self._reduced(super().infix(expr), expr)

    def _reduced(self, printed: lang.Fragment, expr: lang.Unary | lang.Binary) -> lang.Fragment:
        """Reject a result that needs wrapping: 32 bits must hold it."""
        if isinstance(expr.type, lang.IntType):
            lo, hi = range_of(expr)
            if (
                expr.type.overflow is lang.Overflow.WRAP
                and not expr.type.lo <= lo <= hi <= expr.type.hi
            ):
                return self._wrapped(printed, lo, expr.type.lo, expr.type.hi)
        elif not isinstance(expr.type, lang.BoolType | lang.DurationType):
            raise unsupported(
                f"a value of type `{expr.type}` is not supported", expr.span, "use integers"
            )
        return printed

    def _wrapped(self, printed: lang.Fragment, least: int, lo: int, hi: int) -> lang.Fragment:
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
            return lang.Fragment(rest, PRODUCT)
        return lang.Fragment(f"{rest} - {-lo}" if lo < 0 else f"{rest} + {lo}", SUM)

    def apply(self, expr: lang.Apply) -> lang.Fragment:
        """Print a function of the language by choices, which every tool supports."""
        range_of(expr)
        texts = [self.fragment(argument).at_least(9) for argument in expr.arguments]
        if expr.function is lang.Function.ABS:
            tight = self.fragment(expr.arguments[0]).at_least(ATOM)
            return lang.Fragment(f"{texts[0]} < 0 ? -{tight} : {texts[0]}", CHOICE)
        sign = "<=" if expr.function is lang.Function.MIN else ">="
        text = texts[0]
        for other in texts[1:]:
            text = f"({text} {sign} {other} ? {text} : {other})"
        return lang.Fragment(text)

    def convert(self, expr: lang.Convert) -> lang.Fragment:
        """Print a value limited to a range."""
        type_ = expr.type
        if not isinstance(type_, lang.IntType | lang.DurationType):
            raise unsupported(
                f"a value of type `{type_}` is not supported", expr.span, "use integers"
            )
        lo, hi, overflow = bounds(type_)
        least, greatest = range_of(expr.operand)
        inner = self.fragment(expr.operand)
        if lo <= least and greatest <= hi:
            return inner
        if overflow is lang.Overflow.WRAP:
            return self._wrapped(inner, least, lo, hi)
        text = inner.at_least(9)
        found = text
        if greatest > hi:
            found = f"({text} > {hi} ? {hi} : {text})"
        if least < lo:
            found = f"({text} < {lo} ? {lo} : {found})"
        return lang.Fragment(found)

    def in_state(self, expr: lang.InState) -> lang.Fragment:
        """Print a state test, in a query; elsewhere the location decides it."""
        assert self._test is not None, expr  # noqa: S101  (bound while recording)
        return self._test(expr)

    def rejected(self, expr: lang.Expr) -> lang.Fragment:
        """Reject an expression that UPPAAL cannot evaluate, or that was bound while recording."""
        advice = "remove it"
        match expr:
            case lang.Call(operation):
                message, advice = f"`{operation}` cannot be called here", "call it elsewhere"
            case lang.CallFunction(function):
                message = f"the function `{function.name}` is not translated"
                advice = "write what it computes here, or declare an operation"
            case lang.Checked():
                message = "this conversion is not translated"
                advice = "compare with each value"
            case lang.Invalid(reason):
                message, advice = reason, "write what can be evaluated"
            case _:
                message = "there is no current event here"
        raise unsupported(message, expr.span, advice)
