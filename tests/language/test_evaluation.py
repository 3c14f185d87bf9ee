"""Reading, storing and defaults, beside arithmetic."""

from __future__ import annotations

import pytest

import fsmkit.language as lang
from fsmkit.diagnostics import Findings
from tests.language.language import FAULT, NOWHERE, POINT, SCOPE, UINT8, Machine, text, typed

MACHINE = Machine(
    {"a": 3, "flag": True, "array": (5, 6, 7, 8), "point": (4, 0.5), "code": 1, "mode": "auto"},
    frozenset({2, 4}),
    {"code": 2, "n": 1},
)


@pytest.mark.parametrize(
    ("source", "value"),
    [
        ("array[a]", 8),
        ("len(array) + array.length", 8),
        ("point.x", 4),
        ("event.code == jam", True),
        ("_event.data.n", 1),
        ("_event.name == 'arrived'", True),
        ("In('a-b.c') and In('if')", True),
        ("In(S.main) || In(idle)", False),
        ("code == lost && mode == 'auto'", True),
        ("a if flag else 9", 3),
        ("flag ? lost == code : false", True),
        ("not a == 3", False),
        ("False || True", True),
        ("0x1f + 0b11 + 0o17", 49),
        ('"\\u0041\\n\'" == "A\\n\\\'"', True),
    ],
)
def test_values(source: str, value: lang.Value) -> None:
    assert lang.evaluate(typed(source), MACHINE) == value


def test_only_what_is_needed_is_evaluated() -> None:
    machine = Machine({"flag": False, "array": (0,) * 4, "a": 9})
    assert lang.evaluate(typed("flag and at_limit()"), machine) is False
    assert lang.evaluate(typed("!flag or array[a] == 0"), machine) is True
    assert lang.evaluate(typed("flag ? array[a] : 1"), machine) == 1
    assert machine.calls == []


def test_content_errors() -> None:
    machine = Machine({"a": 9, "array": (0,) * 4, "b": 0})
    for source in ("array[a]", "a / b", "a % b", "array[b - 1]"):
        with pytest.raises(lang.ContentError):
            lang.evaluate(typed(source), machine)
    with pytest.raises(lang.ContentError, match="why"):
        lang.evaluate(lang.Invalid("why", lang.BOOL, NOWHERE), machine)


def test_arguments_are_converted_before_the_call() -> None:
    machine = Machine({"b": -5})
    findings = Findings()
    from fsmkit.language import type_call

    call = type_call(text("goto(b, jam)"), SCOPE, findings)
    assert call is not None
    machine.result = None
    lang.evaluate(call, machine)
    assert machine.calls == [("goto", (0, 2))]
    assert machine.saturated == 1


@pytest.mark.parametrize(
    ("location", "old", "value", "new"),
    [
        ("a", 1, 2, 2),
        ("array[0]", (1, 2, 3, 4), 9, (9, 2, 3, 4)),
        ("array[a]", (1, 2, 3, 4), 9, (1, 2, 3, 9)),
        ("point.y", (1, 0.0), 2.5, (1, 2.5)),
    ],
)
def test_store(location: str, old: lang.Value, value: lang.Value, new: lang.Value) -> None:
    found = lang.type_location(text(location), SCOPE, Findings())
    assert found is not None
    assert lang.store(old, found, value, MACHINE) == new


def test_storing_outside_an_array_is_a_content_error() -> None:
    found = lang.type_location(text("array[a]"), SCOPE, Findings())
    assert found is not None
    with pytest.raises(lang.ContentError):
        lang.store((0,) * 4, found, 1, Machine({"a": 4}))


@pytest.mark.parametrize(
    ("type_", "value"),
    [
        (lang.BOOL, False),
        (lang.IntType(-3, 3), 0),
        (lang.IntType(2, 5), 2),
        (lang.IntType(-5, -2), -2),
        (lang.FLOAT64, 0.0),
        (FAULT, 0),
        (lang.SYMBOL, ""),
        (lang.DURATION, 0),
        (lang.ArrayType(UINT8, 3), (0, 0, 0)),
        (POINT, (0, 0.0)),
    ],
)
def test_default_values(type_: lang.Type, value: lang.Value) -> None:
    assert lang.default_value(type_) == value


def test_constants_fit_what_is_expected() -> None:
    cases: list[tuple[str, lang.Type, lang.Value]] = [
        ("3", lang.IntType(0, 9), 3),
        ("3", lang.FLOAT64, 3.0),
        ("jam", FAULT, 2),
        ("1", lang.ArrayType(UINT8, 3), (1, 1, 1)),
        ("[1, 2, 3]", lang.ArrayType(lang.FLOAT64, 3), (1.0, 2.0, 3.0)),
        ("[1, 300]", lang.ArrayType(UINT8, 2), (1, 44)),
        ("300", lang.ArrayType(UINT8, 2), (44, 44)),
        ("[lost, jam]", lang.ArrayType(FAULT, 2), (1, 2)),
        ("PUSHED", lang.IntType(0, 4000), 2800),
    ]
    for source, type_, value in cases:
        assert typed(source, type_) == lang.Literal(value, type_, NOWHERE)
