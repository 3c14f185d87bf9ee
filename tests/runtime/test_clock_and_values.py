from __future__ import annotations

import pytest

import fsmkit.language as lang
from fsmkit.language.units import duration_text, read_microseconds
from fsmkit.language.values import from_python, read_value, show, to_python, tokens
from fsmkit.runtime.clock import SimulatedClock
from fsmkit.runtime.interpreter.trace import value_text

MODE = lang.EnumType("Mode", ("off", "on"))
PAIR = lang.RecordType("Pair", (lang.Field("a", lang.IntType(0, 9)), lang.Field("m", MODE)))


@pytest.mark.parametrize(
    ("text", "microseconds"),
    [("500ms", 500_000), ("2s", 2_000_000), (".5s", 500_000), ("1.5s", 1_500_000), ("7us", 7)],
)
def test_durations(text: str, microseconds: int) -> None:
    assert read_microseconds(text) == microseconds
    assert read_microseconds(duration_text(microseconds)) == microseconds


@pytest.mark.parametrize("text", ["", "5", "5 parsecs", "-1s", "0.1us", "1s2ms"])
def test_what_is_no_duration(text: str) -> None:
    with pytest.raises(ValueError, match=r"duration|finer"):
        read_microseconds(text)


def test_simulated_time_does_not_go_back() -> None:
    clock = SimulatedClock()
    clock.advance(5)
    with pytest.raises(ValueError, match="back"):
        clock.advance(-1)
    assert clock.microseconds() == 5


@pytest.mark.parametrize(
    ("type_", "text", "value"),
    [
        (lang.BOOL, "true", True),
        (lang.BOOL, "0", False),
        (lang.IntType(-5, 5), "-5", -5),
        (lang.IntType(0, 255), "0x10", 16),
        (lang.FLOAT64, "-2.5", -2.5),
        (lang.FLOAT64, "3", 3.0),
        (MODE, "on", 1),
        (MODE, "Mode.on", 1),
        (MODE, "1", 1),
        (lang.DURATION, "15", 15),
        (lang.DURATION, "15ms", 15),
        (lang.SYMBOL, '"a b"', "a b"),
        (lang.ArrayType(lang.IntType(0, 9), 2), "[ 1 2 ]", (1, 2)),
        (lang.ArrayType(lang.IntType(0, 9), 2), "[1, 2]", (1, 2)),
        (PAIR, "[3 on]", (3, 1)),
    ],
)
def test_reading_and_writing(type_: lang.Type, text: str, value: lang.Value) -> None:
    read = read_value(iter(tokens(text)), type_, 1000)
    assert read == value
    assert type(read) is type(value)
    assert read_value(iter(tokens(value_text(value))), type_, 1000) == value
    assert read_value(iter(tokens(show(value, type_))), type_, 1000) == value
    assert from_python(to_python(value, type_), type_) == value


@pytest.mark.parametrize(
    ("type_", "text", "reason"),
    [
        (lang.BOOL, "2", "neither"),
        (lang.IntType(0, 3), "4", "outside"),
        (lang.IntType(0, 3), "x", "not a valid number"),
        (lang.FLOAT64, "x", "not a valid number"),
        (MODE, "maybe", "off, on"),
        (MODE, "2", "not a member"),
        (lang.DURATION, "15us", "whole number of ticks"),
        (lang.ArrayType(lang.BOOL, 2), "1 0", "write its values"),
        (lang.ArrayType(lang.BOOL, 2), "[1", "needs a value"),
        (lang.ArrayType(lang.BOOL, 2), "[1 0 1]", "holds 2 values"),
        (lang.BOOL, "", "needs a value"),
    ],
)
def test_what_is_no_value(type_: lang.Type, text: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        read_value(iter(tokens(text)), type_, 1000)


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.1, "0.10000000000000001"), (1e20, "1e+20"), (2.0, "2"), ((True, 3), "[1 3]")],
)
def test_values_in_traces_are_spelt_as_c_does(value: lang.Value, text: str) -> None:
    assert value_text(value) == text
