"""Declarations as text."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fsmkit.diagnostics import Findings, Source, Span, Text
from fsmkit.language.statements.reading import read_signature, read_typed


def text(value: str) -> Text:
    return Text(value, Span(Source("<test>", value), 0, len(value)))


@pytest.mark.parametrize(
    ("source", "name", "fields", "result"),
    [
        (
            "goto(position 0..4000, speed 0..100)",
            "goto",
            [("position", "0..4000"), ("speed", "0..100")],
            None,
        ),
        ("at_limit() -> bool", "at_limit", [], "bool"),
        ("query() -> 0..3", "query", [], "0..3"),
        ("pushed", "pushed", [], None),
        ("a.b-c(x uint8[4], y 0..max(N, 3) wrap)", "a.b-c", None, None),
        ("read (to bool)", "read", [("to", "bool")], None),
    ],
)
def test_signatures(
    source: str, name: str, fields: list[tuple[str, str]] | None, result: str | None
) -> None:
    findings = Findings()
    found = read_signature(text(source), findings)
    assert found is not None
    assert not len(findings)
    assert found.name.value == name
    if fields is None:
        fields = [("x", "uint8[4]"), ("y", "0..max(N, 3) wrap")]
    assert [(f.name.value, f.type.value) for f in found.fields if f.type] == fields
    assert (None if found.result is None else found.result.value) == result
    for field in found.fields:
        assert field.type is not None
        assert source[field.type.span.start : field.type.span.end] == field.type.value


@pytest.mark.parametrize(
    ("source", "piece"),
    [
        ("", ""),
        ("1f", "1f"),
        ("'f'", "'f'"),
        ("goto(", "("),
        ("goto(position: int)", "position: int"),
        ("goto(x)", "x"),
        ("goto(0..3)", "0..3"),
        ("goto() x", "x"),
        ("f() ->", "->"),
    ],
)
def test_wrong_signatures(source: str, piece: str) -> None:
    findings = Findings()
    assert read_signature(text(source), findings) is None
    (found,) = findings
    assert found.rule.name == "declaration-syntax"
    assert found.primary is not None
    assert source[found.primary.span.start : found.primary.span.end] == piece
    assert found.help


@pytest.mark.parametrize(
    ("source", "type_", "init"),
    [
        ("0..3 = 0", "0..3", "0"),
        ("uint8[4] = [1, 2, 3, 4]", "uint8[4]", "[1, 2, 3, 4]"),
        ("bool", "bool", None),
        ("bool = a == b", "bool", "a == b"),
        ("= 5", None, "5"),
        ("symbol = '='", "symbol", "'='"),
        ("", None, None),
    ],
)
def test_typed(source: str, type_: str | None, init: str | None) -> None:
    findings = Findings()
    found = read_typed(text(source), findings)
    assert not len(findings)
    assert tuple(None if part is None else part.value for part in found) == (type_, init)


def test_a_start_value_that_is_missing() -> None:
    findings = Findings()
    type_, init = read_typed(text("0..3 ="), findings)
    assert type_ is not None
    assert init is None
    assert [d.rule.name for d in findings] == ["declaration-syntax"]


@given(st.text(alphabet="ab0.(),[]=->: \n'", max_size=25))
def test_nonsense_is_a_finding_or_a_declaration(source: str) -> None:
    findings = Findings()
    assert (read_signature(text(source), findings) is None) == findings.has_errors
    read_typed(text(source), findings)
