from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from fsmkit.diagnostics import Findings, Source, Span
from fsmkit.yaml.encoding import decode
from fsmkit.yaml.nodes import (
    DEEPEST,
    Mapping,
    Node,
    Scalar,
    Sequence,
    check_keys,
    read_by_libyaml,
    read_by_pyyaml,
    read_nodes,
)
from fsmkit.yaml.places import offsets_of
from tests.needs import where

Nodes = Callable[[str], Any]


def test_nothing_is_resolved(nodes: Nodes) -> None:
    read = nodes("on: off\nnull: 1:30\nyes: [~, 0x1f, 2026-01-01, '', ]\n? k\n: {}")
    assert isinstance(read.node, Mapping)
    assert [key.value for key, _ in read.node.entries] == ["on", "null", "yes", "k"]
    (_, off), (_, time), (_, items), (_, empty) = read.node.entries
    assert [n.text.value for n in (off, time) if isinstance(n, Scalar)] == ["off", "1:30"]
    assert isinstance(items, Sequence)
    assert [i.text.value for i in items.items if isinstance(i, Scalar)] == [
        "~", "0x1f", "2026-01-01", "",
    ]  # fmt: skip
    assert empty == Mapping((), empty.span)


PIECES = st.text(alphabet="ab '\"\\\n:#-é😀\t", max_size=40)


@settings(max_examples=300, deadline=None)
@given(PIECES, st.sampled_from(["'", '"', "|", ">", None]), st.integers(10, 30), st.booleans())
def test_every_character_has_its_place(
    value: str, style: str | None, width: int, is_unicode: bool
) -> None:
    written = {"key": {"key": value}}
    text = yaml.dump(written, default_style=style, width=width, allow_unicode=is_unicode)
    for event in yaml.parse(text):
        if not isinstance(event, yaml.ScalarEvent) or event.value != value:
            continue
        assert event.start_mark is not None
        assert event.end_mark is not None
        span = Span(Source("a", text), event.start_mark.index, event.end_mark.index)
        offsets = offsets_of(span, value, event.style)
        if offsets is None:
            assert text.startswith(value, span.start)
            continue
        assert list(offsets) == sorted(offsets)
        for char, offset in zip(value, offsets, strict=True):
            # a folded line break stands for a space, a backslash begins an escape
            assert text[offset] == char or char in "\n \t" or text[offset] == "\\"


def test_places_in_blocks_and_quotes(nodes: Nodes) -> None:
    text = "a: |\n  one\n   two\nb: >-\n  three\n  four\nc: \"f\\tive \\u0036\"\nd: 'it''s'\n"
    read = nodes(text)
    assert isinstance(read.node, Mapping)
    places = {}
    for key, node in read.node.entries:
        assert isinstance(node, Scalar)
        value = node.text.value
        places[key.value] = (
            value,
            [text[node.text.span_of(i, i + 1).start] for i in range(len(value))],
        )
    assert places["a"] == ("one\n two\n", list("one\n two\n"))
    assert places["b"] == ("three four", list("three\nfour"))
    assert places["c"] == ("f\tive 6", list("f\\ive \\"))
    assert places["d"] == ("it's", list("it's"))


@pytest.mark.parametrize(
    ("text", "rule", "place"),
    [
        ("", "empty-file", ""),
        ("# nothing\n", "empty-file", ""),
        ("a: 1\na: 2", "duplicate-key", "a"),
        ("a: &x 1\nb: *x", "beyond-charts", "&x 1"),
        ("a: !!str 1", "beyond-charts", "!!str 1"),
        ("a: {b: 1}\n<<: {c: 2}", "beyond-charts", "<<"),
        ("a: 1\n---\nb: 2", "beyond-charts", "---"),
        ("[a, b]: c", "unexpected-shape", "[a, b]"),
        ("a: [1, 2", "broken-yaml", ""),
        ("a:\n\tb: 1", "broken-yaml", "\t"),
        ("a: 'open", "broken-yaml", ""),
        ("a: 1\u2028b: 2\u2028cons", "broken-yaml", ""),
        ("a:\u2028  b: 1\u2028 c: 2", "broken-yaml", ""),
        ("a: b: c", "broken-yaml", ":"),
        ("a: @b", "broken-yaml", "@"),
        ("a: x\0y", "broken-yaml", "\0"),
        ('a: "x\\0y"', "broken-yaml", '"x\\0y"'),
        ('a: "\\ud800"', "broken-yaml", '"\\ud800"'),
        ('a: "\\Uffffffff"', "broken-yaml", ""),
        ("a: {do: x[0] = 1}", "broken-yaml", "["),
        ("[" * 1000, "too-deep", "["),
        ("a:\n" + "".join(" " * n + "- a:\n" for n in range(2, 600, 2)), "too-deep", ""),
    ],
)
def test_what_is_not_yaml_for_us(nodes: Nodes, text: str, rule: str, place: str) -> None:
    read = nodes(text)
    diagnostic = read.one(rule) if rule != "beyond-charts" else read.found[0]
    assert diagnostic.rule.name == rule
    assert read.at(diagnostic).startswith(place)
    assert diagnostic.help


@pytest.mark.parametrize(
    ("text", "help_"),
    [
        ("if: a ? b : c", '`if: "a ? b : c"`'),
        ("in: [fault(code Fault, n 0..3), b]", 'quote it: "fault(code Fault, n 0..3)"'),
        ("in: {do: goto(PUSHED, 100), target: b}", 'quote it: "goto(PUSHED, 100)"'),
        ('do: log "at #5"', "quote the text: 'log \"at #5\"'"),
    ],
)
def test_a_lost_text_is_shown_quoted(nodes: Nodes, text: str, help_: str) -> None:
    (diagnostic,) = nodes(text).found
    assert diagnostic.help is not None
    assert help_ in diagnostic.help


def test_what_was_split_is_put_together(nodes: Nodes) -> None:
    read = nodes("[fault(code Fault, n 0..3), b]")
    assert isinstance(read.node, Sequence)
    assert [i.text.value for i in read.node.items if isinstance(i, Scalar)] == [
        "fault(code Fault, n 0..3)", "b",
    ]  # fmt: skip
    read = nodes("{do: goto(A, 1), target: b}")
    assert isinstance(read.node, Mapping)
    assert [key.value for key, _ in read.node.entries] == ["do", "target"]


def test_a_comment_after_prose_is_no_error(nodes: Nodes) -> None:
    assert nodes("doc: it's fine # and this a comment").found == ()
    assert not nodes('doc: 5" wide # and this a comment').errors


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_encodings(encoding: str) -> None:
    findings = Findings()
    source = decode("chart: Türe\r\nx: 1\r\n".encode(encoding), "a.yaml", findings)
    assert source is not None
    assert source.text == "chart: Türe\nx: 1\n"
    assert len(findings) == 0


@pytest.mark.parametrize("content", [b"a: \xfc\n", b"\xff\xfea", "chart: x".encode("utf-16-le")])
def test_wrong_encodings(content: bytes) -> None:
    findings = Findings()
    source = decode(content, "a.yaml", findings)
    if source is not None:
        assert read_nodes(source, findings) is None
    (diagnostic,) = findings
    assert diagnostic.rule.name in ("invalid-encoding", "broken-yaml")
    assert diagnostic.help is not None
    assert "UTF-8" in diagnostic.help


def test_the_depth_that_is_allowed(nodes: Nodes) -> None:
    assert nodes("[" * DEEPEST + "]" * DEEPEST).found == ()


@settings(max_examples=300, deadline=None)
@given(st.text(alphabet="ab:-[]{}(),#&*!|>'\"%@`?\\ \n\t~=<.0é\ufeff\x85", max_size=60))
def test_any_text_gives_nodes_or_findings(text: str) -> None:
    findings = Findings()
    node = read_nodes(Source("a.yaml", text), findings)
    assert node is not None or findings.has_errors


WORDS = [
    "a",
    "b: ",
    "- ",
    "? ",
    "{",
    "}",
    "[",
    "]",
    ", ",
    ":",
    "'",
    '"',
    "it''s",
    "!t ",
    "&x ",
    "*x",
]
BREAKS = [
    "\n",
    "\n  ",
    "\n- ",
    " ",
    " # c\n",
    ">-\n  ",
    "|\n",
    "|2",
    "|#",
    "---\n",
    "\r",
    "\x85",
    "\t",
]
ODD = ["''", '"\\x41"', "\ufeff", "a ? b", "%", "@", "\\", "<<: ", "\u2028", "é", "😀"]
LINES = """\
states:
  a:
    on: {go: {if: n < 2, target: b}}
    entry: |
      n = 1

# c
    do: 'it''s'  # c
  b: {history: deep, default: a}
  - [x, y, {z: }]
a: b
  c
- d""".splitlines()
WRITTEN = st.lists(st.sampled_from([*WORDS, *BREAKS, *ODD]), max_size=12).map("".join)
WRITTEN |= st.lists(st.sampled_from(LINES), max_size=8).map("\n".join)


@pytest.mark.slow
@where(yaml.__with_libyaml__, "PyYAML was built without libyaml")
@settings(max_examples=1500, deadline=None)
@given(WRITTEN)
def test_both_parsers_read_the_same(text: str) -> None:
    source, found, expected = Source("a.yaml", text), Findings(), Findings()
    node = read_by_libyaml(source, found)
    if node is None:
        assert not len(found)
        return
    assert places(node) == places(read_by_pyyaml(source, expected))
    assert list(found) == list(expected)


def test_what_a_chart_holds_is_read_by_libyaml() -> None:
    text = "states:\n  é😀: {on: {go: {if: 'a ? b', target: [x, y]}}}  # c\n  b: |\n    n = 1\n"
    source = Source("a.yaml", text)
    node = read_by_libyaml(source, Findings())
    assert (node is not None) is yaml.__with_libyaml__
    assert node is None or places(node) == places(read_by_pyyaml(source, Findings()))


def places(node: Node | None) -> object:
    """A node with all that does not take part in equality."""
    match node:
        case None:
            return None
        case Scalar(text, quoted):
            return text.value, text.span.start, text.span.end, text.offsets, quoted
        case Sequence(items, span):
            return span.start, span.end, [places(item) for item in items]
        case Mapping(entries, span):
            pairs = [(places(Scalar(key)), places(value)) for key, value in entries]
            return span.start, span.end, pairs


def test_where_no_key_may_stand_one_is_to_be_removed() -> None:
    findings = Findings()
    root = read_nodes(Source("a.yaml", "a: 1"), findings)
    assert isinstance(root, Mapping)
    check_keys(root, [], "`foreign`", findings)
    assert [found.help for found in findings] == ["remove it"]


@pytest.mark.parametrize("length", [1_025, 100_000])
def test_a_key_that_is_too_long_is_named_so(length: int) -> None:
    source = Source("long.yaml", f"chart: L\nstates:\n  {'x' * length}: {{}}\n  b: {{}}\n")
    findings = Findings()
    assert read_nodes(source, findings) is None
    (finding,) = findings
    assert finding.message == f"a key has {length:,} characters; YAML allows 1,024"
