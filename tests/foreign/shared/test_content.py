"""Content of other tools: what is translated, what becomes an operation, and hostile text."""

from __future__ import annotations

import random

import pytest

from fsmkit.diagnostics import Source, Span, Text
from fsmkit.foreign.content import Content, Operations, uses
from fsmkit.language.statements.writing import write_statements

VARIABLES = {"count": "count", "me->n": "n", "this.level": "level"}


def text_of(value: str) -> Text:
    return Text(value, Span(Source("<content>", value), 0, len(value)))


def translated(value: str) -> tuple[str, dict[str, str]]:
    operations = Operations()
    block = Content(operations, VARIABLES).block(text_of(value))
    return write_statements(block), {one.name: one.text.value for one in operations.opaque}


@pytest.mark.parametrize(
    ("written", "statements", "opaque"),
    [
        ("count++;", "count += 1", {}),
        ("--me->n; this.level *= 0x10u;", "n -= 1\nlevel *= 0x10", {}),
        ("count = 010;", "count = 8", {}),
        ("off(); /* ; */ off() ;", "off()\noff()", {"off": "off()"}),
        ('show("a;b}");', "show_a_b()", {"show_a_b": 'show("a;b}")'}),
        ("count = read();", "count_read()", {"count_read": "count = read()"}),
        ("for (;;) { count++; }", "for_count()", {"for_count": "for (;;) { count++; }"}),
        ("raise(x)", "raise_x()", {"raise_x": "raise(x)"}),
        ("send", "send_op()", {"send_op": "send"}),
        ("))", "action()", {"action": "))"}),
    ],
)  # fmt: skip
def test_statements(written: str, statements: str, opaque: dict[str, str]) -> None:
    assert translated(written) == (statements, opaque)


def test_branches_keep_their_bodies() -> None:
    found, opaque = translated("if (count > 3 && f()) { off(); } else if (x) count = 0; else on();")
    assert [line.strip() for line in found.splitlines()] == [
        "if (count > 3) && f() {", "off()", "} else if x() {", "count = 0", "} else {", "on()", "}",
    ]  # fmt: skip
    assert list(opaque) == ["f", "off", "x", "on"]


@pytest.mark.parametrize(
    ("written", "condition"),
    [
        ("count >= 2", "count >= 2"),
        ("a && !b || count === 0", "(a() && !b()) || (count == 0)"),
        ("!(a || count)", "!(a() || count)"),
        ("a() > 3", "a_3()"),
        ("x = 1", "x_1()"),
    ],
)
def test_conditions(written: str, condition: str) -> None:
    found = Content(Operations(), VARIABLES).guard(text_of(written))
    assert found is not None
    assert found.value == condition


def test_a_variable_that_opaque_content_uses_is_found() -> None:
    operations = Operations()
    Content(operations, VARIABLES).block(text_of("f(me->n); g(count.x)"))
    assert [name for name in ("me->n", "count", "n") if uses(operations.opaque, name)] == [
        "me->n",
        "count",
    ]


def test_any_text_is_read_in_bounded_time() -> None:
    chosen = random.Random(40)
    parts = ["if", "(", ")", "{", "}", ";", "count", "++", "=", '"', "'", "/*", "else", "&&", "!"]
    parts += ["for", "\\", "\n", "é", "->", "f(", "0x", "//", ":", "?", ","]
    for _ in range(2_000):
        text = " ".join(chosen.choices(parts, k=chosen.randrange(30)))
        found = Content(Operations(), VARIABLES)
        found.block(text_of(text))
        found.guard(text_of(text))
    for text in (
        "(" * 99_999,
        "if (a) " * 9_000,
        "{" * 40 + "x" * 99_999,
        '"' * 65_535,
        "/*" * 999,
    ):
        translated(text)
        Content(Operations()).guard(text_of("!" * 60_000 + text))
