"""Arithmetic against an oracle that shares nothing with it: C's own integers, and fractions."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

import fsmkit.language as lang
from fsmkit.diagnostics import Findings
from tests.language.language import Machine, text, typed, values_of

C_TYPES = {
    lang.INT32: ctypes.c_int32,
    lang.UINT32: ctypes.c_uint32,
    lang.INT64: ctypes.c_int64,
    lang.UINT64: ctypes.c_uint64,
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
    lambda pair: lang.IntType(pair[0], pair[0] + pair[1])
)
INTEGER_TYPES = st.sampled_from(list(lang.MACHINE_INTEGERS.values())) | RANGES


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


def in_scope(**types: lang.Type) -> lang.Scope:
    return lang.Scope(variables={name: (type_, lang.Storage.DATA) for name, type_ in types.items()})


@given(st.sampled_from(OPERATORS), INTEGER_TYPES, INTEGER_TYPES, st.data())
def test_integer_operators_follow_c(
    op: str, left: lang.IntType, right: lang.IntType, data: st.DataObject
) -> None:
    x, y = data.draw(values_of(left)), data.draw(values_of(right))
    assert isinstance(x, int)
    assert isinstance(y, int)
    findings = Findings()
    expr = lang.type_expression(text(f"x {op} y"), in_scope(x=left, y=right), findings)
    if expr is None:  # no type holds both, or always a division by zero
        assert {d.rule.name for d in findings} <= {"integer-too-wide", "division-by-zero"}
        return
    machine = Machine({"x": x, "y": y})
    if op in "/%" and y == 0:
        with pytest.raises(lang.ContentError):
            lang.evaluate(expr, machine)
        return
    result = lang.evaluate(expr, machine)
    type_ = expr.type
    assert isinstance(type_, lang.IntType)
    width = 64 if type_ in (lang.INT64, lang.UINT64) else 32
    wanted = exactly(op, x, y, width)
    if type_.overflow is lang.Overflow.WRAP:
        assert type_ in C_TYPES
        wanted = C_TYPES[type_](wanted).value
    assert result == wanted
    assert isinstance(result, int)
    assert result in type_


def test_the_least_integer_by_minus_one_wraps() -> None:
    expr = typed("x / y", scope=in_scope(x=lang.INT64, y=lang.INT64))
    assert lang.evaluate(expr, Machine({"x": -(2**63), "y": -1})) == -(2**63)
    expr = typed("x % y", scope=in_scope(x=lang.INT64, y=lang.INT64))
    assert lang.evaluate(expr, Machine({"x": -(2**63), "y": -1})) == 0


def test_result_types_of_machine_integers() -> None:
    u8, i8 = lang.MACHINE_INTEGERS["uint8"], lang.MACHINE_INTEGERS["int8"]
    pairs = [
        (u8, u8, lang.INT32),
        (u8, i8, lang.INT32),
        (u8, lang.UINT32, lang.UINT32),
        (lang.INT32, lang.UINT32, lang.INT64),
        (lang.UINT32, lang.UINT64, lang.UINT64),
        (lang.IntType(0, 3), lang.UINT32, lang.UINT32),
        (lang.IntType(-1, 3), lang.UINT32, lang.INT64),
        (lang.IntType(0, 3, lang.Overflow.WRAP), lang.IntType(0, 3), lang.IntType(0, 6)),
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
    assert lang.evaluate(typed(source), Machine()) == value


def test_nan_compares_as_in_c() -> None:
    nan = "(0.0 / 0.0)"
    machine = Machine()
    assert math.isnan(float(str(lang.evaluate(typed(nan), machine))))
    assert lang.evaluate(typed(f"{nan} == {nan}"), machine) is False
    assert lang.evaluate(typed(f"{nan} != {nan}"), machine) is True
    assert lang.evaluate(typed(f"{nan} < 1.0"), machine) is False


@given(
    st.floats(),
    st.sampled_from(
        [lang.IntType(0, 9), lang.INT32, lang.UINT64, lang.IntType(-5, 5, lang.Overflow.WRAP)]
    ),
)
def test_a_float_becomes_an_integer(value: float, type_: lang.IntType) -> None:
    machine = Machine({"x": value})
    result = lang.evaluate(lang.convert(typed("x", scope=in_scope(x=lang.FLOAT32)), type_), machine)
    if math.isnan(value):
        assert result == 0
    else:
        wanted = min(max(value, type_.lo), type_.hi)
        assert result == (wanted if isinstance(wanted, int) else math.trunc(wanted))
    inside = math.isnan(value) or (
        not math.isinf(value) and type_.lo <= math.trunc(value) <= type_.hi
    )
    assert machine.saturated == (not inside and type_.overflow is lang.Overflow.SATURATE)


@given(st.integers(-(2**70), 2**70))
def test_an_integer_leaves_its_bounds(value: int) -> None:
    wide = lang.IntType(-(2**70), 2**70)
    machine = Machine({"x": value})
    variable = typed("x", scope=in_scope(x=wide))
    saturated = lang.evaluate(lang.convert(variable, lang.IntType(-5, 9)), machine)
    assert saturated == min(max(value, -5), 9)
    assert machine.saturated == (saturated != value)
    assert lang.evaluate(lang.convert(variable, lang.INT32), machine) == ctypes.c_int32(value).value
    ring = lang.evaluate(lang.convert(variable, lang.IntType(-5, 9, lang.Overflow.WRAP)), machine)
    assert isinstance(ring, int)
    assert -5 <= ring <= 9
    assert (ring - value) % 15 == 0
    fault = lang.convert(variable, lang.IntType(-5, 9, lang.Overflow.FAULT))
    if -5 <= value <= 9:
        assert lang.evaluate(fault, machine) == value
    else:
        with pytest.raises(lang.RangeFault):
            lang.evaluate(fault, machine)


@given(st.floats(allow_nan=False))
def test_float32_rounds_when_stored(value: float) -> None:
    expr = lang.convert(typed("x", scope=in_scope(x=lang.IntType(0, 0))), lang.FLOAT32)
    assert lang.evaluate(expr, Machine({"x": value})) == ctypes.c_float(value).value


@given(st.integers(0, lang.LONGEST_DURATION), st.integers(0, lang.LONGEST_DURATION))
def test_durations_stay_durations(x: int, y: int) -> None:
    machine = Machine({"delay": x})
    total = lang.evaluate(typed(f"delay + {y}ms"), machine)
    assert total == min(x + y, lang.LONGEST_DURATION)
    assert machine.saturated == (x + y > lang.LONGEST_DURATION)
    assert lang.evaluate(typed(f"delay - {y}ms"), Machine({"delay": x})) == max(x - y, 0)
    assert lang.BinaryOp.DIV is typed_op("delay / 1ms")


def typed_op(source: str) -> lang.BinaryOp:
    expr = typed(source)
    assert isinstance(expr, lang.Binary)
    return expr.op
