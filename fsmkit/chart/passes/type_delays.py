"""Type the delay of a sent event: a duration, or a number that is joined with a unit.

Only the loose dialects join them, as in ``t + 'ms'``. At run time the number is multiplied, so no
string exists. A result that would be no delay (SCXML 6.2.4, CSS2 4.3.10) fails a check.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from fsmkit.chart.passes.context import Context
from fsmkit.diagnostics import Findings, Text
from fsmkit.language import (
    BOOL,
    DURATION,
    FLOAT64,
    LONGEST_DURATION,
    Binary,
    BinaryOp,
    Conditional,
    Convert,
    Expr,
    FloatType,
    IntType,
    Literal,
    Overflow,
    convert,
    fold,
    read_duration,
    type_expression,
)
from fsmkit.language.names import Context as Place
from fsmkit.language.operators import type_binary
from fsmkit.language.statements.tree import DocSend
from fsmkit.language.syntax import (
    BinaryNode,
    CallNode,
    ConditionalNode,
    MemberNode,
    NameNode,
    Node,
    StringNode,
    SyntaxFault,
    parse,
)
from fsmkit.language.units import MICROSECONDS
from fsmkit.language.walk import calls

TICKS = IntType(0, LONGEST_DURATION, Overflow.SATURATE)


@dataclass(frozen=True, slots=True)
class Delay:
    """A delay of type duration, None for none, and the condition under which it is one."""

    ticks: Expr | None
    check: Expr | None = None


NO_DELAY = Delay(None)


def type_delay(written: DocSend, context: Context) -> Delay:
    """Return the delay of a send; what is wrong is in the findings."""
    findings = context.findings
    if written.delay is not None:
        return _constant(written.delay, context)
    if written.delay_expr is None:
        return NO_DELAY
    joined = _joined(written.delay_expr, context) if context.is_loose else None
    if joined is not None:
        return joined
    value = type_expression(written.delay_expr, context.scope, findings)
    folded = None if value is None else fold(value)
    if isinstance(folded, Literal) and isinstance(folded.value, str):
        return _constant(Text(folded.value, written.delay_expr.span, ()), context)
    return Delay(type_expression(written.delay_expr, context.scope, findings, DURATION))


def _constant(text: Text, context: Context) -> Delay:
    ticks = read_duration(text, context.scope, context.findings)
    return Delay(Literal(ticks, DURATION, text.span)) if ticks else NO_DELAY


def _joined(text: Text, context: Context) -> Delay | None:
    """Return the delay that an expression joins of a number and a unit; None for any other."""
    try:
        node = parse(text.value)
    except SyntaxFault:
        return None
    return _delay_of(node, text, context)


def _delay_of(node: Node, text: Text, context: Context) -> Delay | None:
    match node:
        case ConditionalNode(test=test, then=then, otherwise=otherwise):
            held = _typed(test, text, context)
            sides = [_side(each, text, context) for each in (then, otherwise)]
            if held is None or held.type != BOOL or calls(held):
                return None
            first, second = sides
            if first is None or second is None:
                return None
            return _either(held, first, second)
        case BinaryNode(op="+", left=left, right=StringNode(value=unit)):
            micros = MICROSECONDS.get(unit.strip())
            number = None if micros is None else _number(left, text, context)
            if micros is None or number is None or calls(number):
                return None
            folded = fold(number)
            if isinstance(folded, Literal):
                return _constant(Text(f"{folded.value}{unit}", text.span, ()), context)
            return _scaled(number, Fraction(micros, context.scope.tick), context)
        case _:
            return None


def _side(node: Node, text: Text, context: Context) -> Delay | None:
    """Return one side of a condition, which may be a constant."""
    if isinstance(node, StringNode):
        found = _constant(Text(node.value, text.span, ()), context)
        zero = Literal(0, DURATION, text.span)
        return found if found.ticks is not None else Delay(zero)
    return _delay_of(node, text, context)


def _either(test: Expr, first: Delay, second: Delay) -> Delay | None:
    if first.ticks is None or second.ticks is None:
        return None
    ticks = Conditional(test, first.ticks, second.ticks, DURATION, test.span)
    if first.check is None and second.check is None:
        return Delay(ticks)
    always = Literal(True, BOOL, test.span)
    checks = [always if each.check is None else each.check for each in (first, second)]
    return Delay(ticks, Conditional(test, checks[0], checks[1], BOOL, test.span))


def _number(node: Node, text: Text, context: Context) -> Expr | None:
    """Return the number that a node joins as a string; None if it joins anything else."""
    match node:
        case BinaryNode(op="+", left=StringNode(value=""), right=inner):
            return _number(inner, text, context)
        case CallNode(callee=NameNode(name="String"), arguments=(inner,)):
            return _number(inner, text, context)
        case CallNode(callee=MemberNode(base=inner, name="toString"), arguments=()):
            return _number(inner, text, context)
        case _:
            found = _typed(node, text, context)
            is_number = found is not None and isinstance(found.type, IntType | FloatType)
            return found if is_number else None


def _typed(node: Node, text: Text, context: Context) -> Expr | None:
    """Return a part of an expression, typed without a finding; None where it has no value."""
    part = text.part(node.start, node.end)
    findings = Findings()
    found = type_expression(part, context.scope, findings)
    return None if findings.has_errors else found


def _scaled(number: Expr, unit: Fraction, context: Context) -> Delay | None:
    """Return so many units of some ticks each; a part of a tick fails, of a float it is rounded."""
    place = Place(context.scope, context.findings)
    span = number.span
    tick = Literal(1, DURATION, span)

    def whole(value: int) -> Literal:
        return Literal(value, IntType(value, value), span)

    def join(op: BinaryOp, left: Expr | None, right: Expr | None) -> Expr | None:
        return None if left is None or right is None else type_binary(place, op, left, right, span)

    if isinstance(number.type, FloatType):
        exact = Binary(
            BinaryOp.MUL,
            convert(number, FLOAT64),
            Literal(float(unit), FLOAT64, span),
            FLOAT64,
            span,
        )
        half = Literal(0.5, FLOAT64, span)
        rounded = Convert(Binary(BinaryOp.ADD, exact, half, FLOAT64, span), TICKS, span)
        least, most = (Literal(x, FLOAT64, span) for x in (0.0, float(LONGEST_DURATION)))
        check = join(BinaryOp.AND, join(BinaryOp.GE, exact, least), join(BinaryOp.LE, exact, most))
        return Delay(join(BinaryOp.MUL, rounded, tick), check)
    assert isinstance(number.type, IntType)  # noqa: S101  (see `_number`)
    tests = []
    longest = LONGEST_DURATION * unit.denominator // unit.numerator
    if number.type.lo < 0:
        tests.append(join(BinaryOp.GE, number, whole(0)))
    if number.type.hi > longest:
        tests.append(join(BinaryOp.LE, number, whole(longest)))
    count: Expr | None = number
    if unit.denominator > 1:
        remainder = join(BinaryOp.REM, number, whole(unit.denominator))
        tests.append(join(BinaryOp.EQ, remainder, whole(0)))
        count = Binary(BinaryOp.DIV, number, whole(unit.denominator), number.type, span)
    check = None
    for test in tests:
        check = test if check is None else join(BinaryOp.AND, check, test)
    return Delay(join(BinaryOp.MUL, count, Literal(unit.numerator, DURATION, span)), check)
