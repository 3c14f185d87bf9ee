"""What is wrong is said, where it is, and with a way out."""

from __future__ import annotations

from dataclasses import replace

import pytest

import fsmkit.language as lang
from fsmkit.diagnostics import Findings, Severity, Source, Span, Text
from tests.language.language import FAULT, SCOPE, refused, text, typed

ECMASCRIPT = replace(SCOPE, dialect="ecmascript")

# expression, rule, the piece underlined, a part of the help
WRONG = [
    ("point.x == 'a\\0b'", "expression-syntax", "'a\\0b'", "strings of C end there"),
    ("retires", "unknown-name", "retires", "declare it under"),
    ("positon > 1", "unknown-name", "positon", "did you mean `position`?"),
    ("a + lost", "unknown-name", "lost", "did you mean `Fault.lost`?"),
    ("n == 1", "unknown-name", "n", "did you mean `event.n`?"),
    ("idle", "unknown-name", "idle", "In(idle)"),
    ("at_limit", "unknown-name", "at_limit", "call it"),
    ("Fault", "unknown-name", "Fault", "Fault.member"),
    ("Fault.losst", "unknown-name", "losst", "did you mean `lost`?"),
    ("point.z", "unknown-name", "z", None),
    ("event.m", "unknown-name", "m", "`code`, `n`"),
    ("In(idel)", "unknown-name", "idel", "did you mean `idle`?"),
    ("In(recent)", "unknown-name", "recent", "it is never active"),
    ("at_limits()", "unknown-name", "at_limits", "did you mean `at_limit`?"),
    ("a && flag", "type-mismatch", "a", "!= 0"),
    ("flag == 1", "type-mismatch", "flag == 1", None),
    ("code < Fault.jam", "type-mismatch", "code < Fault.jam", "`==` and `!=`"),
    ("code == 'lost'", "type-mismatch", "code == 'lost'", "Fault.none"),
    ("u & b == 0", "type-mismatch", "u & b == 0", "put parentheses"),
    ("delay + 5", "type-mismatch", "delay + 5", "500ms"),
    ("f % 2.0", "type-mismatch", "f % 2.0", None),
    ("-flag", "type-mismatch", "-flag", None),
    ("a[0]", "type-mismatch", "a", "declare an array"),
    ("array[f]", "type-mismatch", "f", None),
    ("array[4]", "index-out-of-range", "4", "0..3"),
    ("flag ? a : code", "type-mismatch", "flag ? a : code", "one type"),
    ("[a]", "not-known-when-compiling", "a", None),
    ("0 < a < 3", "chained-comparison", "0 < a < 3", "`and`"),
    ("q + i", "integer-too-wide", "q + i", "int64"),
    ("a * 9000000000000000000", "integer-too-wide", "a * 9000000000000000000", "narrow"),
    ("99999999999999999999", "integer-too-wide", "99999999999999999999", None),
    ("a / 0", "division-by-zero", "0", None),
    ("goto(1, jam)", "no-result", "goto(1, jam)", "-> bool"),
    ("at_limit(1)", "wrong-arguments", "at_limit(1)", "at_limit()"),
    ("abs(1, 2)", "wrong-arguments", "abs(1, 2)", None),
    ("'a' + 'b'", "outside-language", "'a' + 'b'", "one by one"),
    ("typeof a", "outside-language", "typeof a", None),
    ("a >>> 1", "outside-language", ">>>", ">>"),
    ("a ** 2", "outside-language", "**", "multiply"),
    ("a // 2", "outside-language", "//", "`/`"),
    ("mode === undefined", "outside-language", "undefined", None),
    ("_event.origin", "outside-language", "_event.origin", "_event.name"),
    ("array.push(1)", "outside-language", "array.push", "operation"),
    ("function () { return 1 }", "outside-language", "function", "operation"),
    ("x => 1", "outside-language", "=>", "operation"),
    ("super", "super-without-base", "super", None),
    ("010", "expression-syntax", "010", "0o10"),
    ("1e999", "expression-syntax", "1e999", None),
    ("a = 3", "expression-syntax", "=", "`==`"),
    ("a +", "expression-syntax", "+", "operand"),
    ("(a + b", "expression-syntax", "b", "`)`"),
    ("a b", "expression-syntax", "b", "operator"),
    ("10abc", "expression-syntax", "abc", None),
    ("'abc", "expression-syntax", "'", "close the string"),
    ("1.5us", "invalid-duration", "1.5us", "tick"),
    ("", "expression-syntax", "", None),
]


@pytest.mark.parametrize(("source", "rule", "piece", "way_out"), WRONG, ids=[w[0] for w in WRONG])
def test_finding(source: str, rule: str, piece: str, way_out: str | None) -> None:
    found = refused(source)
    assert found.rule.name == rule, found.message
    assert found.primary is not None
    assert source[found.primary.span.start : found.primary.span.end] == piece
    if way_out is not None:
        assert way_out in (found.help or "")


EXPECTED: list[tuple[str, lang.Type, str]] = [
    ("5", lang.IntType(0, 3), "value-out-of-range"),
    ("a", lang.BOOL, "type-mismatch"),
    ("flag", lang.INT32, "type-mismatch"),
    ("5", lang.DURATION, "type-mismatch"),
    ("'lost'", FAULT, "type-mismatch"),
    ("[1, 2]", lang.ArrayType(lang.INT32, 3), "type-mismatch"),
    ("[1, 900]", lang.ArrayType(lang.IntType(0, 9), 2), "value-out-of-range"),
    ("[1e10]", lang.ArrayType(lang.IntType(0, 9), 1), "type-mismatch"),
    ("1e10", lang.ArrayType(lang.IntType(0, 9), 2), "type-mismatch"),
    ("f", lang.ArrayType(lang.INT32, 3), "type-mismatch"),
    ("delay", lang.INT32, "type-mismatch"),
]


@pytest.mark.parametrize(("source", "expected", "rule"), EXPECTED)
def test_finding_where_a_type_is_expected(source: str, expected: lang.Type, rule: str) -> None:
    assert refused(source, expected).rule.name == rule


def test_an_argument_sure_to_be_outside_of_its_range() -> None:
    findings = Findings()
    assert lang.type_expression(text("goto(-1, none)"), SCOPE, findings) is None
    assert [d.rule.name for d in findings] == ["value-out-of-range"]


def test_a_value_sure_to_saturate_is_a_warning() -> None:
    findings = Findings()
    assert lang.type_expression(text("a + 10"), SCOPE, findings, lang.IntType(0, 9)) is not None
    (found,) = findings
    assert (found.rule.name, found.severity) == ("value-out-of-range", Severity.WARNING)


def test_all_findings_of_an_expression_are_told() -> None:
    findings = Findings()
    assert lang.type_expression(text("one + two * array[9]"), SCOPE, findings) is None
    assert [d.rule.name for d in findings] == ["unknown-name", "unknown-name", "index-out-of-range"]


def test_places_follow_the_offsets_of_the_text() -> None:
    source = Source("chart.scxml", "cond='a &amp;&amp; retires'")
    offsets = (6, 7, 8, 13, 18, *range(19, 26))
    findings = Findings()
    lang.type_expression(Text("a && retires", Span(source, 6, 26), offsets), SCOPE, findings)
    spans = [d.primary.span for d in findings if d.primary]
    assert source.text[spans[-1].start : spans[-1].end] == "retires"


def test_ecmascript_keeps_its_meaning_or_is_refused() -> None:
    assert typed("a / 2", scope=ECMASCRIPT).type == lang.FLOAT64
    assert typed("6 / 2", scope=ECMASCRIPT).type == lang.IntType(3, 3)
    assert refused("a / 2", lang.INT32, ECMASCRIPT).rule.name == "inexact-division"
    assert refused("f", lang.INT32, ECMASCRIPT).rule.name == "inexact-division"
    for source in ("Math.trunc(a / 2)", "Math.floor(a / 2)", "(a / 2) | 0", "2.0"):
        typed(source, lang.INT32, ECMASCRIPT)
    typed("Math.floor(b / a)", lang.INT32, ECMASCRIPT)
    assert refused("a == 'x'", lang.BOOL, ECMASCRIPT).rule.name == "type-mismatch"
    assert refused("w | 1", None, ECMASCRIPT).rule.name == "type-mismatch"
    assert typed("1 << 31", scope=ECMASCRIPT).type == lang.INT32
    assert typed("a === 1 && mode !== 'x'", scope=ECMASCRIPT).type == lang.BOOL


def test_delays_of_ecmascript() -> None:
    delay = typed("'1.5s'", lang.DURATION, ECMASCRIPT)
    assert isinstance(delay, lang.Literal)
    assert delay.value == 1500
    findings = Findings()
    assert lang.read_duration(text("500"), ECMASCRIPT, findings) == 500
    assert [d.rule.name for d in findings] == ["duration-without-unit"]


@pytest.mark.parametrize(
    ("source", "rule"),
    [
        ("position", "assigned-input"),
        ("PUSHED", "not-assignable"),
        ("event.n", "not-assignable"),
        ("a + 1", "not-assignable"),
        ("array[7]", "index-out-of-range"),
        ("nothing", "unknown-name"),
    ],
)
def test_what_cannot_be_assigned(source: str, rule: str) -> None:
    findings = Findings()
    assert lang.type_location(text(source), SCOPE, findings) is None
    assert [d.rule.name for d in findings] == [rule]


@pytest.mark.parametrize("source", ["a", "array[a]", "point.x", "g"])
def test_what_can_be_assigned(source: str) -> None:
    findings = Findings()
    assert lang.type_location(text(source), SCOPE, findings) == typed(source)
    assert not len(findings)


def test_calls_for_their_effect() -> None:
    findings = Findings()
    call = lang.type_call(text("goto(a * 1000, jam)"), SCOPE, findings)
    assert call is not None
    assert call.type is None
    assert str(call.arguments[0].type) == "0..4000"
    assert not len(findings)
    assert lang.type_call(text("a + 1"), SCOPE, findings) is None
    assert lang.type_call(text("abs(a)"), SCOPE, findings) is None
    assert [d.rule.name for d in findings] == ["statement-syntax", "statement-syntax"]


def test_updates() -> None:
    findings = Findings()
    location = lang.type_location(text("a"), SCOPE, findings)
    assert location is not None
    updated = lang.type_update(location, "+", text("b"), SCOPE, findings)
    assert updated == typed("a + b", lang.IntType(0, 9))
    assert lang.type_update(location, "-", text("code"), SCOPE, findings) is None


@pytest.mark.parametrize(
    ("source", "name"),
    [
        ("bool", "bool"),
        ("0..4000", "0..4000"),
        (" -5 .. 5 wrap ", "-5..5 wrap"),
        ("0..PUSHED", "0..2800"),
        ("0 .. 2 * PUSHED fault", "0..5600 fault"),
        ("0..255 wrap", "uint8"),
        ("uint8[4]", "uint8[4]"),
        ("0..3 wrap[4]", "0..3 wrap[4]"),
        ("Fault[3]", "Fault[3]"),
        ("Point", "Point"),
        ("duration", "duration"),
        ("0..18446744073709551615", "0..18446744073709551615"),
    ],
)
def test_types(source: str, name: str) -> None:
    findings = Findings()
    assert str(lang.read_type(text(source), SCOPE, findings)) == name
    assert not len(findings)


@pytest.mark.parametrize(
    ("source", "rule", "way_out"),
    [
        ("int", "unknown-name", "int32"),
        ("string", "unknown-name", "symbol"),
        ("Foult", "unknown-name", "did you mean `Fault`?"),
        ("5..1", "invalid-type", "1..5"),
        ("-1..18446744073709551615", "invalid-type", None),
        ("bool[0]", "invalid-type", None),
        ("bool[70000]", "invalid-type", None),
        ("Point[2]", "invalid-type", None),
        ("uint8[2][2]", "invalid-type", None),
        ("bool wrap", "invalid-type", "0..3 wrap"),
        ("0..a", "not-known-when-compiling", None),
        ("0..", "expression-syntax", None),
        ("", "invalid-type", None),
    ],
)
def test_wrong_types(source: str, rule: str, way_out: str | None) -> None:
    findings = Findings()
    assert lang.read_type(text(source), SCOPE, findings) is None
    (found,) = findings
    assert found.rule.name == rule
    assert (way_out or "") in (found.help or "")


@pytest.mark.parametrize(
    ("source", "ticks"),
    [
        ("500ms", 500),
        ("2s", 2000),
        ("1.5s", 1500),
        (".5s", 500),
        ("3000us", 3),
        ("1m", 60_000),
        ("1h", 3_600_000),
        ("T_PUSH", 1600),
        ("T_PUSH / 2 + 1s", 1800),
        (f"{lang.LONGEST_DURATION}ms", lang.LONGEST_DURATION),
    ],
)
def test_durations(source: str, ticks: int) -> None:
    findings = Findings()
    assert lang.read_duration(text(source), SCOPE, findings) == ticks
    assert not len(findings)


@pytest.mark.parametrize(
    ("source", "rule"),
    [
        ("100us", "invalid-duration"),
        ("500", "invalid-duration"),
        (f"{lang.LONGEST_DURATION + 1}ms", "invalid-duration"),
        ("a", "type-mismatch"),
        ("delay", "not-known-when-compiling"),
        ("5 apples", "expression-syntax"),
    ],
)
def test_wrong_durations(source: str, rule: str) -> None:
    findings = Findings()
    assert lang.read_duration(text(source), SCOPE, findings) is None
    assert [d.rule.name for d in findings] == [rule]
