"""What holds of every expression, however it is written."""

from __future__ import annotations

import math

import pytest
from hypothesis import HealthCheck, assume, given, settings

import fsmkit.language as lang
from tests.language.language import CONSTANTS, EXPRESSIONS, Machine, attempted, machines, typed

SLOW = settings(
    max_examples=150, suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow]
)


def belongs(value: lang.Value, type_: lang.Type | None) -> bool:
    match type_:
        case lang.BoolType():
            return isinstance(value, bool)
        case lang.IntType(lo, hi):
            return type(value) is int and lo <= value <= hi
        case lang.FloatType():
            return isinstance(value, float)
        case lang.EnumType(_, members):
            return isinstance(value, int) and 0 <= value < len(members)
        case lang.DurationType():
            return isinstance(value, int) and 0 <= value <= lang.LONGEST_DURATION
        case _:
            return True


def outcome(machine: Machine, expr: lang.Expr) -> tuple[object, ...]:
    try:
        value: object = lang.evaluate(expr, machine)
    except lang.ContentError:
        value = "content error"
    if isinstance(value, float) and math.isnan(value):
        value = "nan"
    return value, machine.calls, machine.saturated


@pytest.mark.slow
@SLOW
@given(EXPRESSIONS, machines())
def test_a_value_lies_in_the_type_of_its_expression(source: str, machine: Machine) -> None:
    expr = attempted(source)
    assume(expr is not None)
    assert expr is not None
    try:
        value = lang.evaluate(expr, machine)
    except lang.ContentError:
        return
    assert belongs(value, expr.type), (source, value, str(expr.type))


@SLOW
@given(EXPRESSIONS)
def test_what_is_printed_reads_back_equal(source: str) -> None:
    expr = attempted(source)
    assume(expr is not None)
    assert expr is not None
    printed = lang.format_expression(expr)
    assert typed(printed) == expr, printed


@pytest.mark.slow
@SLOW
@given(EXPRESSIONS, machines())
def test_folding_changes_nothing_that_can_be_noticed(source: str, machine: Machine) -> None:
    expr = attempted(source)
    assume(expr is not None)
    assert expr is not None
    twin = Machine(machine.values, machine.active, machine.fields, machine.result)
    assert outcome(machine, expr) == outcome(twin, lang.fold(expr))


@SLOW
@given(CONSTANTS)
def test_what_is_constant_is_folded(source: str) -> None:
    expr = attempted(source)
    assume(expr is not None)
    assert expr is not None
    folded = lang.fold(expr)
    try:
        value = lang.evaluate(expr, Machine())
    except lang.ContentError:
        assert not isinstance(folded, lang.Literal)
    else:
        assert isinstance(folded, lang.Literal)
        assert folded.value == value or value != value
