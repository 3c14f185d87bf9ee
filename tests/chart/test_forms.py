"""Two nodes have one form just if they differ in nothing but their places."""

from __future__ import annotations

from dataclasses import replace

import pytest

import fsmkit.language as lang
from fsmkit.chart.forms import by_form, form
from fsmkit.chart.statements import Assign
from fsmkit.diagnostics import Source, Span

HERE, THERE = (Span(Source("chart", "a == 1\na == 1"), at, at + 6) for at in (0, 7))
SMALL, REAL = lang.IntType(0, 9), lang.FloatType()


def literal(value: lang.Value, type_: lang.Type, name: str | None = None) -> lang.Literal:
    return lang.Literal(value, type_, HERE, name)


def equal(span: Span, right: lang.Expr) -> lang.Binary:
    return lang.Binary(
        lang.BinaryOp.EQ, lang.Variable("a", SMALL, lang.Storage.DATA, span), right, lang.BOOL, span
    )


def test_places_do_not_count() -> None:
    one, other = (equal(span, lang.Literal(1, lang.IntType(1, 1), span)) for span in (HERE, THERE))
    assert form(one) == form(other) == form(one)
    place = lang.Variable("a", SMALL, lang.Storage.DATA, HERE)
    block = (Assign(place, one, HERE),)
    assert form(block) == form((Assign(replace(place, span=THERE), other, THERE),))
    asked: list[object] = []

    @by_form
    def number(node: object) -> int:
        asked.append(node)
        return len(asked)

    assert number(one) == number(other) == 1
    assert asked == [one]


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (literal(1, SMALL), literal(True, SMALL)),
        (literal(0.0, REAL), literal(-0.0, REAL)),
        (literal(1, SMALL), literal(1, lang.IntType(0, 8))),
        (literal(1, SMALL), literal(1, SMALL, "LIMIT")),
        (literal((1, 0), SMALL), literal((True, 0), SMALL)),
    ],
)
def test_all_else_counts(one: lang.Literal, other: lang.Literal) -> None:
    assert form(one) != form(other)
    assert form(equal(HERE, one)) != form(equal(HERE, other))
    assert form((one, other)) != form((other, one))
