"""Arithmetic against an oracle that shares nothing with it: C's own integers, and fractions."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fsmkit.diagnostics import Findings
from fsmkit.language import (
    FLOAT32,
    INT32,
    INT64,
    LONGEST_DURATION,
    MACHINE_INTEGERS,
    UINT32,
    UINT64,
    Binary,
    BinaryOp,
    ContentError,
    IntType,
    Overflow,
    RangeFault,
    Scope,
    Storage,
    Type,
    convert,
    evaluate,
    type_expression,
)
from tests.language.language import Machine, text, typed, values_of

C_TYPES = {
    INT32: ctypes.c_int32,
    UINT32: ctypes.c_uint32,
    INT64: ctypes.c_int64,
    UINT64: ctypes.c_uint64,
}
OPERATORS = ["+", "-", "*", "/", "%", "&", "|", "^", "<<", ">>"]
PLAIN: dict[str, Callable[[int, int], int]] = {
    "+": int.__add__,
    "-": int.__sub__,
    "*": int.__mul__,
    "&": int.__and__,
    "|": int.__or__,
    "^": int.__xor__,
}
RANGES = st.tuples(st.integers(-300, 300), st.integers(0, 300)).map(
    lambda pair: IntType(pair[0], pair[0] + pair[1])
)
INTEGER_TYPES = st.sampled_from(list(MACHINE_INTEGERS.values())) | RANGES


def exactly(op: str, a: int, b: int, width: int) -> int:
    """Return the mathematical result, by fractions and powers."""
    match op:
        case "/":
            return math.trunc(Fraction(a, b))
        case "%":
            return a - b * math.trunc(Fraction(a, b))
        case "<<":
            return a * (1 << (b % width))
        case ">>":
            return math.floor(Fraction(a, 2 ** (b % width)))
        case _:
            return PLAIN[op](a, b)


def in_scope(**types: Type) -> Scope:
    return Scope(variables={name: (type_, Storage.DATA) for name, type_ in types.items()})


@given(st.sampled_from(OPERATORS), INTEGER_TYPES, INTEGER_TYPES, st.data())
def test_integer_operators_follow_c(
    op: str, left: IntType, right: IntType, data: st.DataObject
) -> None:
    x, y = data.draw(values_of(left)), data.draw(values_of(right))
    assert isinstance(x, int)
    assert isinstance(y, int)
    findings = Findings()
    expr = type_expression(text(f"x {op} y"), in_scope(x=left, y=right), findings)
    if expr is None:  # no type holds both, or always a division by zero
        assert {d.rule.name for d in findings} <= {"integer-too-wide", "division-by-zero"}
        return
    machine = Machine({"x": x, "y": y})
    if op in "/%" and y == 0:
        with pytest.raises(ContentError):
            evaluate(expr, machine)
        return
    result = evaluate(expr, machine)
    type_ = expr.type
    assert isinstance(type_, IntType)
    width = 64 if type_ in (INT64, UINT64) else 32
    wanted = exactly(op, x, y, width)
    if type_.overflow is Overflow.WRAP:
        assert type_ in C_TYPES
        wanted = C_TYPES[type_](wanted).value
    assert result == wanted
    assert isinstance(result, int)
    assert result in type_


def test_the_least_integer_by_minus_one_wraps() -> None:
    expr = typed("x / y", scope=in_scope(x=INT64, y=INT64))
    assert evaluate(expr, Machine({"x": -(2**63), "y": -1})) == -(2**63)
    expr = typed("x % y", scope=in_scope(x=INT64, y=INT64))
    assert evaluate(expr, Machine({"x": -(2**63), "y": -1})) == 0


def test_result_types_of_machine_integers() -> None:
    u8, i8 = MACHINE_INTEGERS["uint8"], MACHINE_INTEGERS["int8"]
    pairs = [
        (u8, u8, INT32),
        (u8, i8, INT32),
        (u8, UINT32, UINT32),
        (INT32, UINT32, INT64),
        (UINT32, UINT64, UINT64),
        (IntType(0, 3), UINT32, UINT32),
        (IntType(-1, 3), UINT32, INT64),
        (IntType(0, 3, Overflow.WRAP), IntType(0, 3), IntType(0, 6)),
    ]
    for left, right, result in pairs:
        assert typed("x + y", scope=in_scope(x=left, y=right)).type == result


@pytest.mark.parametrize(
    ("source", "value"),
    [
        ("1.0 / 0.0", math.inf),
        ("-1.0 / 0.0", -math.inf),
        ("1.0 / -0.0", -math.inf),
        ("1e308 * 10.0", math.inf),
        ("7 / 2", 3),
        ("-7 / 2", -3),
        ("-7 % 2", -1),
        ("7 / 2.0", 3.5),
        ("0x1F & ~1", 30),
        ("1 << 3 | 1", 9),
        ("max(1, 2.5)", 2.5),
        ("abs(-3)", 3),
        ("min(3, -1, 2)", -1),
    ],
)
def test_constants(source: str, value: float) -> None:
    assert evaluate(typed(source), Machine()) == value


def test_nan_compares_as_in_c() -> None:
    nan = "(0.0 / 0.0)"
    machine = Machine()
    assert math.isnan(float(str(evaluate(typed(nan), machine))))
    assert evaluate(typed(f"{nan} == {nan}"), machine) is False
    assert evaluate(typed(f"{nan} != {nan}"), machine) is True
    assert evaluate(typed(f"{nan} < 1.0"), machine) is False


@given(st.floats(), st.sampled_from([IntType(0, 9), INT32, UINT64, IntType(-5, 5, Overflow.WRAP)]))
def test_a_float_becomes_an_integer(value: float, type_: IntType) -> None:
    machine = Machine({"x": value})
    result = evaluate(convert(typed("x", scope=in_scope(x=FLOAT32)), type_), machine)
    if math.isnan(value):
        assert result == 0
    else:
        wanted = min(max(value, type_.lo), type_.hi)
        assert result == (wanted if isinstance(wanted, int) else math.trunc(wanted))
    inside = math.isnan(value) or (
        not math.isinf(value) and type_.lo <= math.trunc(value) <= type_.hi
    )
    assert machine.saturated == (not inside and type_.overflow is Overflow.SATURATE)


@given(st.integers(-(2**70), 2**70))
def test_an_integer_leaves_its_bounds(value: int) -> None:
    wide = IntType(-(2**70), 2**70)
    machine = Machine({"x": value})
    variable = typed("x", scope=in_scope(x=wide))
    saturated = evaluate(convert(variable, IntType(-5, 9)), machine)
    assert saturated == min(max(value, -5), 9)
    assert machine.saturated == (saturated != value)
    assert evaluate(convert(variable, INT32), machine) == ctypes.c_int32(value).value
    ring = evaluate(convert(variable, IntType(-5, 9, Overflow.WRAP)), machine)
    assert isinstance(ring, int)
    assert -5 <= ring <= 9
    assert (ring - value) % 15 == 0
    fault = convert(variable, IntType(-5, 9, Overflow.FAULT))
    if -5 <= value <= 9:
        assert evaluate(fault, machine) == value
    else:
        with pytest.raises(RangeFault):
            evaluate(fault, machine)


@given(st.floats(allow_nan=False))
def test_float32_rounds_when_stored(value: float) -> None:
    expr = convert(typed("x", scope=in_scope(x=IntType(0, 0))), FLOAT32)
    assert evaluate(expr, Machine({"x": value})) == ctypes.c_float(value).value


@given(st.integers(0, LONGEST_DURATION), st.integers(0, LONGEST_DURATION))
def test_durations_stay_durations(x: int, y: int) -> None:
    machine = Machine({"delay": x})
    total = evaluate(typed(f"delay + {y}ms"), machine)
    assert total == min(x + y, LONGEST_DURATION)
    assert machine.saturated == (x + y > LONGEST_DURATION)
    assert evaluate(typed(f"delay - {y}ms"), Machine({"delay": x})) == max(x - y, 0)
    assert BinaryOp.DIV is typed_op("delay / 1ms")


def typed_op(source: str) -> BinaryOp:
    expr = typed(source)
    assert isinstance(expr, Binary)
    return expr.op
