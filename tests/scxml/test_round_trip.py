"""What the writer writes, the reader reads back to an equal Document."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devtools.random_charts.charts import documents
from fsmkit.diagnostics import Findings, Source, Span, Text
from fsmkit.document.document import DocData, DocState, DocTransition, Document, Kind, Trigger
from fsmkit.document.front_ends import FrontEnd
from fsmkit.language.statements import tree as stmt
from fsmkit.plugins import plugin

SCXML = plugin(FrontEnd, "scxml")
ReadChart = Callable[..., Any]
HERE = Span(Source("x", ""), 0, 0)


def again(document: Document) -> Document:
    findings = Findings()
    written = SCXML.write(document)
    found = SCXML.read(Source(document.source.name, written), findings)
    assert found is not None, (written, [d.message for d in findings])
    return found


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(documents())
def test_random_charts(document: Document) -> None:
    assert again(document) == document


def test_the_machines_of_the_examples() -> None:
    folder = Path(__file__).parents[2] / "machines"
    number = 0
    for path in sorted(folder.rglob("*.yaml")):
        findings = Findings()
        front_end = plugin(FrontEnd, "yaml")
        source = front_end.decode(path.read_bytes(), str(path), findings)
        if (
            source is None
            or "\nsystem:" in f"\n{source.text}"
            or path.name.endswith((".io.yaml", ".test.yaml"))
        ):
            continue
        document = front_end.read(source, findings)
        assert document is not None, path
        assert again(document) == document, path
        number += 1
    assert number >= 3


@pytest.mark.slow
def test_public_files(public_files: Path) -> None:
    number = 0
    for path in sorted(public_files.rglob("*")):
        if path.suffix not in (".scxml", ".xml", ".txml"):
            continue
        source = SCXML.decode(path.read_bytes(), str(path), Findings())
        document = None if source is None else SCXML.read(source, Findings())
        if document is not None:
            assert again(document) == document, path
            number += 1
    assert number > 300


def text(value: str) -> Text:
    return Text(value, HERE)


ODD = st.text(st.sampled_from("a& <>\"'\n\tä]"), min_size=1, max_size=6)
odd = ODD.map(str.strip).filter(bool).map(text)
words = st.sampled_from(["go", "a.b", "x-1", "ä"]).map(text)
statements = st.one_of(
    st.builds(stmt.Assign, words, odd, st.just(HERE)),
    st.builds(lambda e, a: stmt.Raise(e, (stmt.DocArgument(e, a),), HERE), words, odd),
    st.builds(lambda label, v: stmt.Log(text(label), (v,), HERE), ODD, odd),
    st.builds(stmt.Reply, odd, st.just(HERE)),
    st.builds(lambda why: stmt.Fail(why, HERE), ODD),
    st.builds(
        lambda e, c, d: stmt.DocSend(HERE, event=e, content=text(c), content_expr=d),
        words,
        ODD,
        odd,
    ),
    st.builds(
        lambda x: stmt.Assign(text("n"), text(x), HERE, "+"), st.sampled_from(["1", "a < b"])
    ),
    st.just(stmt.CallOperation(text('say("<&>")'), HERE)),
)


@settings(max_examples=60, deadline=None)
@given(st.lists(statements, max_size=3).map(tuple), odd, ODD.map(str.strip))
def test_odd_texts(block: tuple[Any, ...], guard: Text, doc: str) -> None:
    """Quotes, angle brackets, new lines and tabs survive in attributes and in texts."""
    transition = DocTransition(
        Trigger.EVENTLESS, HERE, guard=guard, content=block, id=guard, targets=(text("s"),)
    )
    state = DocState(
        text("s"), Kind.ATOMIC, HERE, transitions=(transition,), invariant=guard, doc=doc,
        entry=(block,) if block else (), data=(DocData(text("d"), guard, guard),),
    )  # fmt: skip
    document = Document(
        Source("chart.scxml", ""), text("chart"), DocState(None, Kind.COMPOUND, HERE,
        children=(state,)), doc=doc, datamodel="fsmkit",
    )  # fmt: skip
    assert again(document) == document


def test_the_layout_is_for_people(read: ReadChart) -> None:
    document = read(
        """
        <state id="a"><transition event="go" target="a"><script>go(1)</script></transition></state>
        """,
        datamodel="ecmascript",
    ).document
    assert SCXML.write(document) == (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="chart"'
        ' datamodel="ecmascript">\n'
        '  <state id="a">\n'
        '    <transition event="go" target="a">\n'
        "      <script>go(1)</script>\n"
        "    </transition>\n"
        "  </state>\n"
        "</scxml>\n"
    )
