"""The helpers copied into generated modules mean what the reference evaluation means."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fsmkit.language import BinaryOp, IntType, Overflow
from fsmkit.language.arithmetic import compute, exact
from fsmkit.language.conversion import bring_within, round_float
from fsmkit.runtime.python import arithmetic

INTEGERS = st.integers(-(2**64), 2**64)
FLOATS = st.floats(allow_nan=True, allow_infinity=True)


@given(INTEGERS, INTEGERS.filter(bool))
def test_division_truncates(a: int, b: int) -> None:
    any_type = exact(0, 0)
    assert arithmetic.divide(a, b) == compute(BinaryOp.DIV, a, b, any_type)
    assert arithmetic.remainder(a, b) == compute(BinaryOp.REM, a, b, any_type)


def test_division_by_zero_is_a_content_error() -> None:
    for function in (arithmetic.divide, arithmetic.remainder):
        with pytest.raises(arithmetic.ContentError):
            function(1, 0)


@given(FLOATS)
def test_binary32_is_rounded_alike(value: float) -> None:
    assert repr(arithmetic.single(value)) == repr(round_float(value, 32))


@given(FLOATS, st.integers(-1000, 1000), st.integers(0, 1000))
def test_floats_become_integers_alike(value: float, lo: int, size: int) -> None:
    expected, is_outside = bring_within(value, IntType(lo, lo + size, Overflow.SATURATE))
    number = arithmetic.truncate(value, lo, lo + size)
    assert min(max(number, lo), lo + size) == expected
    assert (not lo <= number <= lo + size) == is_outside


@pytest.mark.parametrize(("a", "b"), [(1.0, 0.0), (-1.0, 0.0), (1.0, -0.0), (0.0, 0.0)])
def test_floats_divide_by_zero_as_ieee_754_has_it(a: float, b: float) -> None:
    quotient = arithmetic.divide_floats(a, b)
    if a == 0:
        assert math.isnan(quotient)
    else:
        assert quotient == math.copysign(math.inf, a) * math.copysign(1, b)


def test_parts_are_copied_not_shared() -> None:
    old: list[object] = [0, [1, 2]]
    arithmetic.replace(old, (3, (4, 5)))
    assert old == [3, [4, 5]]
    kept = arithmetic.frozen(old)
    arithmetic.replace(old, (0, (0, 0)))
    assert kept == (3, (4, 5))


def test_values_are_spelled_as_in_traces() -> None:
    assert arithmetic.shown((True, -3, 0.1, "a")) == '[1 -3 0.10000000000000001 "a"]'
