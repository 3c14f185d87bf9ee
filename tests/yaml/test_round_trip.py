from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devtools.random_charts.charts import documents
from fsmkit.chart.elaborate import elaborate
from fsmkit.chart.loading import read_document as read_file
from fsmkit.diagnostics import Findings, FsmkitError, Source, Span, Text, render
from fsmkit.document.document import (
    Direction,
    DocEvent,
    DocInvoke,
    DocMember,
    DocState,
    DocTransition,
    DocType,
    Document,
    Kind,
    Trigger,
)
from fsmkit.document.front_ends import FrontEnd
from fsmkit.language.statements import tree as stmt
from fsmkit.plugins import plugin
from fsmkit.yaml.layout import Prose, Short, Tree
from fsmkit.yaml.layout import render as layout
from fsmkit.yaml.nodes import Mapping, Node, Scalar, Sequence, read_nodes
from fsmkit.yaml.reader import read_document
from fsmkit.yaml.writer import write_document
from tests.reading import charts_of_machines

ROOT = Path(__file__).parents[2]
CHARTS = charts_of_machines()
SOURCE = Source("<test>", "")
SPAN = Span(SOURCE, 0, 0)


def read(text: str) -> Document:
    findings = Findings()
    document = read_document(Source("written.yaml", text), findings)
    assert document is not None, "\n".join([text, *(render(finding) for finding in findings)])
    return document


@pytest.mark.parametrize("path", CHARTS, ids=lambda path: path.name)
def test_machines(path: Path) -> None:
    document = read_file(path, Findings())
    text = write_document(document)
    assert read(text) == document
    assert max(len(line) for line in text.splitlines()) < 160


@pytest.mark.slow
@settings(max_examples=60)
@given(documents())
def test_random_charts(document: Document) -> None:
    again = read(write_document(document))
    assert again == document
    assert elaborate((again,), Findings()) == elaborate((document,), Findings())
    assert write_document(again) == write_document(document)


TEXTS = st.text(alphabet="ab: #-?,[]{}'\"\\|>&*!%@`\n\t=<~é😀\x07\x85\u2028", max_size=12)
TREES = st.recursive(
    TEXTS,
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3).map(lambda d: d)
    ),
    max_leaves=12,
)


def shortened(tree: Any, width: int) -> Tree:
    match tree:
        case dict():
            return Short({key: shortened(value, width) for key, value in tree.items()}, width)
        case list():
            return Short([shortened(item, width) for item in tree], width)
        case _:
            return str(tree)


def plain(node: Node | None) -> Any:
    match node:
        case Mapping(entries):
            return {key.value: plain(value) for key, value in entries}
        case Sequence(items):
            return [plain(item) for item in items]
        case Scalar(text):
            return text.value
    raise AssertionError(node)


@pytest.mark.slow
@settings(max_examples=400)
@given(st.dictionaries(TEXTS, TREES, min_size=1, max_size=3), st.integers(0, 100))
def test_any_tree_is_read_back(tree: dict[str, Any], width: int) -> None:
    for written in (tree, {key: shortened(value, width) for key, value in tree.items()}):
        findings = Findings()
        text = layout(written)
        node = read_nodes(Source("a.yaml", text), findings)
        if any(finding.rule.name == "lost-text" for finding in findings):
            continue  # quotes or parentheses left open: not a text of ours
        assert not findings.has_errors, text
        assert plain(node) == tree, text


@pytest.mark.parametrize("length", [990, 1000, 1024, 1030, 5000])
def test_names_longer_than_keys_may_be(length: int) -> None:
    tree: dict[str, Any] = {"states": {"x" * length: {"on": {"go": "b"}}, "b": "c"}}
    findings = Findings()
    assert plain(read_nodes(Source("a.yaml", layout(tree)), findings)) == tree
    assert not list(findings)


@given(st.text(alphabet="ab c\n", max_size=300))
def test_descriptions_are_wrapped(doc: str) -> None:
    text = layout({"doc": Prose(doc.strip())})
    node = plain(read_nodes(Source("a.yaml", text), Findings()))
    assert node["doc"].strip() == doc.strip()


def text(value: str) -> Text:
    return Text(value, SPAN)


def document_of(*states: DocState, **more: Any) -> Document:
    root = DocState(None, Kind.COMPOUND, SPAN, children=states)
    return Document(SOURCE, text("T"), root, **more)


def test_what_only_scxml_has() -> None:
    inner = document_of(DocState(text("c"), Kind.FINAL, SPAN, done_content=text("'ok'")))
    invoke = DocInvoke(
        SPAN, id=text("i"), autoforward=True, arguments=(stmt.DocArgument(text("x"), text("1")),),
        name_list=(text("y"), text("z")), content=inner, finalize=(),
    )  # fmt: skip
    other = DocInvoke(SPAN, id_location=text("l"), type_expr=text("t"), src_expr=text("s"))
    state = DocState(
        text("a"), Kind.ATOMIC, SPAN, invokes=(invoke, other), entry=((), ()),
        done_data=(stmt.DocArgument(text("n"), text("x > 1 ? 2 : 3")),),
    )  # fmt: skip
    document = document_of(state, datamodel="ecmascript", late_binding=True)
    assert read(write_document(document)) == document


@pytest.mark.parametrize(
    "waits",
    [
        [("a",), "eventless", ("b",)],
        [("a",), ("*",), ("a",)],
        [("a,b",)],
        [("a", "b"), "after", ("c",), "every", "sometimes"],
        [("x" * 300,)],
    ],
)
def test_transitions_that_the_keys_cannot_sort(waits: list[Any]) -> None:
    transitions = tuple(
        DocTransition(Trigger.EVENT, SPAN, tuple(map(text, wait)), targets=(text("a"),))
        if isinstance(wait, tuple)
        else DocTransition(
            Trigger(wait), SPAN, delay=text("1s") if wait in ("after", "every") else None
        )
        for wait in waits
    )
    document = document_of(DocState(text("a"), Kind.ATOMIC, SPAN, transitions=transitions))
    written = write_document(document)
    assert "transitions:" in written
    assert read(written) == document


def test_events_that_directions_cannot_sort() -> None:
    events = tuple(
        DocEvent(text(name), (), direction)
        for name, direction in (("a", Direction.IN), ("b", Direction.OUT), ("c", Direction.IN))
    )
    document = document_of(DocState(text("s"), Kind.ATOMIC, SPAN), events=events)
    assert read(write_document(document)) == document


def test_states_without_a_name_get_the_one_they_mean() -> None:
    child = DocState(None, Kind.ATOMIC, SPAN)
    parent = DocState(None, Kind.COMPOUND, SPAN, children=(child,))
    document = document_of(parent, DocState(text("state.1"), Kind.ATOMIC, SPAN))
    chart = elaborate((document,), Findings())
    assert chart is not None
    assert elaborate((read(write_document(document)),), Findings()) == chart


@pytest.mark.parametrize(
    ("notation", "statement"),
    [
        ("yaml", stmt.Assign(text("x = ++"), text("y == 1"), SPAN)),
        ("yaml", stmt.Assign(text("x"), text("1; y = 2"), SPAN, "+")),
        ("scxml", stmt.Assign(text("x"), text("1; y = 2"), SPAN, "+")),
        ("yaml", stmt.CallOperation(text("128 && 128"), SPAN)),
        ("scxml", stmt.CallOperation(text("128 && 128"), SPAN)),
        ("scxml", stmt.CallOperation(text("a() }"), SPAN)),
    ],
)
def test_what_reads_as_something_else_cannot_be_said(
    notation: str, statement: stmt.WrittenStatement
) -> None:
    follows = stmt.CallOperation(text("b()"), SPAN)
    state = DocState(text("a"), Kind.ATOMIC, SPAN, entry=((statement, follows),))
    with pytest.raises(FsmkitError) as caught:
        plugin(FrontEnd, notation).write(document_of(state, datamodel="ecmascript"))
    assert [d.rule.name for d in caught.value.diagnostics] == ["not-expressible"]


@pytest.mark.parametrize("follows", [1, 20])
def test_a_value_that_ends_like_a_sign_does_not_take_the_next_line(follows: int) -> None:
    more = (stmt.CallOperation(text("b()"), SPAN),) * follows
    block: stmt.Block = (stmt.Assign(text("x"), text("<a/>"), SPAN), *more)
    state = DocState(text("a"), Kind.ATOMIC, SPAN, entry=(block,))
    document = document_of(state, datamodel="ecmascript")
    assert read(write_document(document)) == document


def test_a_name_of_two_words_is_no_attribute() -> None:
    names = DocType(text("T"), (DocMember(text("a")), DocMember(text("b c"))))
    document = document_of(DocState(text("a"), Kind.ATOMIC, SPAN), types=(names,))
    assert read(write_document(document)) == document
    with pytest.raises(FsmkitError, match="white space"):
        plugin(FrontEnd, "scxml").write(document)


def test_two_states_of_one_name_cannot_be_said() -> None:
    twice = DocState(text("a"), Kind.ATOMIC, SPAN)
    with pytest.raises(FsmkitError) as caught:
        write_document(document_of(twice, twice))
    assert [d.rule.name for d in caught.value.diagnostics] == ["not-expressible"]
