"""Accepted expressions of C, and texts that are rejected because they could be more."""

from __future__ import annotations

import pytest

from fsmkit.codegen.existing_c.tokens import CExpression, read_expression
from fsmkit.diagnostics import Findings, Source, Span, Text


def read(text: str) -> tuple[CExpression | None, list[str]]:
    findings = Findings()
    source = Source("<test>", text)
    found = read_expression(Text(text, Span(source, 0, len(text))), findings)
    return found, [each.message for each in findings]


@pytest.mark.parametrize(
    "text",
    [
        "BMS_OK",
        "bms_set(BMS_CHANNEL_1, (float)amps / 10.0f)",
        "ctx->pwm[2].level",
        "x ? y : z, w <<= 3",
        'puts("; { } # // /* \\" ")',
        "'\\''",
        "L'x' + 0x1Fu + 1.5e-3f + .5",
        "sizeof(struct board) == 4 && !*p++",
    ],
)
def test_expressions_stay_as_they_are(text: str) -> None:
    found, told = read(text)
    assert told == []
    assert found is not None
    assert found.text == text


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("a; b", "`;` ends a statement"),
        ("{0}", "`{` starts a block"),
        ("#define x", "`#` starts a directive"),
        ("(a", "this bracket is not closed"),
        ("a)", "no bracket fits"),
        ("(a]", "no bracket fits"),
        ("a // b", "`//` has no place"),
        ("a /* b", "`/*` has no place"),
        ("return 1", "`return` is not allowed in an expression"),
        ('__asm__("nop")', "`__asm__` is not allowed in an expression"),
        ('"abc', "is not the start of a C token"),
        ("'", "is not the start of a C token"),
        ("a \\\n b", "is not the start of a C token"),
        ("a <% b", "`<%` has no place"),
        ('"??/" x', "`??` has no place"),
        ("ä", "is not the start of a C token"),
        ("@", "is not the start of a C token"),
        ("", "nothing stands here"),
        ("  ", "nothing stands here"),
        ("f(...)", "is for declarations"),
    ],
)
def test_what_could_be_more_is_refused(text: str, why: str) -> None:
    found, (message,) = read(text)
    assert found is None
    assert why in message


def test_names_behind_a_selector_are_members() -> None:
    found, _ = read("amps + ctx->amps + frame . amps + f(amps)")
    assert found is not None
    assert found.names == {"amps", "ctx", "frame", "f"}
    assert found.replaced({"amps": "amps_"}) == "amps_ + ctx->amps + frame . amps + f(amps_)"


@pytest.mark.parametrize(
    ("text", "operand"),
    [("a", "a"), ("a->b[i + 1]", "a->b[i + 1]"), ("f(a, b)", "f(a, b)"), ("-1", "(-1)"),
     ("a, b", "(a, b)"), ("a + b", "(a + b)"), ("(a)b", "((a)b)"), ("12u", "12u")],
)  # fmt: skip
def test_operands_have_brackets_where_they_need_them(text: str, operand: str) -> None:
    found, _ = read(text)
    assert found is not None
    assert found.operand({}) == operand
