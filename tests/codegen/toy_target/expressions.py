"""Expressions and statements in awk."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import ClassVar

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.chart.analysis.effects import can_end, can_fail
from fsmkit.chart.chart import Chart
from fsmkit.codegen.statements import Choice, StatementPrinter
from fsmkit.emit import Emitter, legal
from fsmkit.emit.c import quoted
from fsmkit.language.printing import ATOM, C_UNARY, ExprPrinter, Fragment, Operator, prefix
from fsmkit.plan.values import bounding, count_width, lowered, wrapping_bounds

BOUNDING = {
    lang.Overflow.WRAP: "wrapped",
    lang.Overflow.SATURATE: "saturated",
    lang.Overflow.NEAREST: "nearest",
}
"""The functions of the runtime that bring a number into bounds."""
CALLED = {
    lang.BinaryOp.DIV: "quotient",
    lang.BinaryOp.REM: "remainder",
    lang.BinaryOp.BIT_AND: "bit_and",
    lang.BinaryOp.BIT_OR: "bit_or",
    lang.BinaryOp.BIT_XOR: "bit_xor",
    lang.BinaryOp.SHIFT_LEFT: "shift_left",
    lang.BinaryOp.SHIFT_RIGHT: "shift_right",
}
"""The functions of the runtime that are operators elsewhere."""
SHIFTS = (lang.BinaryOp.SHIFT_LEFT, lang.BinaryOp.SHIFT_RIGHT)


def number(value: lang.Value) -> str:
    """Return a constant as an operand: booleans and members of enumerations are numbers."""
    assert isinstance(value, int)
    return str(int(value)) if value >= 0 else f"({int(value)})"


def variable_names(chart: Chart) -> dict[str, str]:
    """Return the identifier of each variable of a chart."""
    variables = (*chart.data, *chart.outputs)
    return {each.name: f"v{n}_{legal(each.name)}" for n, each in enumerate(variables)}


@dataclass(frozen=True, slots=True)
class AwkExpressions(ExprPrinter):
    """Prints expressions of a chart with some variables.

    ``payload``: the position of each field of the current event.
    """

    names: Mapping[str, str]
    payload: Mapping[str, int]

    unary: ClassVar[Mapping[lang.UnaryOp, Operator]] = {
        **C_UNARY,
        lang.UnaryOp.NOT: prefix("!", 3, ATOM),  # awk reads `!a == b` as `!(a == b)`
    }

    def print(self, expr: lang.Expr) -> str:
        """Return an expression as an operand of any operator, of concatenation too."""
        return self.fragment(lowered(expr)).at_least(ATOM)

    def literal(self, expr: lang.Literal) -> Fragment:
        """Print a constant."""
        return Fragment(number(expr.value))

    def variable(self, expr: lang.Variable) -> Fragment:
        """Print a variable of the chart."""
        return Fragment(self.names[expr.name])

    def event_field(self, expr: lang.EventField) -> Fragment:
        """Print a field of the current event, whose words are in ``EVENT``."""
        return Fragment(f"EVENT[{self.payload[expr.name] + 2}]")

    def in_state(self, expr: lang.InState) -> Fragment:
        """Print a state test."""
        return Fragment(f"active({expr.state})")

    def prefixed(self, expr: lang.Unary) -> Fragment:
        """Print an operator of one operand; awk has no complement."""
        if expr.op is lang.UnaryOp.INVERT:
            return self._wrapped(f"-1 - {self.fragment(expr.operand).at_least(ATOM)}", expr)
        return self._wrapped(ExprPrinter.prefixed(self, expr), expr)

    def infix(self, expr: lang.Binary) -> Fragment:
        """Print an operator of two operands; awk lacks those of whole numbers and of bits."""
        found, name = ExprPrinter.infix(self, expr), CALLED.get(expr.op)
        if name is not None:
            left, right = self.fragment(expr.left).text, self.fragment(expr.right).text
            if expr.op in SHIFTS and (bits := count_width(expr)) is not None:
                right = f"wrapped({right}, 0, {bits - 1})"
            found = Fragment(f"{name}({left}, {right})")
        return self._wrapped(found, expr)

    def apply(self, expr: lang.Apply) -> Fragment:
        """Print ``min``, ``max`` or ``abs``."""
        first, *others = (self.fragment(each).text for each in expr.arguments)
        name = expr.function.value
        text = first if others else f"{name}({first})"
        for other in others:
            text = f"{name}({text}, {other})"
        return self._wrapped(Fragment(text), expr)

    def convert(self, expr: lang.Convert) -> Fragment:
        """Print how a number is brought into the range of a type."""
        how, inner = bounding(expr), self.fragment(expr.operand)
        if how is None:
            return inner
        return Fragment(f"{BOUNDING[how.overflow]}({inner.text}, {how.lo}, {how.hi})")

    def _wrapped(self, found: Fragment | str, expr: lang.Expr) -> Fragment:
        """Return a result, wrapped around where it can leave the range of its type."""
        fragment = Fragment(found, 0) if isinstance(found, str) else found
        bounds = wrapping_bounds(expr)
        if bounds is None:
            return fragment
        return Fragment(f"wrapped({fragment.text}, {bounds[0]}, {bounds[1]})")


class AwkStatements(StatementPrinter):
    """Prints the statements of one chart; an occurrence of an event is a string of words."""

    def __init__(self, chart: Chart, out: Emitter, payload: Mapping[str, int]) -> None:
        """Print to ``out``; ``payload``: the position of each field of the current event."""
        self.chart, self.out = chart, out
        self.expressions = AwkExpressions(variable_names(chart), payload)

    def block(self, block: stmt.Block) -> None:
        """Print a handler; a failure in it skips the rest of it (SCXML 4.1)."""
        if not can_end(block):
            self.statements(block)
            return
        with self.out.block("do {", "} while (0)"):
            self.statements(block)

    def test(self, condition: lang.Expr) -> str:
        """Return a condition; a failing one is false."""
        text = self.expressions.print(condition)
        return f"attempt({text}, 0)" if can_fail(condition) else text

    def _values(self, values: Iterable[lang.Expr]) -> list[str]:
        """Return operands; those that can fail are evaluated before the statement."""
        texts = [self.expressions.print(value) for value in values]
        if can_fail(tuple(values)):
            for place, text in enumerate(texts):
                self.out.line(f"X{place} = {text}")
            self.out.line("if (FAILED) { fail(); break }")
            texts = [f"X{place}" for place in range(len(texts))]
        return texts

    def occurrence(self, event: int, values: Iterable[str] = ()) -> str:
        """Return the words of an event: its number and its fields, omitted ones by default."""
        given = list(values)
        omitted = self.chart.events[event].fields[len(given) :]
        defaults = (number(lang.default_value(part.type)) for part in omitted)
        return ' " " '.join((f'"{event}"', *given, *defaults))

    def done(self, event: int, data: tuple[lang.Expr, ...]) -> str:
        """Return the words of a ``done.state`` event; a value that fails is the default."""
        texts = []
        for value, part in zip(data, self.chart.events[event].fields, strict=False):
            text = self.expressions.print(value)
            default = number(lang.default_value(part.type))
            texts.append(f"attempt({text}, {default})" if can_fail(value) else text)
        return self.occurrence(event, texts)

    def _assign(self, location: lang.Location, value: lang.Expr) -> None:
        (text,) = self._values((value,))
        self.out.line(f"{self.expressions.print(location)} = {text}")

    def _raise(self, event: int, arguments: tuple[lang.Expr, ...]) -> None:
        self.out.line(f"raise({self.occurrence(event, self._values(arguments))})")

    def _send(self, statement: stmt.Send) -> None:
        words = self.occurrence(statement.event, self._values(statement.arguments))
        route = f"{quoted(statement.destination.value)}, {words}, {quoted(statement.peer or '')}"
        if statement.delay is None:
            self.out.line(f"send({route})")
        else:
            ticks = self.expressions.print(statement.delay)
            self.out.line(f"delay({route}, {ticks}, {quoted(statement.id or '')})")

    def _cancel(self, name: str) -> None:
        self.out.line(f"cancel({quoted(name)})")

    def _log(self, label: str, values: tuple[lang.Expr, ...]) -> None:
        self.out.line("print " + ' " " '.join((quoted(f"log {label}"), *self._values(values))))

    def _if(self, statement: Choice) -> None:
        for branch in statement.branches:
            test = "1" if branch.condition is None else self.test(branch.condition)
            self.out.open(f"if ({test}) {{")
            self.statements(branch.body)
            self.out.turn("} else {")
        for _ in statement.branches:
            self.out.close("}")
