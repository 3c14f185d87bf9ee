"""Type the delay of a sent event: a duration, or a number that is joined with a unit.

Only the loose dialects join them, as in ``t + 'ms'``. At run time the number is multiplied, so no
string exists. A result that would be no delay (SCXML 6.2.4, CSS2 4.3.10) fails a check.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import fsmkit.language as lang
from fsmkit.chart.passes.context import Context
from fsmkit.diagnostics import Findings, Text
from fsmkit.language import syntax
from fsmkit.language.names import Context as Place
from fsmkit.language.operators import type_binary
from fsmkit.language.statements.tree import DocSend
from fsmkit.language.units import MICROSECONDS
from fsmkit.language.walk import calls

TICKS = lang.IntType(0, lang.LONGEST_DURATION, lang.Overflow.SATURATE)


@dataclass(frozen=True, slots=True)
class Delay:
    """A delay of type duration, None for none, and the condition under which it is one."""

    ticks: lang.Expr | None
    check: lang.Expr | None = None


NO_DELAY = Delay(None)


def type_delay(written: DocSend, context: Context) -> Delay:
    """Return the delay of a send; report errors in it."""
    findings = context.findings
    if written.delay is not None:
        return _constant(written.delay, context)
    if written.delay_expr is None:
        return NO_DELAY
    joined = _joined(written.delay_expr, context) if context.is_loose else None
    if joined is not None:
        return joined
    value = lang.type_expression(written.delay_expr, context.scope, findings)
    folded = None if value is None else lang.fold(value)
    if isinstance(folded, lang.Literal) and isinstance(folded.value, str):
        return _constant(Text(folded.value, written.delay_expr.span, ()), context)
    return Delay(lang.type_expression(written.delay_expr, context.scope, findings, lang.DURATION))


def _constant(text: Text, context: Context) -> Delay:
    ticks = lang.read_duration(text, context.scope, context.findings)
    return Delay(lang.Literal(ticks, lang.DURATION, text.span)) if ticks else NO_DELAY


def _joined(text: Text, context: Context) -> Delay | None:
    """Return the delay that an expression joins of a number and a unit; None for any other."""
    try:
        node = syntax.parse(text.value)
    except syntax.SyntaxFault:
        return None
    return _delay_of(node, text, context)


def _delay_of(node: syntax.Node, text: Text, context: Context) -> Delay | None:
    match node:
        case syntax.ConditionalNode(test=test, then=then, otherwise=otherwise):
            held = _typed(test, text, context)
            sides = [_side(each, text, context) for each in (then, otherwise)]
            if held is None or held.type != lang.BOOL or calls(held):
                return None
            first, second = sides
            if first is None or second is None:
                return None
            return _either(held, first, second)
        case syntax.BinaryNode(op="+", left=left, right=syntax.StringNode(value=unit)):
            micros = MICROSECONDS.get(unit.strip())
            number = None if micros is None else _number(left, text, context)
            if micros is None or number is None or calls(number):
                return None
            folded = lang.fold(number)
            if isinstance(folded, lang.Literal):
                return _constant(Text(f"{folded.value}{unit}", text.span, ()), context)
            return _scaled(number, Fraction(micros, context.scope.tick), context)
        case _:
            return None


def _side(node: syntax.Node, text: Text, context: Context) -> Delay | None:
    """Return one side of a condition, which may be a constant."""
    if isinstance(node, syntax.StringNode):
        found = _constant(Text(node.value, text.span, ()), context)
        zero = lang.Literal(0, lang.DURATION, text.span)
        return found if found.ticks is not None else Delay(zero)
    return _delay_of(node, text, context)


def _either(test: lang.Expr, first: Delay, second: Delay) -> Delay | None:
    if first.ticks is None or second.ticks is None:
        return None
    ticks = lang.Conditional(test, first.ticks, second.ticks, lang.DURATION, test.span)
    if first.check is None and second.check is None:
        return Delay(ticks)
    always = lang.Literal(True, lang.BOOL, test.span)
    checks = [always if each.check is None else each.check for each in (first, second)]
    return Delay(ticks, lang.Conditional(test, checks[0], checks[1], lang.BOOL, test.span))


def _number(node: syntax.Node, text: Text, context: Context) -> lang.Expr | None:
    """Return the number that a node joins as a string; None if it joins anything else."""
    match node:
        case syntax.BinaryNode(op="+", left=syntax.StringNode(value=""), right=inner):
            return _number(inner, text, context)
        case syntax.CallNode(callee=syntax.NameNode(name="String"), arguments=(inner,)):
            return _number(inner, text, context)
        case syntax.CallNode(callee=syntax.MemberNode(base=inner, name="toString"), arguments=()):
            return _number(inner, text, context)
        case _:
            found = _typed(node, text, context)
            is_number = found is not None and isinstance(found.type, lang.IntType | lang.FloatType)
            return found if is_number else None


def _typed(node: syntax.Node, text: Text, context: Context) -> lang.Expr | None:
    """Return a typed part of an expression, or None; report nothing."""
    part = text.part(node.start, node.end)
    findings = Findings()
    found = lang.type_expression(part, context.scope, findings)
    return None if findings.has_errors else found


def _scaled(number: lang.Expr, unit: Fraction, context: Context) -> Delay | None:
    """Return so many units of some ticks each; a part of a tick fails, of a float it is rounded."""
    place = Place(context.scope, context.findings)
    span = number.span
    tick = lang.Literal(1, lang.DURATION, span)

    def whole(value: int) -> lang.Literal:
        return lang.Literal(value, lang.IntType(value, value), span)

    def join(
        op: lang.BinaryOp, left: lang.Expr | None, right: lang.Expr | None
    ) -> lang.Expr | None:
        return None if left is None or right is None else type_binary(place, op, left, right, span)

    if isinstance(number.type, lang.FloatType):
        exact = lang.Binary(
            lang.BinaryOp.MUL,
            lang.convert(number, lang.FLOAT64),
            lang.Literal(float(unit), lang.FLOAT64, span),
            lang.FLOAT64,
            span,
        )
        half = lang.Literal(0.5, lang.FLOAT64, span)
        rounded = lang.Convert(
            lang.Binary(lang.BinaryOp.ADD, exact, half, lang.FLOAT64, span), TICKS, span
        )
        least, most = (
            lang.Literal(x, lang.FLOAT64, span) for x in (0.0, float(lang.LONGEST_DURATION))
        )
        check = join(
            lang.BinaryOp.AND,
            join(lang.BinaryOp.GE, exact, least),
            join(lang.BinaryOp.LE, exact, most),
        )
        return Delay(join(lang.BinaryOp.MUL, rounded, tick), check)
    assert isinstance(number.type, lang.IntType)  # noqa: S101  (see `_number`)
    tests = []
    longest = lang.LONGEST_DURATION * unit.denominator // unit.numerator
    if number.type.lo < 0:
        tests.append(join(lang.BinaryOp.GE, number, whole(0)))
    if number.type.hi > longest:
        tests.append(join(lang.BinaryOp.LE, number, whole(longest)))
    count: lang.Expr | None = number
    if unit.denominator > 1:
        remainder = join(lang.BinaryOp.REM, number, whole(unit.denominator))
        tests.append(join(lang.BinaryOp.EQ, remainder, whole(0)))
        count = lang.Binary(lang.BinaryOp.DIV, number, whole(unit.denominator), number.type, span)
    check = None
    for test in tests:
        check = test if check is None else join(lang.BinaryOp.AND, check, test)
    return Delay(
        join(lang.BinaryOp.MUL, count, lang.Literal(unit.numerator, lang.DURATION, span)), check
    )
