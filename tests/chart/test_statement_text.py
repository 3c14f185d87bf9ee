"""Statements as text: read, found wrong, and written back."""

from __future__ import annotations

import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fsmkit.diagnostics import Findings, Source, Span, Text
from fsmkit.language.statements import tree as stmt
from fsmkit.language.statements.reading import read_statements
from fsmkit.language.statements.writing import write_statements

NOWHERE = Span(Source("<test>", ""), 0, 0)


def at(value: str) -> Text:
    return Text(value, NOWHERE)


def whole(value: str) -> Text:
    return Text(value, Span(Source("<test>", value), 0, len(value)))


def read(value: str) -> stmt.Block:
    findings = Findings()
    block = read_statements(whole(value), findings)
    assert not len(findings), [d.message for d in findings]
    return block


def assign(location: str, value: str, operator: str = "") -> stmt.Assign[Text, Text]:
    return stmt.Assign(at(location), at(value), NOWHERE, operator)


def branch(
    condition: str | None, *body: stmt.WrittenStatement
) -> stmt.Branch[Text, stmt.WrittenStatement]:
    return stmt.Branch(None if condition is None else at(condition), body)


def test_assignments() -> None:
    assert read("x = 1; y += a[2]\nr.f -= 3") == (
        assign("x", "1"),
        assign("y", "a[2]", "+"),
        assign("r.f", "3", "-"),
    )
    assert read("x++; y--; ++z; var n = 4, m = f(1, 2);") == (
        assign("x", "1", "+"),
        assign("y", "1", "-"),
        assign("z", "1", "+"),
        stmt.Local(at("n"), at("4"), NOWHERE),
        stmt.Local(at("m"), at("f(1, 2)"), NOWHERE),
    )


def test_local_variables() -> None:
    assert read("let x = a > 1\nvar n 0..4 = 0\nvar m uint8") == (
        stmt.Local(at("x"), at("a > 1"), NOWHERE, is_fixed=True),
        stmt.Local(at("n"), at("0"), NOWHERE, at("0..4")),
        stmt.Local(at("m"), None, NOWHERE, at("uint8")),
    )
    assert read("return a + 1") == (stmt.Return(at("a + 1"), NOWHERE),)
    assert read("a &= 1; a |= 2; a ^= 3; a <<= 4; a %= 5") == tuple(
        assign("a", str(i + 1), op) for i, op in enumerate(["&", "|", "^", "<<", "%"])
    )


def test_comparisons_are_no_assignments() -> None:
    assert read("ok = a == b") == (assign("ok", "a == b"),)
    assert read("ok = a <= b && c !== d") == (assign("ok", "a <= b && c !== d"),)


def test_keywords_are_names_elsewhere() -> None:
    assert read("log = 1; send[0] = 2; reply.x += log") == (
        assign("log", "1"),
        assign("send[0]", "2"),
        assign("reply.x", "log", "+"),
    )


def test_events() -> None:
    argument = stmt.DocArgument(at("code"), at("Fault.lost"))
    assert read("raise fault(code = Fault.lost)") == (
        stmt.Raise(at("fault"), (argument,), NOWHERE),
    )
    assert read("raise done.state.x; raise a-b") == (
        stmt.Raise(at("done.state.x"), (), NOWHERE),
        stmt.Raise(at("a-b"), (), NOWHERE),
    )
    assert read("send ev(f = e, g = (1, 2)) to peer after 500ms as id") == (
        stmt.DocSend(
            NOWHERE,
            event=at("ev"),
            target=at("peer"),
            delay=at("500ms"),
            id=at("id"),
            arguments=(stmt.DocArgument(at("f"), at("e")), stmt.DocArgument(at("g"), at("(1, 2)"))),
        ),
    )
    assert read("send tick after 2 * T") == (
        stmt.DocSend(NOWHERE, event=at("tick"), delay_expr=at("2 * T")),
    )
    assert read('send ev to "#_internal"') == (
        stmt.DocSend(NOWHERE, event=at("ev"), target=at("#_internal")),
    )
    assert read("cancel id; cancel (name)") == (
        stmt.DocCancel(at("id"), None, NOWHERE),
        stmt.DocCancel(None, at("name"), NOWHERE),
    )


def test_other_statements() -> None:
    assert read('super; log "paused", position, 2; reply a + 1; goto(1, 2)') == (
        stmt.Super(NOWHERE),
        stmt.Log(at("paused"), (at("position"), at("2")), NOWHERE),
        stmt.Reply(at("a + 1"), NOWHERE),
        stmt.CallOperation(at("goto(1, 2)"), NOWHERE),
    )
    assert read("log; log a") == (stmt.Log(None, (), NOWHERE), stmt.Log(None, (at("a"),), NOWHERE))


def test_blocks() -> None:
    one, two = assign("x", "1"), assign("x", "2")
    wanted = (stmt.If((branch("a == 1", one), branch("b", two), branch(None)), NOWHERE),)
    assert read("if a == 1 { x = 1 } else if b { x = 2 } else { }") == wanted
    assert read("if (a == 1) {\n  x = 1;\n}\nelse if (b)\n  x = 2;\nelse {}") == wanted
    assert read("if (a) && b { x = 1 }") == (stmt.If((branch("(a) && b", one),), NOWHERE),)
    assert read("if (a) x = 1; else x = 2; x = 1") == (
        stmt.If((branch("a", one), branch(None, two)), NOWHERE),
        one,
    )
    assert read("for v, i in data { x = 1 } x = 2") == (
        stmt.ForEach(at("data"), at("v"), at("i"), (one,), NOWHERE),
        two,
    )


def test_bodies_without_braces() -> None:
    one = assign("x", "1")
    assert read("if f(a)\n  x = 1") == (stmt.If((branch("f(a)", one),), NOWHERE),)
    named = assign("super", "1")
    assert read("if (a) super = 1") == (stmt.If((branch("a", named),), NOWHERE),)


def test_lines_and_comments() -> None:
    assert read("# one\nx = a + // two\n  b\n/* three\n */ y = a\n  && b\nz = f(1,\n 2)") == (
        assign("x", "a + b"),
        assign("y", "a && b"),
        assign("z", "f(1, 2)"),
    )
    assert read("x = 'a;b # c // d'; y = 1") == (assign("x", "'a;b # c // d'"), assign("y", "1"))


def test_places() -> None:
    source = "x = 1\nif a +\n  b > 1 { retries += 2 }"
    (_, conditional) = read_statements(whole(source), Findings())
    assert isinstance(conditional, stmt.If)
    first = conditional.branches[0]
    assert first.condition is not None
    assert first.condition.value == "a + b > 1"
    assert str(first.condition.span_of(4, 5)).endswith(":3:3")
    (update,) = first.body
    assert isinstance(update, stmt.Assign)
    assert source[update.location.span.start : update.location.span.end] == "retries"
    assert source[update.span.start : update.span.end] == "retries += 2"


WRONG = [
    ("log 'a\\0b'", "statement-syntax", "'a\\0b'"),
    ("retries", "statement-syntax", "retries"),
    ("x =;", "statement-syntax", ";"),
    ("raise", "statement-syntax", ""),
    ("raise ev(1)", "statement-syntax", "1"),
    ("raise ev(a = 1", "statement-syntax", "("),
    ("raise ev(a = 1, b, c = 2)", "statement-syntax", "b"),
    ("var a += 2", "statement-syntax", "+="),
    ("send ev to", "statement-syntax", ""),
    ("send ev to a to b", "statement-syntax", "to"),
    ("send ev(a = 1)(b)", "statement-syntax", "("),
    ("if { }", "statement-syntax", "{"),
    ("if a { x = 1", "statement-syntax", "{"),
    ("if a x = 1", "statement-syntax", "if a x = 1"),
    ("for x { }", "statement-syntax", "for x"),
    ("}", "statement-syntax", "}"),
    (")", "statement-syntax", ")"),
    ("x >>>= 2", "outside-language", "x >>>="),
    ("function f() { return 1 }", "outside-language", "function"),
    ("while (a) { x = 1; y = 2 }", "outside-language", "while"),
    ("for (var i = 0; i < 3; i++) { x = 1 }", "outside-language", "for"),
    ("x = a // 2", "comment-or-division", "// 2"),
]


@pytest.mark.parametrize(("source", "rule", "piece"), WRONG, ids=[w[0] for w in WRONG])
def test_findings(source: str, rule: str, piece: str) -> None:
    findings = Findings()
    block = read_statements(whole(source + "\nafter = 1"), findings)
    (found,) = findings
    assert found.rule.name == rule
    assert found.primary is not None
    start, end = found.primary.span.start, found.primary.span.end
    assert (source + "\n")[start:end].strip() == piece
    if source[5:12] != "{ x = 1" and "(a = 1" not in source[-6:]:
        assert block[-1] == assign("after", "1")  # the rest is still read


@pytest.mark.slow
@pytest.mark.parametrize(
    "source",
    [
        "x = 1\n" * 20_000,
        "if a { " * 20_000,
        "(" * 100_000,
        "\n" * 150_000,
        "if (a\n" * 20_000,
        "if (a) " * 20_000,
        "x = a +\n" * 20_000,
        "for " * 20_000,
        "raise e(" * 20_000,
        "{" * 100_000,
        "}" * 5_000,
        "'" * 100_000,
        "x = '" + "\\'" * 90_000,
        "x = " + " " * 90_000 + "1 +\n" + " " * 90_000 + "1",
        "send e after " + "9" * 150_000,
        "/*" * 50_000,
        "x = 1 +" + "\n" * 100_000,
        "a" * 300_000,
    ],
    ids=lambda source: source[:8].strip(),
)
def test_huge(source: str) -> None:
    findings = Findings()
    started = time.process_time()
    read_statements(whole(source), findings)
    assert time.process_time() - started < 20


PIECES = st.sampled_from(
    [
        "x",
        "log",
        "raise",
        "send",
        "if",
        "else",
        "for",
        "in",
        "to",
        "after",
        "as",
        "var",
        "super",
        "cancel",
        "reply",
        "while",
        "f",
        "(",
        ")",
        "{",
        "}",
        "[",
        "]",
        "=",
        "==",
        "+=",
        "++",
        ";",
        ",",
        ".",
        "+",
        "&&",
        "1",
        "'a'",
        '"',
        "#",
        "//",
        "/*",
        "\n",
        "\n",
    ]
)


@pytest.mark.slow
@given(st.lists(PIECES, max_size=15).map(" ".join) | st.text(max_size=30))
def test_nonsense_is_read_somehow(source: str) -> None:
    findings = Findings()
    read_statements(whole(source), findings)
    for found in findings:
        assert found.primary is not None
        assert 0 <= found.primary.span.start <= found.primary.span.end <= len(source)


# --- written and read back --------------------------------------------------------------------

EXPRESSIONS = st.sampled_from(
    ["1", "a + b", "(a)", "(a) + (b)", "'x;y'", '"#"', "f(a, [1, 2])", "not log", "x == 'to'", "-1"]
).map(at)
NAMES = st.sampled_from(["ev", "a.b", "done.state.x", "x-1", "to", "#_internal", "a b", "é", ""])
STRINGS = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=5)
"""All that a string can hold: the language refuses U+0000."""
TEXTS = (NAMES | STRINGS).map(at)
LOCATIONS = st.sampled_from(["x", "a[i]", "r.f", "log", "send"]).map(at)
ARGUMENTS = st.lists(st.builds(stmt.DocArgument, TEXTS, EXPRESSIONS), max_size=2).map(tuple)
DELAYS = st.sampled_from(["500ms", ".5s", "T", "500", "-5s", "a b", ""]).map(at)
SIMPLE: st.SearchStrategy[stmt.WrittenStatement] = st.one_of(
    st.builds(
        stmt.Assign,
        LOCATIONS,
        EXPRESSIONS,
        st.just(NOWHERE),
        st.sampled_from(["", "+", "-", "*", "/", "%", "&", "|", "^", "<<", ">>"]),
    ),
    st.builds(stmt.Raise, TEXTS, ARGUMENTS, st.just(NOWHERE)),
    st.builds(
        stmt.DocSend,
        st.just(NOWHERE),
        event=TEXTS,
        target=st.none() | TEXTS,
        delay=st.none() | DELAYS,
        id=st.none() | TEXTS,
        type=st.none() | TEXTS,
        arguments=ARGUMENTS,
        name_list=st.lists(LOCATIONS, max_size=2).map(tuple),
        content=st.none() | TEXTS,
    ),
    st.builds(
        stmt.DocSend,
        st.just(NOWHERE),
        event_expr=EXPRESSIONS,
        target_expr=st.none() | EXPRESSIONS,
        delay_expr=st.none() | EXPRESSIONS,
        id_location=st.none() | LOCATIONS,
        type_expr=st.none() | EXPRESSIONS,
        content_expr=st.none() | EXPRESSIONS,
    ),
    st.builds(stmt.DocCancel, TEXTS, st.none(), st.just(NOWHERE)),
    st.builds(stmt.DocCancel, st.none(), EXPRESSIONS, st.just(NOWHERE)),
    st.builds(
        stmt.Log,
        st.none() | TEXTS,
        st.lists(EXPRESSIONS, max_size=3).map(tuple),
        st.just(NOWHERE),
    ),
    st.builds(stmt.Reply, EXPRESSIONS, st.just(NOWHERE)),
    st.builds(stmt.CallOperation, st.sampled_from(["goto(1, 2)", "f()"]).map(at), st.just(NOWHERE)),
    st.just(stmt.Super(NOWHERE)),
    st.builds(stmt.Fail, STRINGS, st.just(NOWHERE)),
)


def nested(
    below: st.SearchStrategy[stmt.WrittenStatement],
) -> st.SearchStrategy[stmt.WrittenStatement]:
    body = st.lists(below, max_size=3).map(tuple)
    branches = st.tuples(
        st.lists(st.builds(stmt.Branch, EXPRESSIONS, body), min_size=1, max_size=3),
        st.lists(st.builds(stmt.Branch, st.none(), body), max_size=1),
    ).map(lambda pair: (*pair[0], *pair[1]))
    return st.one_of(
        st.builds(stmt.If, branches, st.just(NOWHERE)),
        st.builds(
            stmt.ForEach,
            LOCATIONS,
            st.sampled_from(["v", "'continue'", "a.b"]).map(at),
            st.none() | LOCATIONS,
            body,
            st.just(NOWHERE),
        ),
    )


BLOCKS = st.lists(st.recursive(SIMPLE, nested, max_leaves=6), max_size=4).map(tuple)


@pytest.mark.slow
@given(BLOCKS)
def test_what_is_written_reads_back_equal(block: stmt.Block) -> None:
    written = write_statements(block)
    assert read(written) == block, written


@pytest.mark.parametrize(
    "condition",
    [
        "(a)",
        "(a) and b",
        "((a))",
        "(a)(b)",
        "(function() {})()",
        "a == {}",
        "f({})",
        "(a) [b]",
        "{}",
    ],
)
def test_conditions_end_where_they_should(condition: str) -> None:
    block = (
        stmt.If((branch(condition, assign("x", "1")), branch(None, assign("x", "2"))), NOWHERE),
    )
    assert read(write_statements(block)) == block
