"""Attributes and texts know their exact place, entities and odd characters or not."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from fsmkit.diagnostics import Findings, Source
from fsmkit.scxml.nodes import decode, read_nodes

ReadChart = Callable[..., Any]


def test_an_attribute_with_entities(read: ReadChart) -> None:
    text = """<state id="ä€😀"><transition
        cond='a &lt; 1 &amp;&amp; "b"' target = "x   yy"/></state>"""
    (state,) = read(text).document.root.children
    (transition,) = state.transitions
    source = transition.span.source.text
    guard = transition.guard
    assert guard.value == 'a < 1 && "b"'
    at = guard.span_of(guard.value.index("&&"), guard.value.index("&&") + 2)
    assert source[at.start :].startswith("&amp;&amp;")
    b = guard.span_of(guard.value.index("b"), guard.value.index("b") + 1)
    assert source[b.start : b.end] == "b"
    x, yy = transition.targets
    assert [source[t.span.start : t.span.end] for t in (x, yy)] == ["x", "yy"]
    assert source[state.id.span.start : state.id.span.end] == "ä€😀"


def test_statements_of_a_script(read: ReadChart) -> None:
    (state,) = read(
        """
        <state id="a"><onentry><script>
           x = 1;<!-- why -->
           <![CDATA[ if x < 2 { yyy = 3 } ]]>
        </script></onentry></state>
        """
    ).document.root.children
    assign, branch = state.entry[0]
    source = assign.span.source.text
    assert source[assign.location.span.start : assign.location.span.end] == "x"
    inner = branch.branches[0].body[0]
    assert source[inner.location.span.start : inner.location.span.end] == "yyy"


def test_a_finding_in_a_script_stands_where_it_is_written(read: ReadChart) -> None:
    result = read("<state id='ü'><onentry><script>x = 1; y +</script></onentry></state>")
    assert result.errors
    (line, _) = result.found[0].primary.span.source.position(result.found[0].primary.span.start)
    assert line == 2


names = st.sampled_from(["a", "b", "c.d", "e-f"])
values = st.text(st.sampled_from("ab &<\"'\n\tä😀;x"), max_size=8)


@given(st.lists(st.tuples(names, values), max_size=4, unique_by=lambda pair: pair[0]), values)
def test_places_match_values(attributes: list[tuple[str, str]], text: str) -> None:
    def escaped(value: str) -> str:
        return value.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&#34;")

    written = "".join(f'\n {name} ="{escaped(value)}"' for name, value in attributes)
    source = Source("x", f"<?xml version='1.0'?><!-- ü --><r><e{written}>{escaped(text)}</e></r>")
    root = read_nodes(source, Findings())
    assert root is not None
    (element,) = root.children
    assert [(a.name, a.value.value) for a in element.attributes] == [
        (name, value.replace("\n", " ").replace("\t", " ")) for name, value in attributes
    ]
    for value in (*(a.value for a in element.attributes), element.text):
        for i, char in enumerate(value.value):
            start = value.span_of(i, i + 1).start
            there = source.text[start]
            assert there == (char if char not in '&<"' else "&") or there.isspace()


def test_encodings() -> None:
    text = '<?xml version="1.0" encoding="{}"?><scxml name="ä"/>'
    for encoding in ("utf-8", "iso-8859-1", "utf-16", "windows-1252"):
        findings = Findings()
        source = decode(text.format(encoding).encode(encoding), "x", findings)
        assert source is not None
        root = read_nodes(source, findings)
        assert root is not None
        assert str(root.get("name")) == "ä"
    source = decode(b'\xef\xbb\xbf<a\r\n b="1"/>', "x", Findings())
    assert source is not None
    assert source.text == '<a\n b="1"/>'


def test_wrong_encodings() -> None:
    for content, mark in ((b"<?xml version='1.0' encoding='klingon'?><a/>", "klingon"),
                          (b"<a b='\xff'/>", "'")):  # fmt: skip
        findings = Findings()
        assert decode(content, "x", findings) is None
        (found,) = findings
        assert found.rule.name == "unknown-encoding"
        assert found.primary is not None
        span = found.primary.span
        assert span.source.text[span.start : span.end] == mark
