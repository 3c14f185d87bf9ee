"""Texts nobody should write: each ends soon, with a finding and without a traceback."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

import fsmkit.language as lang
from fsmkit.diagnostics import Findings
from fsmkit.language.syntax import DEEPEST
from tests.language.language import SCOPE, text, typed

HUGE = [
    "(" * 100_000,
    "(" * 100_000 + "a" + ")" * 100_000,
    "!" * 100_000 + "flag",
    "not " * 50_000 + "flag",
    "-" * 100_000 + "a",
    " + ".join(["a"] * 50_000),
    "flag ? " * 20_000,
    "a if flag else " * 5_000 + "a",
    "abs(" * 20_000,
    "array[" * 20_000,
    "a" + ".b" * 50_000,
    "x" * 100_000,
    "9" * 100_000,
    "9" * 100_000 + ".0",
    "0x" + "f" * 100_000,
    "1e" + "9" * 1_000,
    "'" * 99_999,
    '"' + "\\" * 99_999,
    " " * 100_000,
    "/" * 100_000,
    "a " * 500_000,
]


@pytest.mark.slow
@pytest.mark.parametrize("source", HUGE, ids=lambda source: source[:8])
def test_huge(source: str) -> None:
    findings = Findings()
    started = time.perf_counter()
    assert lang.type_expression(text(source), SCOPE, findings) is None
    assert time.perf_counter() - started < 20
    assert findings.has_errors
    assert all(len(d.message) < 200_000 for d in findings)


@pytest.fixture
def usual_depth() -> Iterator[None]:
    """Let Python recurse as deep as it does by itself; mypy, run by another test, raises that."""
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(1000)
    yield
    sys.setrecursionlimit(before)


@pytest.mark.usefixtures("usual_depth")
def test_what_is_just_allowed_can_be_worked_with() -> None:
    deep = typed("a" + " + a" * (DEEPEST - 1))
    assert typed(lang.format_expression(deep)) == deep
    assert lang.fold(deep) == deep


@pytest.mark.slow
def test_many_constants_are_read_in_time() -> None:
    started = time.perf_counter()
    typed("[" + ", ".join(["12"] * 20_000) + "]")
    assert time.perf_counter() - started < 20


PIECES = st.sampled_from(
    [
        "a",
        "b",
        "f",
        "flag",
        "array",
        "point",
        "code",
        "lost",
        "Fault",
        "event",
        "_event",
        "In",
        "len",
        "min",
        "(",
        ")",
        "[",
        "]",
        ".",
        ",",
        "?",
        ":",
        "+",
        "-",
        "*",
        "/",
        "%",
        "&&",
        "||",
        "!",
        "==",
        "===",
        "<",
        "<=",
        "&",
        "|",
        "^",
        "~",
        "<<",
        "and",
        "or",
        "not",
        "if",
        "else",
        "true",
        "1",
        "0",
        "2.5",
        "1s",
        "'x'",
        '"',
        "'",
        "\\",
        "#",
        "@",
        "=",
        "{",
        "}",
        "$",
        "é",
    ]
)
SOUP = st.lists(PIECES, max_size=12).map(" ".join) | st.text(max_size=30)


@given(SOUP)
def test_nonsense_is_a_finding_or_means_something(source: str) -> None:
    for read in (
        lang.type_expression,
        lang.type_location,
        lang.type_call,
        lang.read_type,
        lang.read_duration,
    ):
        findings = Findings()
        result = read(text(source), SCOPE, findings)
        assert (result is None) == findings.has_errors, (read.__name__, source)
        for found in findings:
            assert found.primary is not None
            assert 0 <= found.primary.span.start <= found.primary.span.end <= len(source)
